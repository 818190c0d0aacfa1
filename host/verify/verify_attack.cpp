// Points where |V - F| may be above what is certified of their brick.
#include "host/verify/verify_attack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>

#include "host/base/system/casts.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {
namespace {

constexpr std::size_t points_per_cell = 19;     // of 27: not the corners, which are nodes
constexpr std::size_t most_cells = 210;         // 3,990 points
constexpr std::size_t most_cells_of_brick = 4;  // a brick's cells have much in common
constexpr double attack_work = 2e10;

// Middle of a cell, of its faces and of its edges, in halves of a cell.
template <class Visit>
void for_each_middle(Visit&& visit) {
  for (std::int64_t code = 0; code < 27; ++code) {
    const Index3 half{code % 3, code / 3 % 3, code / 9};
    if (half[0] == 1 || half[1] == 1 || half[2] == 1) visit(half);
  }
}

}  // namespace

TotalAttack::TotalAttack(const MixedVolume& volume, const Certificate& stored, const CertifiedRegion& region)
    : volume_(volume),
      stored_(stored),
      region_(region),
      rest_(stored.budget.arithmetic.value + stored.budget.sampler.buffer.value) {}

double TotalAttack::certified(std::int64_t brick) const {
  if (stored_.brick_totals.empty()) return stored_.measured_total + rest_;
  const float total = stored_.brick_totals[at(brick)];
  return total < 0 ? std::numeric_limits<double>::infinity() : static_cast<double>(total) + rest_;
}

void TotalAttack::consider(const VerifyField::Piece& b) {
  const double bound = certified(b.brick);
  if (!(b.total > bound)) return;
  const auto side = std::llround(std::sqrt(static_cast<double>(b.columns.size())));
  std::vector<Cell> own;
  for (std::int64_t j = 0; j < side * side; ++j) {
    const VerifyField::Column& c = b.columns[at(j)];
    if (!(c.total >= 0)) continue;
    const double own_share = b.unit * static_cast<double>(c.total) / bound;
    const Index3& first = b.first_cell;
    // What is the same in all cells of the brick tells nothing of one.
    if (own_share + b.constant / bound > 1)
      own.push_back(
          {own_share, b.brick, b.rate, {first[0] + j % side, first[1] + j / side, first[2] + c.worst_z}});
  }
  const auto worse = [](const Cell& a, const Cell& c) { return a.excess > c.excess; };
  const std::size_t kept = std::min(own.size(), most_cells_of_brick);
  std::partial_sort(own.begin(), own.begin() + static_cast<std::ptrdiff_t>(kept), own.end(), worse);
  cells_.insert(cells_.end(), own.begin(), own.begin() + static_cast<std::ptrdiff_t>(kept));
  if (cells_.size() < 4 * most_cells) return;
  std::nth_element(cells_.begin(), cells_.begin() + most_cells, cells_.end(), worse);
  cells_.resize(most_cells);
}

TotalAttack::Outcome TotalAttack::run(const ExactField& exact, const Progress& progress) const {
  std::vector<Cell> cells = cells_;
  std::sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) { return a.excess > b.excess; });
  const ParallelGeometry& g = exact.geometry();
  // A height costs all coefficients, of cone beam a point does.
  const auto most_heights = static_cast<std::size_t>(
      std::max(48.0, attack_work / static_cast<double>(g.views() * g.rows * g.columns)));
  const std::size_t most_points = exact.views().empty() ? SIZE_MAX : most_heights;
  std::set<double> heights;
  std::vector<Vec3> points;
  const Bricks bricks(volume_.grid, volume_.granularity);
  for (std::size_t i = 0; i < std::min(cells.size(), most_cells) && heights.size() + 3 <= most_heights &&
                          points.size() + points_per_cell <= most_points;
       ++i) {
    const Index3 brick = bricks.position(cells[i].brick);
    for_each_middle([&](const Index3& half) {
      Vec3 p{};
      for (std::size_t a = 0; a < 3; ++a) {
        const double cell =
            static_cast<double>(brick[a] * volume_.granularity) +
            (static_cast<double>(cells[i].cell[a]) + 0.5 * static_cast<double>(half[a])) / cells[i].rate;
        p[a] = volume_.grid.origin[a] + cell * volume_.grid.spacing[a];
      }
      if (!region_.contains(p)) return;
      points.push_back(p);
      heights.insert(p[2]);
    });
  }
  Outcome out;
  const std::vector<double> F = exact.at(points, progress);
  for (std::size_t i = 0; i < points.size(); ++i) {
    // The window is of F; within its rounding of the edge nothing is promised.
    if (stored_.window && !(F[i] - exact.rounding() >= stored_.window->first &&
                            F[i] + exact.rounding() <= stored_.window->second))
      continue;
    const std::int64_t brick = bricks.number(brick_at(volume_, points[i]));
    const double bound = certified(brick), value = static_cast<double>(sample_at(volume_, points[i])),
                 error = std::abs(value - F[i]);
    if (std::isinf(bound)) continue;
    ++out.points;
    const double share = (error - exact.rounding()) / bound;
    if (share <= out.worst_share) continue;
    out.worst_share = share;
    if (!(error <= bound + exact.rounding()))
      out.failure = fmt::format(
          "|V - F| is {:.6g} at ({:.6g}, {:.6g}, {:.6g}), where V is {:.6g} and F {:.6g}: the certificate "
          "bounds it "
          "by {:.6g} in brick {}",
          error, points[i][0], points[i][1], points[i][2], value, F[i], bound, brick);
  }
  return out;
}

}  // namespace vdvr
