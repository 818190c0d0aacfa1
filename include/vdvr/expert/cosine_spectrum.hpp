// The cosine coefficients of an image or volume under half-sample mirror extension: the spectrum that bounds
// by amplitude are sums over.
#pragma once

#include <cstdint>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// In place: float values[z][y][x] of `size` (x, y, z) become a[m_z][m_y][m_x], with values = sum over m of a
/// times the product of cos(pi m_j (x_j + 1/2) / n_j). Cost: samples * (n_x + n_y + n_z) multiply-adds on the
/// device, in blocks of about 64 MiB.
VDVR_API void cosine_spectrum(Device& device, std::vector<float>& values, const Index3& size,
                              const Progress& progress = {});

}  // namespace vdvr
