#include "host/scan/geometry/views_of_rows.hpp"

#include <algorithm>
#include <numbers>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/scan/geometry/angular_gaps.hpp"
#include "host/scan/geometry/weights_by_height.hpp"

namespace vdvr {
namespace {

// The sum of shares of each view at each of its rows.
class SeenRows {
 public:
  explicit SeenRows(const ParallelGeometry& g) : g_(g), weights_(g.series) {}

  [[nodiscard]] double share(std::int64_t view, std::int64_t row) const {
    return weights_.shares(view, g_.series.first + row);
  }
  [[nodiscard]] std::vector<std::int64_t> views(std::int64_t first, std::int64_t rows) const {
    std::vector<std::int64_t> out;
    for (std::int64_t view = 0; view < g_.views(); ++view) {
      bool all = true;
      for (std::int64_t j = first; all && j < first + rows; ++j) all = share(view, j) > 0;
      if (all) out.push_back(view);
    }
    return out;
  }
  [[nodiscard]] bool all_around(const std::vector<std::int64_t>& views) const {
    std::vector<double> theta;
    for (const std::int64_t view : views) theta.push_back(g_.theta_rad[at(view)]);
    if (theta.size() < 2) return false;
    const AngularGaps gaps =
        angular_gaps(theta, g_.series.full_turn ? 2 * std::numbers::pi : std::numbers::pi);
    return !gaps.one_direction && gaps.wedges_rad().empty();
  }

 private:
  const ParallelGeometry& g_;
  WeightsByHeight weights_;
};

ProjectionSet taken(const ProjectionSet& scan, const SeenRows& seen, std::int64_t first, std::int64_t rows) {
  const ParallelGeometry& g = scan.geometry;
  ProjectionSet out;
  out.geometry = g;
  out.geometry.series = {};
  out.geometry.rows = rows;
  out.geometry.theta_rad.clear();
  out.geometry.column_shift.clear();
  out.report = scan.report;
  for (const std::int64_t view : seen.views(first, rows)) {
    out.geometry.theta_rad.push_back(g.theta_rad[at(view)]);
    if (!g.column_shift.empty()) out.geometry.column_shift.push_back(g.column_shift[at(view)]);
    for (std::int64_t j = first; j < first + rows; ++j)
      for (std::int64_t u = 0; u < g.columns; ++u)
        out.data.push_back(static_cast<float>(
            static_cast<double>(scan.data[at((view * g.rows + j) * g.columns + u)]) / seen.share(view, j)));
  }
  return out;
}

}  // namespace

bool views_see_parts(const ParallelGeometry& g) {
  return !g.series.none() && std::ssize(SeenRows(g).views(0, g.rows)) < g.views();
}

std::optional<ProjectionSet> views_of_rows(const ProjectionSet& scan, std::int64_t first, std::int64_t rows) {
  if (!views_see_parts(scan.geometry)) return std::nullopt;
  return taken(scan, SeenRows(scan.geometry), first, rows);
}

std::optional<ProjectionSet> views_of_middle(const ProjectionSet& scan) {
  const ParallelGeometry& g = scan.geometry;
  if (!views_see_parts(g)) return std::nullopt;
  const SeenRows seen(g);
  constexpr std::int64_t most_rows = 16;
  std::int64_t rows = std::min(most_rows, g.rows);
  while (rows > 1 && !seen.all_around(seen.views((g.rows - rows) / 2, rows))) rows /= 2;
  return taken(scan, seen, (g.rows - rows) / 2, rows);
}

}  // namespace vdvr
