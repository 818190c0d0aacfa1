// What a cone-beam scan has in common with a parallel one.
#include "vdvr/expert/projections.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Exact where all are equal.
double mean(const std::vector<ConeView>& views, double ConeView::*value) {
  const double first = views.front().*value;
  double beyond = 0;
  for (const ConeView& view : views) beyond += view.*value - first;
  return first + beyond / static_cast<double>(views.size());
}

}  // namespace

void require_axis_roll(double degrees, const std::string& source) {
  if (!(std::abs(degrees) <= most_axis_roll_deg))
    throw InputError(fmt::format("{}: a roll of {} degrees; it must be a number from -{} to {}", source,
                                 degrees, most_axis_roll_deg, most_axis_roll_deg));
}

ParallelGeometry parallel_limit(const ConeGeometry& cone, std::int64_t columns, std::int64_t rows,
                                const std::string& unit) {
  if (cone.views.empty()) throw InputError("a cone-beam scan without views");
  std::vector<ConeView> views;
  for (const ViewMatrix& matrix : cone.views) views.push_back(cone_view(matrix));
  ParallelGeometry g;
  g.columns = columns;
  g.rows = rows;
  g.unit = unit;
  g.pitch_u = mean(views, &ConeView::pitch_u);
  g.pitch_v = mean(views, &ConeView::pitch_v);
  g.center = mean(views, &ConeView::center);
  constexpr double turn = 2 * std::numbers::pi;
  for (const ConeView& view : views) {
    // The source lies a quarter turn behind the angle of its view. Angles go on from one view to the next.
    double theta = view.angle() + 0.25 * turn;
    if (!g.theta_rad.empty()) theta += turn * std::round((g.theta_rad.back() - theta) / turn);
    g.theta_rad.push_back(theta);
  }
  return g;
}

void require_parallel(const ProjectionSet& scan, const std::string& what) {
  if (scan.cone)
    throw InputError(
        what + ": is for parallel beam in this version; " + scan.report.name +
        " is a cone-beam scan, of which `reconstruct` and `probe --exact` make a volume and values");
}

}  // namespace vdvr
