// Row by row: chords, integrals of F with their errors, bounds along the chords.
#include "vdvr/expert/residual.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "host/base/system/limits.hpp"
#include "host/base/system/outward.hpp"
#include "host/base/system/parallel.hpp"
#include "host/scan/geometry/weights_by_height.hpp"
#include "host/verify/residual/bounds_along.hpp"
#include "host/verify/residual/primitives.hpp"
#include "host/verify/residual/row_integrals.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/extend_rows.hpp"

namespace vdvr {
namespace {

std::pair<std::int64_t, std::int64_t> wanted_rows(const ParallelGeometry& g, const ResidualOptions& o) {
  const std::int64_t rows = o.rows < 0 ? g.rows - o.first_row : o.rows;
  if (o.first_row < 0 || rows < 1 || o.first_row + rows > g.rows)
    throw InputError(fmt::format("`rows` {} to {} are none of the detector's 0 to {}", o.first_row,
                                 o.first_row + rows - 1, g.rows - 1));
  return {o.first_row, rows};
}

// The sentences say why, so that nobody waits for what cannot come.
void check(const ProjectionSet& scan, const Certificate& certificate) {
  if (scan.cone)
    throw InputError(
        "residuals are of parallel beam: along a ray of cone beam F is a sum of q_k / lambda_k^2 on curves "
        "that "
        "cross the rows of every view, which has no antiderivative of a row");
  if (certificate.window)
    throw InputError(
        "the certificate has a window: outside of it nothing bounds |V - F|, so that nothing can be said of "
        "whole rays; build without --window");
}

ProjectionSet row_of(const ProjectionSet& scan, std::int64_t row) {
  const ParallelGeometry& g = scan.geometry;
  ProjectionSet out;
  out.geometry = g;
  out.geometry.rows = 1;
  out.geometry.series = {};
  std::vector<float> samples;
  for (std::int64_t k = 0; k < g.views(); ++k) {
    const float* first = scan.data.data() + (k * g.rows + row) * g.columns;
    samples.insert(samples.end(), first, first + g.columns);
  }
  out.data.assign(samples.begin(), samples.end());
  return out;
}

// What the antiderivatives of a row may take.
std::uint64_t table_bytes(const ProjectionSet& scan, std::uint64_t results, std::uint64_t limit) {
  const ParallelGeometry& g = scan.geometry;
  const auto rays = static_cast<std::uint64_t>(g.views() * g.columns);
  const std::uint64_t one = PrimitiveMaker(g.columns).bytes(),
                      // Chords, integrals, errors, coefficients; the cosines of ExactField.
      row = rays * 6 * sizeof(double) + static_cast<std::uint64_t>(g.columns * g.columns) * sizeof(double),
                      scan_bytes = static_cast<std::uint64_t>(scan.size()) * sizeof(float);
  io::require_memory(scan_bytes + results + row + one, limit,
                     "residual: the scan, 12 bytes a ray, and one view");
  constexpr std::uint64_t most = std::uint64_t{512} << 20;
  return limit == 0 ? most : std::min(most, std::max(one, limit - (scan_bytes + results + row)));
}

}  // namespace

Residual residual(const ProjectionSet& scan, const MixedVolume& volume, const Certificate& certificate,
                  const ResidualOptions& options, const Progress& progress) {
  check(scan, certificate);
  Residual out;
  ParallelGeometry longer = scan.geometry;
  longer.center = center_of(certificate.field, longer);
  out.geometry = own_detector(longer);
  out.geometry.center = stated_center(certificate.field, longer) - static_cast<double>(longer.extension.cut);
  std::tie(out.first_row, out.rows) = wanted_rows(scan.geometry, options);
  const ParallelGeometry& g = out.geometry;
  const std::vector<float> bounds = brick_bounds(certificate, false);
  const auto rays = static_cast<std::uint64_t>(g.views() * out.rows * g.columns);
  const std::uint64_t tables = table_bytes(scan, rays * 3 * sizeof(float), options.max_memory_bytes);
  for (auto* values : {&out.lo, &out.hi, &out.reach})
    values->assign(rays, std::numeric_limits<float>::quiet_NaN());

  // Rays are the detector's own; F is of longer rows, where rows were made so.
  const CoveredChords chords = covered_chords(longer);
  const std::vector<float> factors = row_factors(longer);
  const bool weighted = longer.extension.half_acquisition.value_or(false) || !longer.series.none();
  const auto series = longer.series.none() ? nullptr : std::make_unique<const WeightsByHeight>(longer.series);
  const double middle = 0.5 * static_cast<double>(g.rows - 1);
  for (std::int64_t row = out.first_row; row < out.first_row + out.rows; ++row) {
    const auto done = static_cast<double>(row - out.first_row), all = static_cast<double>(out.rows);
    const RowIntegrals f =
        row_integrals(row_of(scan, row), certificate.field, chords, tables,
                      [&](double part) { report(progress, "residual", (done + part) / all); });
    const BoundsAlong along(volume, bounds, (static_cast<double>(row) - middle) * g.pitch_v);
    parallel_for(g.views(), {}, "residual", [&](std::int64_t view) {
      const double c = std::cos(g.theta_rad[static_cast<std::size_t>(view)]),
                   s = std::sin(g.theta_rad[static_cast<std::size_t>(view)]),
                   shares = series ? series->shares(view, longer.series.first + row) : 1;
      if (!(shares > 0)) return;  // which did not see that height
      for (std::int64_t i = 0; i < g.columns; ++i) {
        const std::int64_t column = i + longer.extension.before;
        const auto ray = static_cast<std::size_t>(view * longer.columns + column);
        if (!(chords.first[ray] < chords.last[ray])) continue;
        const double factor = shares * static_cast<double>(factors[static_cast<std::size_t>(column)]),
                     measured = static_cast<double>(scan.data[static_cast<std::size_t>(
                                    (view * g.rows + row) * longer.columns + column)]) /
                                factor;
        // A weighted sample was rounded to float32, below the normal numbers by more.
        const double rounded = weighted ? 0x1p-23 * std::abs(measured) + 0x1p-149 / factor : 0,
                     rest = measured - f.integral[ray],
                     error =
                         f.error[ray] + rounded + 0x1p-52 * (std::abs(measured) + std::abs(f.integral[ray]));
        const std::size_t at = out.index(view, row, i);
        out.lo[at] = down(rest - error);
        out.hi[at] = up(rest + error);
        out.reach[at] = up(along(c, s, chords.u[ray], chords.first[ray], chords.last[ray]));
      }
    });
  }
  report(progress, "residual", 1);
  return out;
}

}  // namespace vdvr
