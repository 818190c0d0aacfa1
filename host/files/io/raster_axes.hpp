// How the axes of a raster file run in the world.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace vdvr::io {

/// How the axes of a file run in the world, whose x, y and z are 0, 1 and 2.
struct RasterAxes {
  std::array<std::size_t, 3> along{0, 1, 2};
  std::array<bool, 3> reversed{false, false, false};
  [[nodiscard]] bool are_plain() const {
    return along == std::array<std::size_t, 3>{0, 1, 2} && reversed == std::array<bool, 3>{};
  }
};

/// By axis of the file, in the world, from one sample to the next.
using AxisDirections = std::array<std::array<double, 3>, 3>;

/// The axes of x, y and z that `directions` follow, to `out`; what is wrong with them, or nothing. They are
/// oblique where a sample would be off by more than a thousandth of the spacing: files hold rounded
/// directions. `samples` and `spacing` by axis of the file.
std::string straight_axes(const AxisDirections& directions, const std::array<std::int64_t, 3>& samples,
                          const std::array<double, 3>& spacing, RasterAxes& out);

}  // namespace vdvr::io
