// A uniform grid of cells in world space, and the plain volume on its samples. Axis order here: x, y, z.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace vdvr {

using Vec3 = std::array<double, 3>;          ///< x, y, z
using Index3 = std::array<std::int64_t, 3>;  ///< x, y, z

/// `cells[a]` cells of width `spacing[a]` along axis a, hence cells[a] + 1 samples; the first sample lies at
/// `origin`.
struct Grid {
  Index3 cells{0, 0, 0};
  Vec3 origin{0, 0, 0};
  Vec3 spacing{1, 1, 1};
  std::string unit = "pixel";

  [[nodiscard]] Index3 samples() const { return {cells[0] + 1, cells[1] + 1, cells[2] + 1}; }
  [[nodiscard]] std::int64_t sample_count() const { return (cells[0] + 1) * (cells[1] + 1) * (cells[2] + 1); }
  [[nodiscard]] Vec3 position(const Index3& i) const {
    return {origin[0] + static_cast<double>(i[0]) * spacing[0],
            origin[1] + static_cast<double>(i[1]) * spacing[1],
            origin[2] + static_cast<double>(i[2]) * spacing[2]};
  }
};

/// float samples[z][y][x] on a grid's samples (cells + 1 per axis).
struct Volume {
  Grid grid;
  std::vector<float> samples;
};

}  // namespace vdvr
