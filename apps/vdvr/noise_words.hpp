// The noise of a scan and of F, as `info` and `plan` tell it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/vdvr/certify.hpp"
#include "vdvr/noise.hpp"
#include "vdvr/noise_forecast.hpp"

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
Json noise_json(const NoiseFound& found);
void print_noise(const NoiseFound& found);

/// What F is worth on a plan's grid, and what tolerances in sigma would store.
struct FieldNoise {
  SigmaRange sigma;
  std::optional<SplitOfViews> split;
  std::vector<SigmaForecast> forecasts;
};
std::optional<FieldNoise> noise_of_plan(Device& device, const Planned& planned, const NoiseFound& found,
                                        const Progress& progress);
Json field_noise_json(const FieldNoise& noise, const Plan& plan);
void print_field_noise(const FieldNoise& noise, const Plan& plan);

}  // namespace vdvr::cli
