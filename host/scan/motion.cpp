#include "host/scan/motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/files/io/length_unit.hpp"
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

// Moved by more than a sample at rest; `pitch` in the scan's unit.
bool moves(const RawScan& scan, const SamplePositions& axis, double pitch) {
  const auto [low, high] = std::minmax_element(axis.at.begin(), axis.at.end());
  const auto scale = pixels_per_unit(scan, axis.unit, pitch);
  return *high > *low && !(scale && (*high - *low) * *scale <= still_pixels);
}

[[noreturn]] void refuse_motion(const RawScan& scan, const SamplePositions& axis, double pitch,
                                const std::string& name, const char* why) {
  const auto [low, high] = std::minmax_element(axis.at.begin(), axis.at.end());
  const auto scale = pixels_per_unit(scan, axis.unit, pitch);
  const std::string how_far =
      scale ? fmt::format("{:g} {}, {:.3g} pixels", *high - *low, axis.unit, (*high - *low) * *scale)
            : fmt::format(
                  "{:g} {}; the size of a pixel is not known in that unit ('pitch' and 'unit' of "
                  "scan.json state it)",
                  *high - *low, axis.unit);
  const ViewRanges still = longest_still(scan, axis.at, scale ? still_pixels / *scale : 0);
  throw FileError(fmt::format("{}: {}: the sample moves by {}; {}{}", name, axis.object, how_far, why,
                              still.empty()
                                  ? std::string()
                                  : fmt::format(". The longest part at rest is `views` {}", text_of(still))));
}

bool is_along(const SamplePositions& axis, const char* name) { return axis.object.ends_with(name); }

// In pixels, relative to the first view; nothing of a sample at rest.
std::vector<double> shift_of(const RawScan& scan, const SamplePositions& axis, double pitch,
                             const std::string& name) {
  if (!moves(scan, axis, pitch)) return {};
  const auto scale = pixels_per_unit(scan, axis.unit, pitch);
  if (!scale) refuse_motion(scan, axis, pitch, name, "`shifts` states it otherwise");
  std::vector<double> out;
  for (const double at : axis.at) out.push_back((at - axis.at.front()) * *scale);
  return out;
}

double range_of(const std::vector<double>& shift) {
  if (shift.empty()) return 0;
  const auto [low, high] = std::minmax_element(shift.begin(), shift.end());
  return *high - *low;
}

bool is_still(const std::vector<double>& shift) {
  return std::all_of(shift.begin(), shift.end(), [](double s) { return s == 0; });
}

}  // namespace

std::string part_at_rest(const RawScan& scan, double pitch) {
  for (const SamplePositions& axis : scan.positions) {
    if (!is_along(axis, "z_translation")) continue;
    const auto scale = pixels_per_unit(scan, axis.unit, pitch);
    const ViewRanges still = longest_still(scan, axis.at, scale ? still_pixels / *scale : 0);
    if (!still.empty()) return fmt::format(". The longest part at rest is `views` {}", text_of(still));
  }
  return {};
}

void set_shifts(RawScan& scan, const std::string& name, ParallelGeometry& g) {
  if (scan.cone || scan.shifts_source.empty())
    for (const SamplePositions& axis : scan.positions) {
      const bool rows = is_along(axis, "z_translation"), columns = is_along(axis, "x_translation");
      const double pitch = rows ? g.pitch_v : columns ? g.pitch_u : std::min(g.pitch_u, g.pitch_v);
      if (scan.cone || !(rows || columns)) {
        if (moves(scan, axis, pitch))
          refuse_motion(scan, axis, pitch, name,
                        scan.cone
                            ? "cone beam of a sample that moves is described by 'matrices'"
                            : "motion along the beam, or along an axis of other meaning, is not supported: "
                              "`shifts` states what columns and rows see of it");
        continue;
      }
      (rows ? g.row_shift : g.column_shift) = shift_of(scan, axis, pitch, name);
    }
  else {
    for (const double s : scan.shift_u) g.column_shift.push_back(s / g.pitch_u);
    for (const double s : scan.shift_v) g.row_shift.push_back(s / g.pitch_v);
  }
  g.axis_roll_deg = scan.axis_roll_deg;
  if (g.axis_roll_deg != 0)
    scan.notes.push_back(
        fmt::format("axis roll: {:g} degrees in the detector's plane, as {} says; F follows it",
                    g.axis_roll_deg, scan.axis_roll_source));
  if (is_still(g.column_shift)) g.column_shift.clear();
  if (is_still(g.row_shift)) g.row_shift.clear();
  if (g.column_shift.empty() && g.row_shift.empty()) return;
  const std::string how_far = fmt::format("the sample moves by {:.3g} columns and {:.3g} rows between views",
                                          range_of(g.column_shift), range_of(g.row_shift));
  if (!scan.shifts_source.empty())
    scan.notes.push_back(fmt::format("shifts: {}, as {} says; F follows it", how_far, scan.shifts_source));
  else
    scan.warnings.push_back(fmt::format(
        "shifts: {}, by x_translation and z_translation, taken as motion of the sample towards "
        "higher columns and rows; F follows it, and `residual` shows whether that is right; `shifts` "
        "none takes it to stand still",
        how_far));
}

}  // namespace vdvr::io
