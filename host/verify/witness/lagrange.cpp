// Weights by Lagrange's formula in double precision, norms by adding them up.
#include "host/verify/witness/lagrange.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
constexpr int first_node = 1 - lagrange_points / 2;  // from the node on the left of the place

double lagrange_weight(double at, int i) {
  double w = 1;
  for (int j = 0; j < lagrange_points; ++j)
    if (j != i) w *= (at - static_cast<double>(first_node + j)) / static_cast<double>(i - j);
  return w;
}

/// Sum of magnitudes, over the nodes, of a sum of the interpolant at neighbouring places.
double norm_of(const LagrangeFilter& f, int phase, const std::vector<std::pair<int, double>>& formula) {
  std::map<int, double> nodes;
  for (const auto& [offset, factor] : formula) {
    const int place = phase + offset + 4 * f.factor, node = place / f.factor, at_phase = place % f.factor;
    for (int i = 0; i < lagrange_points; ++i)
      nodes[node + i] +=
          factor * static_cast<double>(f.weights[at(std::int64_t{at_phase} * lagrange_points + i)]);
  }
  double sum = 0;
  for (const auto& [node, weight] : nodes) sum += std::abs(weight);
  return sum;
}

// sin(pi (2 V - 1) t / (2 V)) / sin(pi t / (2 V)), which is 2 V - 1 where t is a multiple of 2 V.
double dirichlet(double t, double V) {
  t = std::remainder(t, 2 * V);
  const double below = std::sin(pi * t / (2 * V));
  if (std::abs(below) < 1e-9) return 2 * V - 1;
  return std::sin(pi * (2 * V - 1) * t / (2 * V)) / below;
}

}  // namespace

LagrangeFilter lagrange_filter(int factor) {
  LagrangeFilter f;
  f.factor = factor;
  for (int phase = 0; phase < factor; ++phase)
    for (int i = 0; i < lagrange_points; ++i)
      f.weights.push_back(static_cast<float>(lagrange_weight(static_cast<double>(phase) / factor, i)));
  if (factor == 1) return f;
  f.norms = {1, 0, 0, 0};
  for (int phase = 0; phase < factor; ++phase) {
    const auto raise = [&](double& norm, const std::vector<std::pair<int, double>>& formula) {
      norm = std::max(norm, (1 + 1e-12) * norm_of(f, phase, formula));
    };
    raise(f.norms.value, {{0, 1.0}});
    raise(f.norms.second, {{-1, 1.0}, {0, -2.0}, {1, 1.0}});
    raise(f.norms.curvature, {{-1, 1.0}, {0, -2.0}, {1, 1.0}});
    raise(f.norms.curvature,
          {{-2, -1.0 / 12}, {-1, 16.0 / 12}, {0, -30.0 / 12}, {1, 16.0 / 12}, {2, -1.0 / 12}});
    raise(f.norms.fourth, {{-2, 1.0}, {-1, -4.0}, {0, 6.0}, {1, -4.0}, {2, 1.0}});
  }
  return f;
}

double lagrange_error(double band) {
  // The product of the distances to the nodes is largest in the middle; the twelfth derivative is at most
  // band^12 sup |f| (Bernstein).
  double bound = 1;
  for (int i = 0; i < lagrange_points; ++i)
    bound *= band * std::abs(0.5 - static_cast<double>(first_node + i)) / static_cast<double>(i + 1);
  return bound * (1 + 1e-12);
}

AxisNorms band_norms(double band) {
  const AxisNorms each;
  const double square = band * band;
  return {1, std::min(each.curvature, square + square * square / 12), std::min(each.second, square),
          std::min(each.fourth, square * square)};
}

double row_weight(std::int64_t rows, double at, std::int64_t row) {
  // cos a cos b summed over the series' terms: two of Dirichlet's kernels.
  const auto V = static_cast<double>(rows), r = static_cast<double>(row);
  return (dirichlet(at - r, V) + dirichlet(at + r + 1, V)) / (2 * V);
}

double row_gain(std::int64_t rows) {
  if (rows == 1) return 1;
  // Times a pattern of signs M is a series of `rows` terms: its largest value is at most 1 / cos(pi / 16)
  // times that at eighths of a row. The first half of the rows mirrors the second.
  double largest = 0;
  for (std::int64_t i = 0; i <= 4 * rows; ++i) {
    double sum = 0;
    for (std::int64_t r = 0; r < rows; ++r)
      sum += std::abs(row_weight(rows, static_cast<double>(i) / 8 - 0.5, r));
    largest = std::max(largest, sum);
  }
  return largest / std::cos(pi / 16) * (1 + 1e-9);
}

}  // namespace vdvr
