// A soft blob with empty space around, and pictures of it.
#pragma once

#include <algorithm>
#include <cstring>
#include <vector>

#include "host/base/opencl/cl.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::support {

inline RenderOptions options_for(const Grid& grid, RenderMode mode, std::int64_t size = 48) {
  RenderOptions o;
  o.mode = mode;
  o.width = o.height = size;
  o.camera = orbit_camera(grid, 37, 21, 1);
  o.transfer = transfer_preset("default", 0, 1);
  o.surfaces = {{0}};
  return o;
}

inline bool same_bits(const std::vector<cl_float4>& a, const std::vector<cl_float4>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(cl_float4)) == 0;
}

// Soft blob off the centre with empty space around: every mode has something to skip and something to show.
inline double blob(double x, double y, double z) {
  const double r2 = (x - 3) * (x - 3) + (y + 2) * (y + 2) * 1.5 + (z - 1) * (z - 1) * 0.7;
  return std::max(0.0, 1 - r2 / 90);
}
inline MixedVolume mixed_blob() {
  return fields::mixed(fields::centred_grid({30, 27, 33}), 4, scattered_levels, blob);
}
// With a base of every 2nd, 4th and 4th cell.
inline MixedVolume coarse_blob() {
  return fields::mixed(fields::centred_grid({30, 28, 32}), 4, scattered_levels, blob, {2, 2, 1});
}

}  // namespace vdvr::support
