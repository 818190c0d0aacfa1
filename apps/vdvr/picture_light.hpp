// Whose light a certified picture is under: --certify-light. Called by: certify_render.
#pragma once

#include "apps/vdvr/source.hpp"

namespace vdvr::cli {

void add_picture_light(Arguments& args);
/// The light of F itself is asked for.
bool asks_lit(const Arguments& args);
/// Throws InputError where --certify-light does not go with the other options.
void check_picture_light(const Arguments& args, const RenderOptions& options);
/// Cuts what is drawn to where F's differences are known; throws InputError where nothing is left.
void cut_to_differences(Clip& clip, const Clip& known, const Grid& grid);
/// Intervals of pixels under the light of F, which is known in `known`.
PixelBounds certify_lit(const Source& source, const Clip& known, const RenderOptions& options,
                        const CertifyPictureOptions& certify, const Progress& progress);

}  // namespace vdvr::cli
