// Gauss-Newton for the axis' place and roll, from coarse pictures to fine ones.
//
// A view and the one from behind are mirror images about the axis: with T across the axis from the detector's
// middle, z along it, and the axis at T = a,
//
//   r(t, z) = A(a + t, z) - B(a - t, z) = 0,   A(T, z) = view at u = T c + z s, v = -T s + z c.
//
// d/da moves both along T, d/droll moves a point of either picture by (v, -u).
#include "vdvr/expert/find_roll.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/scan/center/row_bands.hpp"
#include "host/scan/geometry/views_of_rows.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/find_center.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t most_opposite_pairs = 32, blocks = 16, fewest_rows_of_roll = 4;
// Of a column of the finest pictures: how well edges that no pixel resolves can be registered.
constexpr double registered = 0.05;
constexpr std::int64_t finest_columns = 256, coarsest_columns = 64;

// double data[row][column], lengths in columns of the detector from its middle.
struct Picture {
  std::int64_t columns = 0, rows = 0;
  double step_u = 1, step_v = 1;
  std::vector<double> data;
};

// By a binomial of a sample's standard deviation: interpolation between samples then neither adds nor removes
// noise to speak of, which would pull the least difference to half samples.
void smooth(Picture& p) {
  constexpr std::array taps{6 / 16.0, 4 / 16.0, 1 / 16.0};
  const auto along = [&](std::int64_t n, std::int64_t lines, std::int64_t step, std::int64_t line_step) {
    std::vector<double> line(at(n));
    for (std::int64_t l = 0; l < lines; ++l) {
      double* first = p.data.data() + l * line_step;
      for (std::int64_t i = 0; i < n; ++i) line[at(i)] = first[i * step];
      const auto sample = [&](std::int64_t i) { return line[at(std::clamp<std::int64_t>(i, 0, n - 1))]; };
      for (std::int64_t i = 0; i < n; ++i)
        first[i * step] = taps[0] * sample(i) + taps[1] * (sample(i - 1) + sample(i + 1)) +
                          taps[2] * (sample(i - 2) + sample(i + 2));
    }
  };
  along(p.columns, p.rows, 1, p.columns);
  along(p.rows, p.columns, p.columns, 1);
}

// A sum of views, times these.
using ViewSum = std::vector<std::pair<std::int64_t, double>>;

// Means of `factor` columns and rows; what is left over is cut on both sides alike.
Picture picture_of(const ProjectionSet& scan, const ViewSum& sum, std::int64_t factor) {
  const ParallelGeometry& g = scan.geometry;
  const std::int64_t of_rows = std::min(factor, std::max<std::int64_t>(1, g.rows / fewest_rows_of_roll));
  Picture out{g.columns / factor,
              g.rows / of_rows,
              static_cast<double>(factor),
              static_cast<double>(of_rows) * g.pitch_v / g.pitch_u,
              {}};
  out.data.assign(at(out.columns * out.rows), 0.0);
  const std::int64_t first_u = (g.columns - out.columns * factor) / 2,
                     first_v = (g.rows - out.rows * of_rows) / 2;
  for (const auto& [view, times] : sum) {
    const double share = times / static_cast<double>(factor * of_rows);
    for (std::int64_t j = 0; j < out.rows * of_rows; ++j) {
      const float* row = scan.data.data() + (view * g.rows + first_v + j) * g.columns + first_u;
      double* to = out.data.data() + j / of_rows * out.columns;
      for (std::int64_t i = 0; i < out.columns * factor; ++i)
        to[i / factor] += share * static_cast<double>(row[i]);
    }
  }
  smooth(out);
  return out;
}

