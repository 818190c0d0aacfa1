// Residuals in a few numbers: shares, the worst ray, view and column.
#include <algorithm>
#include <cmath>
#include <memory>

#include "host/scan/geometry/weights_by_height.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/residual.hpp"

namespace vdvr {
namespace {

struct Sums {
  std::int64_t rays = 0, beyond = 0;
  double square = 0, sum = 0;

  void add(double middle, bool is_beyond) {
    ++rays;
    beyond += is_beyond;
    square += middle * middle;
    sum += middle;
  }
  [[nodiscard]] double rms() const { return rays > 0 ? std::sqrt(square / static_cast<double>(rays)) : 0; }
};

std::vector<ResidualLine> lines(const std::vector<Sums>& sums) {
  std::vector<ResidualLine> out;
  for (const Sums& s : sums)
    out.push_back({static_cast<std::int64_t>(out.size()), s.rays, s.beyond, s.rms(),
                   s.rays > 0 ? s.sum / static_cast<double>(s.rays) : 0});
  return out;
}

ResidualLine worst_of(const std::vector<ResidualLine>& all) {
  return *std::max_element(all.begin(), all.end(),
                           [](const ResidualLine& a, const ResidualLine& b) { return a.rms < b.rms; });
}

double median_rms(const std::vector<ResidualLine>& all) {
  std::vector<double> rms;
  for (const ResidualLine& line : all)
    if (line.rays > 0) rms.push_back(line.rms);
  if (rms.empty()) return 0;
  const auto middle = rms.begin() + static_cast<std::ptrdiff_t>(rms.size() / 2);
  std::nth_element(rms.begin(), middle, rms.end());
  return *middle;
}

}  // namespace

ResidualSummary summary_of(const Residual& r, const ProjectionSet& scan) {
  const ParallelGeometry& g = r.geometry;
  const std::int64_t wide = scan.geometry.columns;
  const std::vector<float> factors = row_factors(scan.geometry);
  const HeightSeries& of = scan.geometry.series;
  const auto series = of.none() ? nullptr : std::make_unique<const WeightsByHeight>(of);
  ResidualSummary out;
  std::vector<Sums> views(static_cast<std::size_t>(g.views())), columns(static_cast<std::size_t>(g.columns));
  Sums all;
  double measured_square = 0, edge = 0, largest = 0;
  for (std::int64_t k = 0; k < g.views(); ++k)
    for (std::int64_t v = r.first_row; v < r.first_row + r.rows; ++v) {
      const double shares = series ? series->shares(k, of.first + v) : 1;
      if (!(shares > 0)) continue;  // the view did not see that height
      for (std::int64_t i = 0; i < g.columns; ++i) {
        const std::size_t at = r.index(k, v, i);
        const std::int64_t column = i + scan.geometry.extension.before;
        const double measured = std::abs(
            static_cast<double>(scan.data[static_cast<std::size_t>((k * g.rows + v) * wide + column)]) /
            (shares * static_cast<double>(factors[static_cast<std::size_t>(column)])));
        largest = std::max(largest, measured);
        // The nearer edge of half acquisition is within the object; rows are weighted down to nothing there.
        if ((i == 0 || i == g.columns - 1) && factors[static_cast<std::size_t>(column)] >= 1)
          edge = std::max(edge, measured);
        ++out.rays;
        if (std::isnan(r.lo[at])) continue;
        const bool beyond = r.beyond_interpolation(at);
        const double middle = r.middle(at);
        all.add(middle, beyond);
        views[static_cast<std::size_t>(k)].add(middle, beyond);
        columns[static_cast<std::size_t>(i)].add(middle, beyond);
        measured_square += measured * measured;
        out.beyond_field += r.beyond_field(at);
        out.width = std::max(out.width, static_cast<double>(r.hi[at]) - static_cast<double>(r.lo[at]));
        const double excess = std::max(static_cast<double>(r.lo[at]), -static_cast<double>(r.hi[at])) -
                              static_cast<double>(r.reach[at]);
        if (excess > out.largest_excess) {
          out.largest_excess = excess;
          out.worst = {k, v, i};
        }
      }
    }
  out.compared = all.rays;
  out.beyond_interpolation = all.beyond;
  out.rms = all.rms();
  out.measured_rms = all.rays > 0 ? std::sqrt(measured_square / static_cast<double>(all.rays)) : 0;
  out.views = lines(views);
  out.columns = lines(columns);
  out.worst_view = worst_of(out.views);
  out.worst_column = worst_of(out.columns);
  out.median_view_rms = median_rms(out.views);
  out.median_column_rms = median_rms(out.columns);
  out.at_edge = largest > 0 ? edge / largest : 0;
  return out;
}

}  // namespace vdvr
