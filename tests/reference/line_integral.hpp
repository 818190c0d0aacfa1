// Line integrals by brute force, in double precision, sharing nothing with host/: the convention x = u cos -
// s sin, y = u sin + s cos, z = v, a ray's part in a box, composite quadrature. Used by phantom_test and
// simulate_test.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace vdvr::reference {

using Point = std::array<double, 3>;

inline Point on_ray(double theta, double u, double v, double s) {
  return {u * std::cos(theta) - s * std::sin(theta), u * std::sin(theta) + s * std::cos(theta), v};
}

/// Midpoint rule with n steps; for a piecewise constant density with values d_i it errs by at most h |d_i|
/// per piece.
inline double midpoint(const std::function<double(double)>& f, double a, double b, int n) {
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += f(a + (b - a) * (i + 0.5) / n);
  return sum * (b - a) / n;
}

/// Composite 5-point Gauss-Legendre (Abramowitz and Stegun, table 25.4): exact for polynomials of degree 9
/// per panel.
inline double gauss5(const std::function<double(double)>& f, double a, double b, int panels) {
  constexpr std::array<double, 3> node{0, 0.538469310105683091, 0.906179845938663993};
  constexpr std::array<double, 3> weight{0.568888888888888889, 0.478628670499366468, 0.236926885056189088};
  const double half = (b - a) / (2 * panels);
  double sum = 0;
  for (int p = 0; p < panels; ++p) {
    const double middle = a + (2 * p + 1) * half;
    sum += weight[0] * f(middle);
    for (std::size_t i = 1; i < 3; ++i)
      sum += weight[i] * (f(middle - half * node[i]) + f(middle + half * node[i]));
  }
  return sum * half;
}

/// Crossings of a ray with the planes x = xs and y = ys, sorted.
inline std::vector<double> crossings(double theta, double u, const std::vector<double>& xs,
                                     const std::vector<double>& ys) {
  const double c = std::cos(theta), sn = std::sin(theta);
  std::vector<double> s;
  if (std::abs(sn) > 1e-12)
    for (const double x : xs) s.push_back((u * c - x) / sn);
  if (std::abs(c) > 1e-12)
    for (const double y : ys) s.push_back((y - u * sn) / c);
  std::sort(s.begin(), s.end());
  return s;
}

/// The s range of a ray inside [lo_x, hi_x] x [lo_y, hi_y]: the first and last stretch between plane
/// crossings whose middle lies inside; {0, 0} when there is none.
inline std::pair<double, double> inside(double theta, double u, double lo_x, double hi_x, double lo_y,
                                        double hi_y) {
  const auto s = crossings(theta, u, {lo_x, hi_x}, {lo_y, hi_y});
  for (std::size_t i = 0; i + 1 < s.size(); ++i) {
    const Point p = on_ray(theta, u, 0, (s[i] + s[i + 1]) / 2);
    if (s[i + 1] > s[i] && p[0] > lo_x && p[0] < hi_x && p[1] > lo_y && p[1] < hi_y) return {s[i], s[i + 1]};
  }
  return {0, 0};
}

}  // namespace vdvr::reference
