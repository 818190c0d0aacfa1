// Half-spaces of cone-beam views.
#include "host/field/fdk/cone_coverage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/field/fbp/coverage.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

ConeCoverage::ConeCoverage(const std::vector<ViewMatrix>& views, std::int64_t columns, std::int64_t rows) {
  inner_ = std::numeric_limits<double>::infinity();
  double pitch = 0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const ViewMatrix& m = views[k];
    const auto planes = planes_of_view(m, columns, rows);
    planes_.insert(planes_.end(), planes.begin(), planes.end());
    inner_ = std::min({inner_, planes[0][3], planes[1][3]});
    const ConeView view = cone_view(m);
    pitch = std::max({pitch, view.pitch_u, view.pitch_v});
  }
  // A point exactly on the detector's edge counts as covered whatever the rounding of its place.
  slack_ = 1e-9 * pitch;
  if (!(inner_ > 0))
    throw InputError(fmt::format(
        "the axis does not fall on the detector's {} columns in every view; correct `center`", columns));
}

double ConeCoverage::margin(const Vec3& p) const {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& plane : planes_)
    least = std::min(least, plane[0] * p[0] + plane[1] * p[1] + plane[2] * p[2] + plane[3]);
  return least + slack_;
}

std::pair<double, double> ConeCoverage::heights(double x, double y, double least) const {
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& plane : planes_) {
    const double rest = plane[0] * x + plane[1] * y + plane[3] + slack_ - least;
    // A plane that stands upright takes all of the column or nothing.
    if (std::abs(plane[2]) < 1e-14) {
      if (rest < 0) return {1, -1};
    } else if (plane[2] > 0) {
      low = std::max(low, -rest / plane[2]);
    } else {
      high = std::min(high, -rest / plane[2]);
    }
  }
  return {low, high};
}

}  // namespace vdvr
