// The sampled band-limited ramp kernel, windowed (Kak and Slaney, Principles of Computerized Tomographic
// Imaging, eq. 3.61, times the pitch).
#pragma once

#include <cstdint>
#include <vector>

#include "vdvr/expert/field_options.hpp"

namespace vdvr {

/// g[0..n-1], g[-j] = g[j]: q[i] = sum_m g[i - m] p[m]. The kernel whose spectrum is |f| W(f) on the
/// detector's band, with W the window stretched to `cutoff` times Nyquist and zero above. Throws InputError
/// for an unknown filter or a bad cutoff.
std::vector<double> ramp_kernel(const FieldOptions& field, double pitch, std::int64_t n);

}  // namespace vdvr
