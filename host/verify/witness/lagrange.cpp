// Weights by Lagrange's formula in double precision, norms by adding them up.
#include "host/verify/witness/lagrange.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
double lagrange_weight(const BetweenNodes& b, double at, int i) {
  double w = 1;
  for (int j = 0; j < b.points; ++j)
    if (j != i) w *= (at - static_cast<double>(j - b.before())) / static_cast<double>(i - j);
  return w;
}

/// Sum of magnitudes, over the nodes, of a sum of the interpolant at neighbouring places.
double norm_of(const LagrangeFilter& f, int phase, const std::vector<std::pair<int, double>>& formula) {
  std::map<int, double> nodes;
  for (const auto& [offset, factor] : formula) {
    const BetweenNodes& b = f.between;
    const int place = phase + (offset + 4 * b.factor) * b.by, node = place / b.factor,
              at_phase = place % b.factor;
    for (int i = 0; i < b.points; ++i)
      nodes[node + i] += factor * static_cast<double>(f.weights[at(std::int64_t{at_phase} * b.points + i)]);
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

BetweenNodes between_nodes(int rate, int nodes, int points) {
  const int common = std::gcd(rate, nodes);
  return {rate / common, nodes / common, points};
}

LagrangeFilter lagrange_filter(const BetweenNodes& b) {
  LagrangeFilter f;
  f.between = b;
  for (int phase = 0; phase < b.factor; ++phase)
    for (int i = 0; i < b.points; ++i)
      f.weights.push_back(static_cast<float>(lagrange_weight(b, static_cast<double>(phase) / b.factor, i)));
  if (!b.made()) return f;
  f.norms = {1, 0, 0, 0};
  for (int phase = 0; phase < b.factor; ++phase) {
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

double lagrange_error(double band, int points) {
  // The product of the distances to the n nodes is largest in the middle; the n-th derivative is at most
  // band^n sup |f| (Bernstein).
  double bound = 1;
  for (int i = 0; i < points; ++i)
    bound *= band * std::abs(static_cast<double>(2 * i + 1 - points)) / static_cast<double>(2 * (i + 1));
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
