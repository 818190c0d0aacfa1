#include "host/files/io/raster_axes.hpp"

#include <fmt/format.h>

#include <cmath>

namespace vdvr::io {
namespace {

constexpr double kStraight = 1e-3;  // of the spacing

}  // namespace

std::string straight_axes(const AxisDirections& directions, const std::array<std::int64_t, 3>& samples,
                          const std::array<double, 3>& spacing, RasterAxes& out) {
  std::array<bool, 3> taken{};
  for (std::size_t f = 0; f < 3; ++f) {
    const auto& d = directions[f];
    std::size_t most = 0;
    for (std::size_t a = 1; a < 3; ++a)
      if (std::abs(d[a]) > std::abs(d[most])) most = a;
    if (d[most] == 0) return fmt::format("gives axis {} no direction", f);
    if (taken[most]) return "is oblique; resample the file along x, y and z";
    taken[most] = true;
    out.along[f] = most;
    out.reversed[f] = d[most] < 0;
  }
  for (std::size_t a = 0; a < 3; ++a) {
    // How far the farthest sample lies beside where straight axes put it.
    double beside = 0, step = 0;
    for (std::size_t f = 0; f < 3; ++f) {
      const bool runs_here = out.along[f] == a;
      if (runs_here) step = spacing[f];
      const double straight = !runs_here ? 0 : out.reversed[f] ? -spacing[f] : spacing[f];
      beside += std::abs(directions[f][a] - straight) * static_cast<double>(samples[f] - 1);
    }
    if (!(beside <= kStraight * step))
      return fmt::format(
          "is oblique: along {} samples would be off by up to {:.3g}, the spacing is {:.6g}; resample the "
          "file "
          "along x, y and z",
          "xyz"[a], beside, step);
  }
  return "";
}

}  // namespace vdvr::io
