// What is known of the noise of a scan that a command reads.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/common/arguments.hpp"
#include "vdvr/expert/noise.hpp"

namespace vdvr::cli {

/// --photons and --sigma-p: what is known of the noise in place of what the scan tells.
void add_noise(Arguments& args);
NoiseOptions noise_options(const Arguments& args);

struct NoiseFound {
  std::optional<ScanNoise> noise;
  std::string why;  ///< where there is none
};
/// Of the scan that was read from `path` with the same options.
NoiseFound noise_of_scan(const std::filesystem::path& path, const Arguments& args, const FieldOptions& field,
                         const ProjectionSet& scan);

}  // namespace vdvr::cli
