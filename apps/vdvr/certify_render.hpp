// render --certify: a picture, the bound of its pixels and its certificate. Called by: the render command.
#pragma once

#include <filesystem>
#include <optional>

#include "apps/vdvr/overlay.hpp"
#include "vdvr/progress.hpp"

namespace vdvr::cli {

void add_certify(Arguments& args);
/// Whether the options ask for it.
/// Modes of which each ray is certified on the host.
inline bool is_certified_by_ray(RenderMode mode) {
  return mode == RenderMode::iso || mode == RenderMode::mip || mode == RenderMode::integral;
}
bool asks_certify(const Arguments& args);
/// Throws InputError for options that it does not take.
void check_certify(const Arguments& args, const RenderOptions& options);
/// What --show says of the bounds: bound, lo, hi, middle.
const std::vector<std::string>& bound_outputs();

/// Draws, certifies, writes, prints. Returns the exit code: 1 where --picture-tolerance is not met.
int certify_render(const Arguments& args, const CommonOptions& common, Source& source, RenderOptions options,
                   const Overlay& overlay, const std::filesystem::path& output, const Progress& progress);

}  // namespace vdvr::cli
