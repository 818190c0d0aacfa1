// Two balls that are smooth everywhere, so that F of their scan is theirs, and how far F of a scan is from
// them.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr::testing {

// Balls of density d (1 - r^2 / R^2)^3: smooth everywhere, so that F is theirs. A line at the distance s from
// a ball's middle has d 32/35 R (1 - s^2 / R^2)^(7/2).
struct Ball {
  double d, x, y, z, R;
};
inline const std::vector<Ball> balls{{1, 4, -3, 0.5, 12}, {0.7, -9, 6, -1, 8}};

inline double power_of(double squared, double R, double exponent) {
  return squared < R * R ? std::pow(1 - squared / (R * R), exponent) : 0;
}

inline double density_at(const Vec3& p) {
  double sum = 0;
  for (const Ball& b : balls) {
    const double x = p[0] - b.x, y = p[1] - b.y, z = p[2] - b.z;
    sum += b.d * power_of(x * x + y * y + z * z, b.R, 3);
  }
  return sum;
}

inline Phantom smooth_balls() {
  Phantom phantom;
  phantom.name = "smooth balls";
  phantom.line_integral = [](double theta, double u, double v) {
    double sum = 0;
    for (const Ball& b : balls) {
      const double s = u - b.x * std::cos(theta) - b.y * std::sin(theta), z = v - b.z;
      sum += b.d * 32 / 35 * b.R * power_of(s * s + z * z, b.R, 3.5);
    }
    return sum;
  };
  return phantom;
}

// The largest difference of F from the density, of 1, at heights up to `reach` from the scan's middle, which
// is at the height `middle` of the balls.
inline double off_by(const ProjectionSet& scan, double middle = 0, double reach = 4) {
  std::vector<Vec3> points;
  for (double z = -reach; z <= reach; z += 2)
    for (double y = -12; y <= 12; y += 3)
      for (double x = -12; x <= 12; x += 3) points.push_back({x, y, z});
  const std::vector<double> F = ExactField(scan, {}).at(points);
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    worst = std::max(worst, std::abs(F[i] - density_at({points[i][0], points[i][1], points[i][2] + middle})));
  return worst;
}

}  // namespace vdvr::testing
