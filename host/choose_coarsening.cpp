// Foresees the storage of every coarsening on some bricks.
#include "host/choose_coarsening.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "host/volume_problem.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t most_bricks = 4096;
// Fewer samples than this share of them are not worth tiles in place of a base that neighbours share.
constexpr double worth = 0.03;
// Of a wave of half the Nyquist frequency the error between samples is that much more than an eighth of the
// second difference; slower ones come nearer to 1.
constexpr double between_samples = 1.2;

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

// Along x, y, z and at each density (log2 of samples a cell, from `lowest` on): the largest of interpolant -
// field, and of field - interpolant.
struct BrickErrors {
  std::array<std::array<std::array<double, 2>, 8>, 3> of{};
};

class Foresee {
 public:
  Foresee(const Volume& base, const std::vector<std::uint8_t>& covered, const CoarseningQuestion& q)
      : base_(base),
        covered_(covered),
        q_(q),
        n_(base.grid.samples()),
        lowest_(-std::countr_zero(static_cast<unsigned>(q.granularity))),
        highest_(std::min(std::countr_zero(static_cast<unsigned>(q.rate)), 7 + lowest_)) {
    const std::int64_t g = q.granularity;
    Index3 bricks{};
    for (std::size_t a = 0; a < 3; ++a) bricks[a] = base.grid.cells[a] / g;
    const std::int64_t all = bricks[0] * bricks[1] * bricks[2];
    // A stride without factors in common with the rows, so that every part of the volume is looked at.
    const std::int64_t stride = std::max<std::int64_t>(1, all / most_bricks) | 1;
    for (std::int64_t i = 0; i < all; i += stride) {
      const Index3 first{i % bricks[0] * g, i / bricks[0] % bricks[1] * g, i / bricks[0] / bricks[1] * g};
      if (is_covered(first)) bricks_.push_back(errors_of(first));
    }
  }

  // Samples per cell of the grid.
  [[nodiscard]] double samples(const LevelTriple& c) const {
    const std::array<int, 3> low{-c[2], -c[1], -c[0]};
    double tiles = 0;
    for (const BrickErrors& b : bricks_) tiles += cheapest(b, low);
    const double cells = std::pow(q_.granularity, 3) * static_cast<double>(bricks_.size());
    return std::ldexp(1.0, low[0] + low[1] + low[2]) + tiles / cells;
  }
  [[nodiscard]] bool knows_nothing() const { return bricks_.empty(); }

 private:
  [[nodiscard]] double value(const Index3& i) const {
    return static_cast<double>(base_.samples[at((i[2] * n_[1] + i[1]) * n_[0] + i[0])]);
  }

  [[nodiscard]] bool is_covered(const Index3& first) const {
    const std::int64_t g = q_.granularity;
    for (const std::int64_t y : {first[1], first[1] + g})
      for (const std::int64_t x : {first[0], first[0] + g})
        if (!covered_[at(y * n_[0] + x)]) return false;
    return true;
  }

  [[nodiscard]] BrickErrors errors_of(const Index3& first) const {
    const std::int64_t g = q_.granularity;
    BrickErrors out;
    for (std::size_t a = 0; a < 3; ++a) {
      auto& of_axis = out.of[a];
      const auto raise = [&](int density, double e) {
        auto& pair = of_axis[static_cast<std::size_t>(density - lowest_)];
        pair = {std::max(pair[0], e), std::max(pair[1], -e)};
      };
      Index3 i{};
      for (i[2] = first[2]; i[2] <= first[2] + g; ++i[2])
        for (i[1] = first[1]; i[1] <= first[1] + g; ++i[1])
          for (i[0] = first[0]; i[0] <= first[0] + g; ++i[0]) {
            const std::int64_t k = i[a] - first[a];
            const auto middle = [&](std::int64_t half) {
              Index3 low = i, high = i;
              low[a] -= half;
              high[a] += half;
              return 0.5 * (value(low) + value(high)) - value(i);
            };
            for (int density = lowest_; density < 0; ++density) {
              const std::int64_t spacing = std::int64_t{1} << -density;
              if (k % spacing == spacing / 2) raise(density, middle(spacing / 2));
            }
            if (i[a] == 0 || i[a] == n_[a] - 1) continue;
            for (int density = 0; density < highest_; ++density)
              raise(density, between_samples * std::ldexp(middle(1), -2 - 2 * density));
          }
    }
    return out;
  }