// Value and slopes in columns at a place, bicubic (Catmull-Rom); false near the edge.
struct Reading {
  double value = 0, along_u = 0, along_v = 0;
};
bool read(const Picture& p, double u, double v, Reading& out) {
  const double x = u / p.step_u + 0.5 * static_cast<double>(p.columns - 1),
               y = v / p.step_v + 0.5 * static_cast<double>(p.rows - 1);
  const auto i = static_cast<std::int64_t>(std::floor(x)), j = static_cast<std::int64_t>(std::floor(y));
  if (i < 1 || j < 1 || i + 2 >= p.columns || j + 2 >= p.rows) return false;
  const auto weights = [](double f) {
    return std::array{std::array{((2 - f) * f - 1) * f / 2, ((3 * f - 5) * f * f + 2) / 2,
                                 ((4 - 3 * f) * f + 1) * f / 2, (f - 1) * f * f / 2},
                      std::array{((4 - 3 * f) * f - 1) / 2, (9 * f - 10) * f / 2, ((8 - 9 * f) * f + 1) / 2,
                                 (3 * f - 2) * f / 2}};
  };
  const auto wx = weights(x - static_cast<double>(i)), wy = weights(y - static_cast<double>(j));
  out = {};
  for (std::size_t b = 0; b < 4; ++b) {
    const double* row = p.data.data() + (j - 1 + static_cast<std::int64_t>(b)) * p.columns + i - 1;
    double value = 0, slope = 0;
    for (std::size_t a = 0; a < 4; ++a) value += wx[0][a] * row[a], slope += wx[1][a] * row[a];
    out.value += wy[0][b] * value;
    out.along_u += wy[0][b] * slope / p.step_u;
    out.along_v += wy[1][b] * value / p.step_v;
  }
  return true;
}

// Sums of Gauss and Newton's normal equations: unknowns are the axis' place and the roll.
struct Normal {
  double aa = 0, ar = 0, rr = 0, a = 0, r = 0, square = 0;
  std::int64_t samples = 0;
  void add(const Normal& o, double times = 1) {
    aa += times * o.aa, ar += times * o.ar, rr += times * o.rr, a += times * o.a, r += times * o.r;
    square += times * o.square;
    samples += static_cast<std::int64_t>(times) * o.samples;
  }
  [[nodiscard]] std::array<double, 2> step() const {
    const double det = aa * rr - ar * ar;
    if (!(det > 1e-9 * aa * rr)) return {0, 0};
    return {-(a * rr - r * ar) / det, -(r * aa - a * ar) / det};
  }
};

struct Axis {
  double place = 0, roll = 0;  // columns from the detector's middle; radians
};

// By block of heights, so that what they say apart tells how sure all of them are.
std::vector<Normal> equations(const Picture& one, const Picture& other, const Axis& axis) {
  std::vector<Normal> out(at(blocks));
  const double c = std::cos(axis.roll), s = std::sin(axis.roll);
  const auto places = [&](double T, double z) { return std::array{T * c + z * s, z * c - T * s}; };
  for (std::int64_t j = 0; j < one.rows; ++j) {
    const double z = (static_cast<double>(j) - 0.5 * static_cast<double>(one.rows - 1)) * one.step_v;
    Normal& n = out[at(j * blocks / one.rows)];
    for (std::int64_t i = 0; i < one.columns; ++i) {
      const double T = (static_cast<double>(i) - 0.5 * static_cast<double>(one.columns - 1)) * one.step_u;
      const auto [u, v] = places(T, z);
      const auto [mu, mv] = places(2 * axis.place - T, z);
      Reading A, B;
      if (!read(one, u, v, A) || !read(other, mu, mv, B)) continue;
      const double r = A.value - B.value;
      // T = place + t and place - t move with the place; t is held.
      const double by_place = (A.along_u * c - A.along_v * s) - (B.along_u * c - B.along_v * s),
                   by_roll = (A.along_u * v - A.along_v * u) - (B.along_u * mv - B.along_v * mu);
      n.aa += by_place * by_place, n.ar += by_place * by_roll, n.rr += by_roll * by_roll;
      n.a += by_place * r, n.r += by_roll * r, n.square += r * r;
      ++n.samples;
    }
  }
  return out;
}

