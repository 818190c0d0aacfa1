// Deviation from extend_rows.cpp on purpose: places are counted from the detector's nearer edge, weights are
// the integral of 30 s^2 (1 - s)^2 as a sum of powers, in long double, and each sample is gathered
// from where it comes.
#include "vdvr/expert/rows_to_verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/verify/witness/series_to_verify.hpp"
#include "host/verify/witness/upright_to_verify.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Of 30 s^2 (1 - s)^2 from 0 to r.
long double share_of_far(long double r) {
  if (r <= 0) return 0;
  if (r >= 1) return 1;
  const long double cube = r * r * r;
  return 10 * cube - 15 * cube * r + 6 * cube * r * r;
}

/// Where each sample of a longer row comes from, and times what.
struct Source {
  std::int64_t column = -1;  ///< of the detector; -1: nothing
  float weight = 0;          ///< of half acquisition
  float taper = 1;           ///< of padding
};

struct LongerRow {
  std::vector<Source> sources;
  std::int64_t before = 0, after = 0;
};

LongerRow longer_row(const ParallelGeometry& own, bool half, Padding padding) {
  const std::int64_t U = own.columns;
  const long double last_edge = static_cast<long double>(U) - 0.5L, from_first = own.center + 0.5L,
                    from_last = last_edge - own.center;
  const bool first_is_near = from_first <= from_last;
  const long double near = std::min(from_first, from_last), far = std::max(from_first, from_last);
  LongerRow row;
  std::int64_t zeros = 0;
  // As many as bring the nearer edge as far out as the other one.
  while (half && near + static_cast<long double>(zeros) < far - 1e-9L) ++zeros;
  const std::int64_t padded = padding == Padding::none ? 0 : U - U / 2;
  row.before = half && first_is_near ? zeros : padded;
  row.after = half && !first_is_near ? zeros : padded;
  for (std::int64_t j = -row.before; j < U + row.after; ++j) {
    Source s;
    const bool beyond_first = j < 0, beyond_last = j >= U;
    if ((beyond_first || beyond_last) && half && beyond_first == first_is_near) {
      row.sources.push_back(s);
      continue;
    }
    const std::int64_t out = beyond_first ? -j : beyond_last ? j - (U - 1) : 0;  // 1 beyond the edge
    if (out > 0) {
      s.taper = static_cast<float>(
          share_of_far(1 - static_cast<long double>(out) / static_cast<long double>(padded + 1)));
      const std::int64_t inwards = padding == Padding::mirror ? out - 1 : 0;
      s.column = beyond_first ? inwards : U - 1 - inwards;
    } else {
      s.column = j;
    }
    const auto column = static_cast<long double>(s.column);
    const long double from_edge = first_is_near ? column + 0.5L : last_edge - column;
    s.weight = half ? static_cast<float>(2 * share_of_far(from_edge / (2 * near))) : 1.0f;
    row.sources.push_back(s);
  }
  return row;
}

// Each view's rows at the heights that all views see.
void to_common_heights(ProjectionSet& scan, const RowsRoom& room) {
  ParallelGeometry& g = scan.geometry;
  const long double top = *std::max_element(g.row_shift.begin(), g.row_shift.end()),
                    bottom = *std::min_element(g.row_shift.begin(), g.row_shift.end());
  std::int64_t common = g.rows;
  while (common > 0 &&
         static_cast<long double>(common) > static_cast<long double>(g.rows) - (top - bottom) + 1e-9L)
    --common;
  if (common < 1) throw InputError("rows_to_verify: views share no height");
  const std::int64_t n = g.rows, U = g.columns;
  const SeriesWeights series(n);
  SampleArray out(at(g.views() * common * U), room(g.views(), common, U),
                  "the projections at common heights");
  parallel_for(g.views(), {}, "heights to verify", [&](std::int64_t k) {
    for (std::int64_t j = 0; j < common; ++j) {
      // From the middle of the rows to the middle of the heights.
      const long double y = 0.5L * static_cast<long double>(n - 1) +
                            (static_cast<long double>(j) - 0.5L * static_cast<long double>(common - 1)) +
                            (static_cast<long double>(g.row_shift[at(k)]) - 0.5L * (top + bottom));
      float* row = out.data() + (k * common + j) * U;
      const float* view = scan.data.data() + k * n * U;
      const auto whole = static_cast<std::int64_t>(std::llround(y));
      if (std::abs(y - static_cast<long double>(whole)) <= 1e-9L) {
        std::copy_n(view + std::clamp<std::int64_t>(whole, 0, n - 1) * U, U, row);
        continue;
      }
      const std::vector<double> weights = series(y);
      for (std::int64_t u = 0; u < U; ++u) {
        long double sum = 0;
        for (std::int64_t v = 0; v < n; ++v)
          sum += static_cast<long double>(weights[at(v)]) * static_cast<long double>(view[v * U + u]);
        row[u] = static_cast<float>(sum);
      }
    }
  });
  scan.data = std::move(out);
  g.rows = common;
  g.extension.common_heights = true;
}

}  // namespace

