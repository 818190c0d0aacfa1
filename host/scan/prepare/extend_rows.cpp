#include "vdvr/expert/extend_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/scan/geometry/angular_gaps.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/scratch.hpp"

namespace vdvr {
namespace {

// Half the overlap, in columns: with 4.8 an object of density 1 was off by .03 at worst, with 1.8 by .52.
constexpr double least_half_overlap = 5;
// Beyond it, of the largest column's mean, an edge is not air.
constexpr double share_of_object = 0.05;
constexpr double degrees = 180 / std::numbers::pi;

// From 0 at -1 to 1 at 1, with two continuous derivatives.
double step(double x) {
  const double r = 0.5 * (1 + std::clamp(x, -1.0, 1.0));
  return r * r * r * (10 + r * (6 * r - 15));
}

// Columns from the axis to the edges of the detector itself.
struct Sides {
  explicit Sides(const ParallelGeometry& own)
      : below(own.center + 0.5),
        above(static_cast<double>(own.columns) - 0.5 - own.center),
        far(std::max(below, above)),
        near(std::min(below, above)) {}
  double below, above, far, near;
};

double arc_of(const ParallelGeometry& g) {
  if (g.theta_rad.empty()) return 0;
  const auto [low, high] = std::minmax_element(g.theta_rad.begin(), g.theta_rad.end());
  return *high - *low;
}

// The axis as messages count it: in the detector's columns, some of which a leaning axis leaves out.
double detector_column(const ParallelGeometry& own) {
  return own.center + static_cast<double>(own.extension.cut);
}
std::int64_t detector_columns(const ParallelGeometry& own) { return own.columns + 2 * own.extension.cut; }

void require_half_acquisition(const ParallelGeometry& own) {
  const Sides sides(own);
  if (!(sides.near > 0))
    throw InputError(fmt::format(
        "half acquisition: the axis, column {:.2f}, lies off the detector's {} columns, so that no "
        "view sees what is around it; correct `center`",
        detector_column(own), detector_columns(own)));
  if (sides.near < least_half_overlap)
    throw InputError(fmt::format(
        "half acquisition: opposite views overlap by {:.1f} columns (the axis is at column {:.2f} of {}), "
        "and "
        "{:.0f} are needed to go over from one to the other; correct `center`, or measure with more overlap",
        2 * sides.near, detector_column(own), detector_columns(own), 2 * least_half_overlap));
  const AngularGaps gaps = angular_gaps(own.theta_rad, 2 * std::numbers::pi);
  const std::vector<double> wedges = gaps.wedges_rad();
  if (gaps.one_direction || !wedges.empty())
    throw InputError(
        fmt::format("half acquisition: needs a full turn, and {:.1f} degrees of it have no view (the angles "
                    "cover {:.1f}): "
                    "what lies beyond the nearer edge is seen half a turn later only; `half_acquisition` off "
                    "takes the views "
                    "as they are",
                    wedges.empty() ? 360.0 : wedges.front() * degrees, arc_of(own) * degrees));
}

RowExtension extension_of(const ParallelGeometry& own, bool half, Padding padding) {
  RowExtension e;
  e.common_heights = own.extension.common_heights;
  e.cut = own.extension.cut;
  e.padding = padding;
  e.center = own.center;
  const Sides sides(own);
  // 1e-9: rounding of the centre makes no further column.
  const auto zeros =
      half ? static_cast<std::int64_t>(std::ceil(sides.far - sides.near - 1e-9)) : std::int64_t{0};
  const std::int64_t padded = padding == Padding::none ? 0 : (own.columns + 1) / 2;
  const bool far_is_above = sides.above >= sides.below;
  e.before = half && far_is_above ? zeros : padded;
  e.after = half && !far_is_above ? zeros : padded;
  return e;
}

bool is_half(const ParallelGeometry& g) { return g.extension.half_acquisition.value_or(false); }

// 2 m of the detector's own columns; 1 where rows are not weighted.
std::vector<float> factors_of(const ParallelGeometry& own, bool half) {
  std::vector<float> factors(at(own.columns), 1.0f);
  if (!half) return factors;
  const Sides sides(own);
  const double towards_far = sides.above >= sides.below ? 1 : -1;
  for (std::int64_t i = 0; i < own.columns; ++i)
    factors[at(i)] =
        static_cast<float>(2 * step(towards_far * (static_cast<double>(i) - own.center) / sides.near));
  return factors;
}

// Of padding: from 1 beyond the detector's edge to 0.
std::vector<float> taper_of(std::int64_t columns) {
  std::vector<float> taper(at(columns));
  for (std::int64_t j = 0; j < columns; ++j)
    taper[at(j)] =
        static_cast<float>(step(1 - 2 * static_cast<double>(j + 1) / static_cast<double>(columns + 1)));
  return taper;
}

// How much of the largest column's mean the outermost ones hold that nothing goes on from, and on which side.
std::pair<double, const char*> left_at_edges(const ProjectionSet& scan, const RowExtension& e) {
  const ParallelGeometry& g = scan.geometry;
  std::vector<double> sums(at(g.columns));
  parallel_for(g.columns, {}, "", [&](std::int64_t i) {
    // A sample of views tells; rows and views all the same.
    const std::int64_t lines = g.views() * g.rows, by = std::max<std::int64_t>(1, lines / 4096);
    for (std::int64_t line = 0; line < lines; line += by)
      sums[at(i)] += static_cast<double>(scan.data[at(line * g.columns + i)]);
  });
  const double largest = *std::max_element(sums.begin(), sums.end());
  if (!(largest > 0) || g.columns < 8) return {0, ""};
  const auto mean = [&](std::size_t first) { return (sums[first] + sums[first + 1] + sums[first + 2]) / 3; };
  const Sides sides(g);
  const bool half = e.half_acquisition.value_or(false);
  const double low = half && sides.above >= sides.below ? 0 : mean(0) / largest,
               high = half && sides.above < sides.below ? 0 : mean(at(g.columns - 3)) / largest;
  return low > high ? std::pair{low, "first"} : std::pair{high, "last"};
}

// own[columns] to out[before + columns + after].
void extend(const float* own, std::int64_t columns, const RowExtension& e, const std::vector<float>& factors,
            const std::vector<float>& taper, float* out) {
  std::fill(out, out + e.before, 0.0f);
  std::fill(out + e.before + columns, out + e.before + columns + e.after, 0.0f);
  for (std::int64_t i = 0; i < columns; ++i) out[e.before + i] = factors[at(i)] * own[i];
  if (e.padding == Padding::none) return;
  const bool half = e.half_acquisition.value_or(false);
  const auto n = std::ssize(taper);
  const float* first = out + e.before;
  for (std::int64_t j = 0; j < n; ++j) {
    const std::int64_t from = e.padding == Padding::edge ? 0 : j;
    // Beyond the nearer edge of half acquisition rows are zero.
    if (!half || factors.front() > 1) out[e.before - 1 - j] = taper[at(j)] * first[from];
    if (!half || factors.back() > 1) out[e.before + columns + j] = taper[at(j)] * first[columns - 1 - from];
  }
}

void make_longer(ProjectionSet& scan, const RowExtension& e, std::uint64_t max_memory_bytes,
                 const std::filesystem::path& scratch) {
  ParallelGeometry& g = scan.geometry;
  const std::int64_t columns = g.columns, wide = e.before + columns + e.after, lines = g.views() * g.rows;
  const std::vector<float> factors = factors_of(g, e.half_acquisition.value_or(false)),
                           taper = taper_of(e.padding == Padding::none ? 0 : (columns + 1) / 2);
  const std::uint64_t bytes = static_cast<std::uint64_t>(lines * wide) * sizeof(float);
  auto room = scratch_for_scan(g.views(), g.rows, wide, max_memory_bytes, scratch);
  io::require_memory(scan.data.resident_bytes() + (room ? max_memory_bytes / 8 : bytes), max_memory_bytes,
                     fmt::format("rows of {} columns, made longer from {}", wide, columns));
  SampleArray longer(at(lines * wide), std::move(room), "the projections with longer rows");
  parallel_for(g.views(), {}, "", [&](std::int64_t k) {
    for (std::int64_t line = k * g.rows; line < (k + 1) * g.rows; ++line)
      extend(scan.data.data() + line * columns, columns, e, factors, taper, longer.data() + line * wide);
  });
  scan.data = std::move(longer);
  g.columns = wide;
  g.center += static_cast<double>(e.before);
  g.extension = e;
}

std::string words_of(const ParallelGeometry& own) {
  const Sides sides(own);
  return fmt::format(
      "half acquisition: a full turn about an axis at column {:.2f} of {}; where opposite views overlap, "
      "over "
      "{:.0f} columns, weights go over from one to the other, and a circle of {:.1f} columns around the axis "
      "is "
      "covered",
      detector_column(own), detector_columns(own), 2 * sides.near, 2 * sides.far);
}

}  // namespace

bool looks_half_acquired(const ParallelGeometry& g) {
  const Sides sides(g);
  return arc_of(g) > 1.5 * std::numbers::pi && sides.near < 0.5 * sides.far;
}

std::string extend_rows(ProjectionSet& scan, const Preparation& wanted, std::uint64_t max_memory_bytes,
                        const std::filesystem::path& scratch) {
  Preparation& recorded = scan.report.preparation;
  if (scan.cone) {
    if (wanted.half_acquisition.value_or(false))
      throw InputError(
          "half acquisition: is of parallel beam; the displaced detector of cone beam is recognised by "
          "itself");
    if (wanted.padding != Padding::none)
      throw InputError("pad: rows of parallel beam can be padded, not those of cone beam");
    recorded.half_acquisition = {};
    return {};
  }
  ParallelGeometry& g = scan.geometry;
  if (!g.column_shift.empty() && wanted.half_acquisition.value_or(false))
    throw InputError(
        "half acquisition: its weights go by the distance from one axis, and the sample moved along columns; "
        "`half_acquisition` off takes the views as they are");
  const bool looks = g.column_shift.empty() && looks_half_acquired(g),
             half = wanted.half_acquisition.value_or(looks);
  if (!g.series.none() && half != g.series.full_turn)
    throw InputError(
        "half acquisition: the axis is off the middle of a scan all around, and the weights of a series of "
        "heights depend on what that means; state it by `half_acquisition`");
  if (half) require_half_acquisition(g);
  recorded.padding = wanted.padding;
  recorded.half_acquisition = {};
  if (half) recorded.half_acquisition = true;
  if (looks && !half) g.extension.half_acquisition = recorded.half_acquisition = false;
  const std::string words = half ? words_of(g) : "";
  RowExtension e = extension_of(g, half, wanted.padding);
  e.half_acquisition = recorded.half_acquisition;
  if (wanted.padding == Padding::none)
    if (const auto [share, side] = left_at_edges(scan, e); share > share_of_object)
      scan.report.notes.push_back(fmt::format(
          "rows do not end in air: the {} three columns hold {:.0f} % of the fullest; the object is wider "
          "than the detector, and densities bend up towards its edge; `pad` edge goes on beyond it",
          side, 100 * share));
  if (half || wanted.padding != Padding::none) make_longer(scan, e, max_memory_bytes, scratch);
  if (!half) return {};
  if (!wanted.half_acquisition) return words + "; `half_acquisition` off says otherwise";
  scan.report.notes.push_back(words);
  return {};
}

ParallelGeometry own_detector(const ParallelGeometry& g) {
  ParallelGeometry own = g;
  const RowExtension& e = g.extension;
  if (e.before > 0 || e.after > 0) {
    own.columns -= e.before + e.after;
    own.center = e.center;
  }
  own.extension = {};
  own.extension.common_heights = e.common_heights;
  own.extension.cut = e.cut;
  return own;
}

std::vector<float> row_factors(const ParallelGeometry& g) {
  const std::vector<float> own = factors_of(own_detector(g), is_half(g));
  std::vector<float> all(at(g.columns), 0.0f);
  std::copy(own.begin(), own.end(), all.begin() + g.extension.before);
  return all;
}

ProjectionSet own_rows(const ProjectionSet& scan) {
  if (scan.geometry.extension == own_detector(scan.geometry).extension) return scan;
  ProjectionSet out;
  out.geometry = own_detector(scan.geometry);
  out.report = scan.report;
  const std::int64_t wide = scan.geometry.columns, columns = out.geometry.columns,
                     before = scan.geometry.extension.before, rows = out.geometry.rows;
  const std::vector<float> factors = factors_of(out.geometry, is_half(scan.geometry));
  out.data = SampleArray(at(out.size()), scan.data.scratch(), "the projections as measured");
  parallel_for(out.geometry.views(), {}, "", [&](std::int64_t k) {
    for (std::int64_t line = k * rows; line < (k + 1) * rows; ++line)
      for (std::int64_t i = 0; i < columns; ++i)
        out.data[at(line * columns + i)] = scan.data[at(line * wide + before + i)] / factors[at(i)];
  });
  return out;
}

}  // namespace vdvr