using PicturePairs = std::vector<std::pair<Picture, Picture>>;

std::vector<Normal> equations(const PicturePairs& pairs, const Axis& axis) {
  std::vector<std::vector<Normal>> of_pair(pairs.size());
  parallel_for(std::ssize(pairs), {}, "", [&](std::int64_t k) {
    of_pair[at(k)] = equations(pairs[at(k)].first, pairs[at(k)].second, axis);
  });
  std::vector<Normal> sum(at(blocks));
  for (const auto& one : of_pair)
    for (std::size_t b = 0; b < sum.size(); ++b) sum[b].add(one[b]);
  return sum;
}

Normal total(const std::vector<Normal>& of_block) {
  Normal sum;
  for (const Normal& n : of_block) sum.add(n);
  return sum;
}

// Opposite views to within a quarter of a step; of half a turn without its end what lies beyond either end,
// by the line through the two views before it.
std::vector<std::pair<ViewSum, ViewSum>> view_pairs(const std::vector<double>& theta) {
  using center::pi;
  const double step = center::median_step(theta);
  std::vector<std::pair<ViewSum, ViewSum>> pairs;
  if (!(step > 0) || step > pi / 12) return pairs;
  const auto off = [&](std::size_t i, std::size_t j, double apart) {
    return std::abs(std::remainder(theta[j] - theta[i] - apart, 2 * pi));
  };
  const double near = 1e-3 * step;
  for (std::size_t i = 0; i < theta.size(); ++i)
    for (std::size_t j = i + 1; j < theta.size(); ++j)
      if (off(i, j, pi) <= near)
        pairs.push_back({{{static_cast<std::int64_t>(i), 1.0}}, {{static_cast<std::int64_t>(j), 1.0}}});
  if (std::ssize(pairs) > most_opposite_pairs) {
    std::vector<std::pair<ViewSum, ViewSum>> spread;
    for (std::int64_t k = 0; k < most_opposite_pairs; ++k)
      spread.push_back(pairs[at(k * std::ssize(pairs) / most_opposite_pairs)]);
    return spread;
  }
  if (!pairs.empty() || theta.size() < 8) return pairs;
  const auto order = center::by_angle(theta);
  const auto first = order[0], second = order[1], last = order[order.size() - 1],
             before = order[order.size() - 2];
  if (off(at(first), at(last), pi - step) > 0.05 * step || off(at(first), at(second), step) > 0.05 * step ||
      off(at(before), at(last), step) > 0.05 * step)
    return pairs;
  pairs.push_back({{{first, 1.0}}, {{last, 2.0}, {before, -1.0}}});
  pairs.push_back({{{first, 2.0}, {second, -1.0}}, {{last, 1.0}}});
  return pairs;
}

// Enough of them to search by.
PicturePairs some_of(const PicturePairs& pairs) {
  constexpr std::int64_t enough = 8;
  PicturePairs some;
  for (std::int64_t k = 0; k < std::min(enough, std::ssize(pairs)); ++k)
    some.push_back(pairs[at(k * std::ssize(pairs) / std::min(enough, std::ssize(pairs)))]);
  return some;
}

// The roll under which pictures a few dozen columns wide differ least: what the finer ones begin with.
Axis searched(const PicturePairs& pairs, double place) {
  Axis best{place, 0};
  double least = INFINITY;
  for (double degrees = -1.2 * most_axis_roll_deg; degrees <= 1.2 * most_axis_roll_deg; degrees += 0.5) {
    Axis axis{place, degrees * radians_per_degree};
    Normal n = total(equations(pairs, axis));
    // The place follows the roll: of an object that is not in the middle row.
    for (int i = 0; i < 2 && n.aa > 0; ++i) {
      axis.place -= n.a / n.aa;
      n = total(equations(pairs, axis));
    }
    const double rest = n.samples > 0 ? n.square / static_cast<double>(n.samples) : HUGE_VAL;
    if (rest < least) least = rest, best = axis;
  }
  return best;
}