ProjectionSet rows_to_verify(ProjectionSet measured, const FieldOptions& field,
                             std::uint64_t max_memory_bytes, const std::filesystem::path& scratch) {
  const RowsRoom room = [&](std::int64_t views, std::int64_t rows, std::int64_t columns) {
    const std::shared_ptr<Scratch> own = measured.data.scratch();
    return own ? own : scratch_for_scan(views, rows, columns, max_memory_bytes, scratch);
  };
  const bool half = field.preparation.half_acquisition.value_or(false);
  const Padding padding = field.preparation.padding;
  ParallelGeometry& g = measured.geometry;
  if (g.extension.before > 0 || g.extension.after > 0)
    throw InputError("rows_to_verify: the scan's rows are longer than the detector already");
  const Heights heights = field.preparation.heights.value_or(Heights::as_seen);
  const bool as_seen = g.row_shift.empty() && g.axis_roll_deg == 0;
  if ((heights != Heights::as_seen) == as_seen || g.extension.common_heights || !g.series.none())
    throw InputError(
        "rows_to_verify: heights are not as the certificate says: give the scan's own rows, shifts and roll "
        "of "
        "the axis");
  if (heights == Heights::all) to_all_heights(measured, half, room);
  else if (g.axis_roll_deg != 0) to_upright_rows(measured, room);
  else if (heights == Heights::common) to_common_heights(measured, room);
  measured.report.preparation.heights = field.preparation.heights;
  measured.report.preparation.half_acquisition = field.preparation.half_acquisition;
  measured.report.preparation.padding = padding;
  g.extension.half_acquisition = field.preparation.half_acquisition;
  if (!half && padding == Padding::none) return measured;
  if (measured.cone)
    throw InputError("rows_to_verify: rows of parallel beam are made longer, not of cone beam");
  const std::int64_t cut = g.extension.cut;
  if (field.center) g.center = *field.center - static_cast<double>(cut);
  if (!(g.center > -0.5 && g.center < static_cast<double>(g.columns) - 0.5))
    throw InputError(fmt::format("centre {}: off the {} columns", g.center, g.columns));
  const LongerRow row = longer_row(g, half, padding);
  const std::int64_t U = g.columns, wide = std::ssize(row.sources), lines = g.views() * g.rows;
  SampleArray longer(at(lines * wide), room(g.views(), g.rows, wide), "the projections with longer rows");
  parallel_for(lines, {}, "rows to verify", [&](std::int64_t line) {
    for (std::int64_t j = 0; j < wide; ++j) {
      const Source& s = row.sources[at(j)];
      if (s.column < 0) longer[at(line * wide + j)] = 0;
      else longer[at(line * wide + j)] = s.taper * (s.weight * measured.data[at(line * U + s.column)]);
    }
  });
  measured.data = std::move(longer);
  g.extension = {field.preparation.half_acquisition, padding, row.before, row.after, g.center,
                 heights == Heights::common,         cut};
  g.columns = wide;
  g.center += static_cast<double>(row.before);
  return measured;
}

}  // namespace vdvr
