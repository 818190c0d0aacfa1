// Which part of a volume is drawn: --clip, --clip-covered, --covered-from. Called by: the render command.
#pragma once

#include <optional>

#include "apps/vdvr/inputs.hpp"
#include "vdvr/progress.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::cli {

void add_clip(Arguments& args);
/// Where the scene is covered: the certificate's cylinder, cut with its region of interest. Of files that do
/// not say, from the scan that --covered-from names. Throws InputError for a scene without certificate, and
/// for a file that does not say where no scan is named.
Clip covered_clip(const Arguments& args, const Scene& scene, const Progress& progress);
/// The certificate's cylinder, cut with its region of interest: where bounds speak of F.
Clip known_clip(const CoveredCylinder& covered, const Certificate& certificate);
/// What the options ask for; nothing where they ask for nothing. Throws as covered_clip.
std::optional<Clip> clip_for(const Arguments& args, const Scene& scene, const Progress& progress);
/// Cuts `clip` to what also lies in `box`.
void cut(Clip& clip, const Vec3& low, const Vec3& high);
/// What a certified picture draws: of options.clip what is covered. Throws as covered_clip and require_some.
Clip certified_clip(const Arguments& args, const Scene& scene, const RenderOptions& options,
                    const Progress& progress);
/// Throws InputError where nothing of --clip's box can lie in the cylinder of `clip`.
void require_some(const Clip& clip);

}  // namespace vdvr::cli
