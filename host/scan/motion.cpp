#include "host/scan/motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/base/system/length_unit.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

constexpr double still_pixels = 0.25;

// The longest run of views that stand still, as the file numbers them; empty where no two neighbours do.
ViewRanges longest_still(const RawScan& scan, const std::vector<double>& at, double tolerance) {
  std::size_t best_first = 0, best = 0;
  for (std::size_t first = 0; first < at.size();) {
    double low = at[first], high = low;
    std::size_t end = first + 1;
    for (; end < at.size(); ++end) {
      low = std::min(low, at[end]);
      high = std::max(high, at[end]);
      if (!(high - low <= tolerance)) break;
    }
    if (end - first > best) best = end - first, best_first = first;
    first = end;
  }
  if (best < 2) return {};
  const auto first = static_cast<std::int64_t>(best_first),
             last = first + static_cast<std::int64_t>(best) - 1;
  return {{scan.number(first), scan.number(last) + 1}};
}

// Pixels per unit of an axis' positions; nothing where the size of a pixel is not known in that unit.
std::optional<double> pixels_per_unit(const RawScan& scan, const std::string& unit, double pitch) {
  if (unit == scan.unit) return 1 / pitch;
  const auto from = metres_exponent(unit), to = metres_exponent(scan.unit);
  if (!from || !to) return {};
  return std::pow(10.0, *from - *to) / pitch;
}

}  // namespace

void require_still(const RawScan& scan, double pitch, const std::string& name) {
  for (const SamplePositions& axis : scan.positions) {
    const auto [low, high] = std::minmax_element(axis.at.begin(), axis.at.end());
    const double moved = *high - *low;
    if (moved == 0) continue;
    const auto scale = pixels_per_unit(scan, axis.unit, pitch);
    if (scale && moved * *scale <= still_pixels) continue;
    const std::string how_far = scale
                                    ? fmt::format("{:g} {}, {:.3g} pixels", moved, axis.unit, moved * *scale)
                                    : fmt::format(
                                          "{:g} {}; the size of a pixel is not known in that unit ('pitch' "
                                          "and 'unit' of scan.json state it)",
                                          moved, axis.unit);
    const ViewRanges still = longest_still(scan, axis.at, scale ? still_pixels / *scale : 0);
    throw FileError(
        fmt::format("{}: {}: the sample moves by {}; helical scans, series of heights and random shifts are "
                    "not supported, F is that of a sample that only turns{}",
                    name, axis.object, how_far,
                    still.empty() ? std::string()
                                  : fmt::format(". The longest part at rest is `views` {}", text_of(still))));
  }
}

}  // namespace vdvr::io
