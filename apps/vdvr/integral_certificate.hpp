// `render --mode integral --certify`: what is certain of the integral of F along the ray of each pixel
// (docs/surfaces.md, "Line integrals").
#pragma once

#include <filesystem>

#include "apps/vdvr/ray_certificate.hpp"
#include "vdvr/certified_rays.hpp"

namespace vdvr::cli {

/// Refuses what goes with no certificate of integrals; before anything is read.
void check_integral_certificate(const Arguments& args, bool values);
/// As write_ray_certificate. `options` have the window that the picture was drawn with.
RayCertificate write_integral_certificate(const Arguments& args, Source& source, const RenderOptions& options,
                                          const RenderResult& drawn, const std::filesystem::path& output,
                                          const Progress& progress);
void print_integral_certificate(const RayCertificate& certificate);

}  // namespace vdvr::cli