// By the jackknife over blocks of heights.
double uncertainty_of(const std::vector<Normal>& of_block) {
  const Normal all = total(of_block);
  std::vector<double> without;
  for (const Normal& one : of_block) {
    if (one.samples == 0) continue;
    Normal rest = all;
    rest.add(one, -1);
    without.push_back(rest.step()[1]);
  }
  const auto n = static_cast<double>(without.size());
  double mean = 0, square = 0;
  for (const double roll : without) mean += roll / n;
  for (const double roll : without) square += std::pow(roll - mean, 2);
  return n < 3 ? HUGE_VAL : std::sqrt(square * (n - 1) / n);
}

}  // namespace

std::optional<RollEstimate> find_roll(const ProjectionSet& scan) {
  const ParallelGeometry& g = scan.geometry;
  if (scan.cone || g.rows < fewest_rows_of_roll || g.columns < 16 || !g.column_shift.empty())
    return std::nullopt;
  if (static_cast<std::int64_t>(scan.data.size()) != scan.size())
    throw InputError(
        fmt::format("{} samples for {} views of {} x {}", scan.data.size(), g.views(), g.rows, g.columns));
  if (const auto middle = views_of_middle(scan)) return find_roll(*middle);
  const auto sums = view_pairs(g.theta_rad);
  const auto center = sums.empty() ? std::nullopt : find_center(scan);
  if (!center) return std::nullopt;
  Axis axis{center->center - 0.5 * static_cast<double>(g.columns - 1), 0};
  std::vector<Normal> last;
  const std::int64_t finest = (g.columns + finest_columns - 1) / finest_columns;
  std::int64_t factor = std::max(finest, g.columns / coarsest_columns);
  for (bool first = true;; first = false, factor = std::max(finest, factor / 2)) {
    PicturePairs pairs(sums.size());
    parallel_for(std::ssize(sums), {}, "", [&](std::int64_t k) {
      pairs[at(k)] = {picture_of(scan, sums[at(k)].first, factor),
                      picture_of(scan, sums[at(k)].second, factor)};
    });
    if (first) axis = searched(some_of(pairs), axis.place);
    constexpr int steps = 8;
    for (int i = 0; i < steps; ++i) {
      last = equations(pairs, axis);
      const auto [place, roll] = total(last).step();
      axis.place += place;
      axis.roll += roll;
      if (std::abs(roll) * static_cast<double>(g.columns) < 1e-3) break;
    }
    if (factor == finest) break;
  }
  const double half = 0.5 * static_cast<double>(g.columns),
               uncertainty =
                   std::hypot(uncertainty_of(last), registered * static_cast<double>(finest) / half);
  if (!(std::abs(axis.roll) < 1.5 * most_axis_roll_deg * radians_per_degree) || !std::isfinite(uncertainty))
    return std::nullopt;
  RollEstimate found;
  found.roll_deg = g.axis_roll_deg + axis.roll * degrees_per_radian;
  found.uncertainty_deg = uncertainty * degrees_per_radian;
  found.center = axis.place + 0.5 * static_cast<double>(g.columns - 1);
  found.pairs = std::ssize(sums);
  const double at_ends =
      std::abs(axis.roll) * 0.5 *
      std::max(static_cast<double>(g.rows) * g.pitch_v / g.pitch_u, static_cast<double>(g.columns));
  found.significant = std::abs(axis.roll) > 4 * uncertainty && at_ends > center_agreement;
  found.method = fmt::format("{} pair{} of {}", found.pairs, found.pairs == 1 ? "" : "s",
                             sums.front().second.size() == 1 ? "opposite views" : "ends of half a turn");
  return found;
}

}  // namespace vdvr
