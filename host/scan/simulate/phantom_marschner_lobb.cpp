// Marschner and Lobb's test function (Visualization '94) as an object to be projected: f = A(z) + B(r) on a
// square in x and y, zero outside it, not cut in z.
//
// Along a ray z is constant, so A contributes A(z) times the ray's length in the square. B depends on r alone
// and not on the row: its integral is computed once per (theta, u). B(r) is even and entire in r, hence
// entire along the ray, and Gauss-Legendre converges at once: on a panel of half length h the phase 2 pi f_M
// cos(pi r/2) turns by at most 6 pi^2 h = 14.8 (h = 1/4), and 24 nodes leave about (14.8/2)^48 / 48! < 1e-19.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/scan/simulate/phantom_ray.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
constexpr double alpha = 0.25, frequency = 6;    // the paper's a and f_M
constexpr double scale = 1 / (2 * (1 + alpha));  // puts f into [0, 1]
constexpr double longest_panel = 0.5;            // see the head of this file: longer ones need more nodes

double part_z(double z) { return scale * (1 - std::sin(pi * z / 2) + alpha); }
double part_r(double r) { return scale * alpha * std::cos(2 * pi * frequency * std::cos(pi * r / 2)); }

struct GaussLegendre {
  static constexpr std::size_t n = 24;
  std::array<double, n> node{}, weight{};

  // Newton's iteration on the Legendre polynomial from Tricomi's starting values; 6 steps are more than
  // double needs.
  GaussLegendre() {
    for (std::size_t i = 0; i < n; ++i) {
      double x = std::cos(pi * (static_cast<double>(i) + 0.75) / (static_cast<double>(n) + 0.5)), slope = 0;
      for (int step = 0; step < 6; ++step) {
        double p0 = 1, p1 = x;
        for (std::size_t k = 2; k <= n; ++k) {
          const auto kd = static_cast<double>(k);
          const double p2 = ((2 * kd - 1) * x * p1 - (kd - 1) * p0) / kd;
          p0 = p1;
          p1 = p2;
        }
        slope = static_cast<double>(n) * (x * p1 - p0) / (x * x - 1);
        x -= p1 / slope;
      }
      node[i] = x;
      weight[i] = 2 / ((1 - x * x) * slope * slope);
    }
  }
};

// A ray's length in the square |x|, |y| <= 1 and the integral of B along it, in units of the half side.
struct RaySums {
  double length = 0, radial = 0;
};

RaySums trace(double theta, double u) {
  static const GaussLegendre rule;
  const double c = std::cos(theta), s = std::sin(theta);
  constexpr double endless = std::numeric_limits<double>::max();
  const RayInterval ray = clip(clip({-endless, endless}, u * c, -s, -1, 1), u * s, c, -1, 1);
  if (ray.empty()) return {};
  RaySums sums{ray.end - ray.begin, 0};
  const int panels = static_cast<int>(std::ceil(sums.length / longest_panel));
  const double half = sums.length / (2 * panels);
  for (int p = 0; p < panels; ++p) {
    const double middle = ray.begin + (2 * p + 1) * half;
    for (std::size_t i = 0; i < GaussLegendre::n; ++i)
      sums.radial += rule.weight[i] * part_r(std::hypot(u, middle + half * rule.node[i]));
  }
  sums.radial *= half;
  return sums;
}

}  // namespace

Phantom marschner_lobb(double half_side) {
  if (!std::isfinite(half_side) || !(half_side > 0))
    throw InputError(fmt::format("marschner-lobb: half side {} must be finite and positive", half_side));
  Phantom p;
  p.name = "marschner-lobb";
  p.description = fmt::format("{{\"marschner-lobb\":{{\"half_side\":{},\"alpha\":{},\"frequency\":{}}}}}",
                              half_side, alpha, frequency);
  p.density = [half_side](const Vec3& point) {
    const double x = point[0] / half_side, y = point[1] / half_side;
    if (!(std::abs(x) <= 1 && std::abs(y) <= 1)) return 0.0;
    return part_z(point[2] / half_side) + part_r(std::hypot(x, y));
  };
  p.line_integral = [half_side](double theta, double u, double v) {
    const RaySums ray = trace(theta, u / half_side);
    return half_side * (part_z(v / half_side) * ray.length + ray.radial);
  };
  p.view_integrals = [half_side](double theta, std::span<const double> u, std::span<const double> v,
                                 std::span<double> out) {
    for (std::size_t i = 0; i < u.size(); ++i) {
      const RaySums ray = trace(theta, u[i] / half_side);
      for (std::size_t j = 0; j < v.size(); ++j)
        out[j * u.size() + i] = half_side * (part_z(v[j] / half_side) * ray.length + ray.radial);
    }
  };
  return p;
}

}  // namespace vdvr
