// Which part of a volume is drawn: --clip, --clip-covered, --covered-from.
#pragma once

#include <optional>

#include "apps/vdvr/inputs.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::cli {

void add_clip(Arguments& args);
/// From the scan that --covered-from names; else nothing.
std::optional<CoveredCylinder> covered_of(const Arguments& args, const Scene& scene,
                                          const Progress& progress);
/// What the options ask for; nothing where they ask for nothing. Throws InputError for a scene without
/// certificate, for a file that does not say where it is covered where no scan is named, and where nothing of
/// --clip is covered.
std::optional<Clip> clip_for(const Arguments& args, const Scene& scene, const Progress& progress);

}  // namespace vdvr::cli