  // Samples of the cheapest tile that is foreseen to pass, none where the base does.
  [[nodiscard]] double cheapest(const BrickErrors& b, const std::array<int, 3>& low) const {
    double best = std::pow((q_.granularity << highest_) + 1, 3);
    std::array<int, 3> d{};
    for (d[2] = low[2]; d[2] <= highest_; ++d[2])
      for (d[1] = low[1]; d[1] <= highest_; ++d[1])
        for (d[0] = low[0]; d[0] <= highest_; ++d[0]) {
          double samples = d == low ? 0.0 : 1.0;
          for (const int density : d) samples *= std::ldexp(q_.granularity, density) + 1;
          if (samples < best && passes(b, d)) best = samples;
        }
    return best;
  }

  [[nodiscard]] bool passes(const BrickErrors& b, const std::array<int, 3>& d) const {
    std::array<double, 2> error{0, 0};
    double slack = q_.projection;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto& of_axis = b.of[a];
      const auto& own = of_axis[static_cast<std::size_t>(d[a] - lowest_)];
      const auto& cell = of_axis[static_cast<std::size_t>(-lowest_)];
      // At the gold rate nothing errs, and what gold's interpolant may is that of a cell by the rate squared.
      for (std::size_t s = 0; s < 2; ++s) error[s] += d[a] < highest_ ? own[s] : 0.0;
      slack += std::max(cell[0], cell[1]) / (static_cast<double>(q_.rate) * q_.rate);
    }
    return 0.5 * slack + (q_.fitted ? 0.5 : 1.0) * std::max(error[0], error[1]) <= q_.tolerance;
  }

  const Volume& base_;
  const std::vector<std::uint8_t>& covered_;
  const CoarseningQuestion& q_;
  Index3 n_;
  int lowest_, highest_;
  std::vector<BrickErrors> bricks_;
};

}  // namespace

bool is_possible(const LevelTriple& c, const Grid& grid, int granularity, int rate) {
  MixedVolume shape;
  shape.grid = grid;
  shape.granularity = granularity;
  shape.rate = rate;
  shape.coarsening = c;
  return !grid_problem(shape);
}

LevelTriple choose_coarsening(const Volume& base, const std::vector<std::uint8_t>& covered,
                              const CoarseningQuestion& q) {
  const Foresee foresee(base, covered, q);
  if (foresee.knows_nothing()) return {};
  LevelTriple best{}, c{};
  double fewest = (1 - worth) * foresee.samples(best);
  for (c[0] = 0; c[0] <= 3; ++c[0])
    for (c[1] = 0; c[1] <= 3; ++c[1])
      for (c[2] = 0; c[2] <= 3; ++c[2]) {
        if (c == LevelTriple{0, 0, 0} || !is_possible(c, base.grid, q.granularity, q.rate)) continue;
        const double n = foresee.samples(c);
        if (n >= fewest) continue;
        fewest = n;
        best = c;
      }
  return best;
}

std::vector<float> take_base(const Volume& volume, const LevelTriple& c) {
  const Index3 n = volume.grid.samples();
  std::vector<float> out;
  for (std::int64_t z = 0; z < n[2]; z += std::int64_t{1} << c[0])
    for (std::int64_t y = 0; y < n[1]; y += std::int64_t{1} << c[1])
      for (std::int64_t x = 0; x < n[0]; x += std::int64_t{1} << c[2])
        out.push_back(volume.samples[at((z * n[1] + y) * n[0] + x)]);
  return out;
}

}  // namespace vdvr
