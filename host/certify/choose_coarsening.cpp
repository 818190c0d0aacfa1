// Forecasts the storage of every coarsening on some patches of bricks.
#include "host/certify/choose_coarsening.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/volume/validate_volume.hpp"

namespace vdvr {
namespace {

// Patches along an axis, bricks of one that count, and those around them, whose levels bear on their faces.
constexpr std::int64_t most_patches = 4, patch = 4, rim = 1;
// What saves less than this share of the samples is not worth the time: tiles in place of a base that
// neighbours share are classified and verified each.
constexpr double worth = 0.2;
// Of a wave of half the Nyquist frequency the error between samples is that much more than an eighth of the
// second difference; slower ones come nearer to 1.
constexpr double between_samples = 1.2;

// log2 of samples a cell, along x, y, z.
using Density = std::array<int, 3>;

// Along x, y, z and at each density from `lowest` on: the largest of interpolant - field, and of field -
// interpolant.
struct BrickErrors {
  std::array<std::array<std::array<double, 2>, 8>, 3> of{};
  bool covered = false;
};

// A box of neighbouring bricks, x fastest.
struct Patch {
  Index3 first{}, size{};
  std::vector<BrickErrors> bricks;
  std::vector<std::uint8_t> counts;  // not of the rim
  [[nodiscard]] std::size_t index(const Index3& i) const {
    return at((i[2] * size[1] + i[1]) * size[0] + i[0]);
  }
  template <class Visit>
  void for_each(Visit&& visit) const {
    Index3 i{};
    for (i[2] = 0; i[2] < size[2]; ++i[2])
      for (i[1] = 0; i[1] < size[1]; ++i[1])
        for (i[0] = 0; i[0] < size[0]; ++i[0]) visit(i);
  }
};

class StorageForecast {
 public:
  StorageForecast(const Volume& base, const std::vector<std::uint8_t>& covered, const CoarseningQuestion& q)
      : base_(base),
        covered_(covered),
        q_(q),
        n_(base.grid.samples()),
        lowest_(-std::countr_zero(static_cast<unsigned>(q.granularity))),
        highest_(std::min(std::countr_zero(static_cast<unsigned>(q.rate)), 7 + lowest_)) {
    Index3 bricks{}, count{}, i{};
    for (std::size_t a = 0; a < 3; ++a) {
      bricks[a] = base.grid.cells[a] / q.granularity;
      count[a] = std::min((bricks[a] + patch - 1) / patch, most_patches);
    }
    for (i[2] = 0; i[2] < count[2]; ++i[2])
      for (i[1] = 0; i[1] < count[1]; ++i[1])
        for (i[0] = 0; i[0] < count[0]; ++i[0]) patches_.push_back(patch_at(i, count, bricks));
    parallel_for(static_cast<std::int64_t>(patches_.size()), {}, "base", [&](std::int64_t k) {
      Patch& p = patches_[at(k)];
      p.for_each([&](const Index3& b) {
        Index3 first{};
        for (std::size_t a = 0; a < 3; ++a) first[a] = (p.first[a] + b[a]) * q_.granularity;
        if (is_covered(first)) p.bricks[p.index(b)] = errors_of(first);
      });
    });
    for (const Patch& p : patches_)
      for (std::size_t b = 0; b < p.bricks.size(); ++b)
        counted_ += p.counts[b] && p.bricks[b].covered ? 1 : 0;
  }

  // Samples per cell of the grid.
  [[nodiscard]] double samples(const LevelTriple& c) const {
    const Density low{-c[2], -c[1], -c[0]};
    const std::vector<Density> candidates = by_samples(low);
    std::vector<double> tiles(patches_.size());
    parallel_for(static_cast<std::int64_t>(tiles.size()), {}, "base",
                 [&](std::int64_t k) { tiles[at(k)] = tile_samples(patches_[at(k)], low, candidates); });
    const double cells = std::pow(q_.granularity, 3) * static_cast<double>(counted_);
    return std::ldexp(1.0, low[0] + low[1] + low[2]) +
           std::accumulate(tiles.begin(), tiles.end(), 0.0) / cells;
  }
  [[nodiscard]] bool knows_nothing() const { return counted_ == 0; }

 private:
  // Patches that count bricks of their own each, evenly over the grid.
  [[nodiscard]] static Patch patch_at(const Index3& number, const Index3& count, const Index3& bricks) {
    Patch p;
    Index3 low{}, high{};
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] =
          count[a] < most_patches ? number[a] * patch : number[a] * (bricks[a] - patch) / (most_patches - 1);
      high[a] = std::min(low[a] + patch, bricks[a]);
      p.first[a] = std::max(low[a] - rim, std::int64_t{0});
      p.size[a] = std::min(high[a] + rim, bricks[a]) - p.first[a];
    }
    p.bricks.resize(at(p.size[0] * p.size[1] * p.size[2]));
    p.for_each([&](const Index3& i) {
      bool counts = true;
      for (std::size_t a = 0; a < 3; ++a)
        counts = counts && p.first[a] + i[a] >= low[a] && p.first[a] + i[a] < high[a];
      p.counts.push_back(counts);
    });
    return p;
  }

  [[nodiscard]] double tile_size(const Density& d) const {
    double samples = 1;
    for (const int density : d) samples *= std::ldexp(q_.granularity, density) + 1;
    return samples;
  }

  [[nodiscard]] std::vector<Density> by_samples(const Density& low) const {
    std::vector<Density> out{low};  // the base, which takes none
    Density d{};
    for (d[2] = low[2]; d[2] <= highest_; ++d[2])
      for (d[1] = low[1]; d[1] <= highest_; ++d[1])
        for (d[0] = low[0]; d[0] <= highest_; ++d[0])
          if (d != low) out.push_back(d);
    std::stable_sort(out.begin() + 1, out.end(),
                     [&](const Density& a, const Density& b) { return tile_size(a) < tile_size(b); });
    return out;
  }

  // What a brick needs along an axis, those that share a face or an edge along that axis need as well, or
  // closing takes it away: levels along an axis spread across the other two.
  [[nodiscard]] double tile_samples(const Patch& p, const Density& low,
                                    const std::vector<Density>& candidates) const {
    std::vector<Density> own(p.bricks.size(), low);
    for (std::size_t i = 0; i < own.size(); ++i)
      if (p.bricks[i].covered)
        own[i] = *std::find_if(candidates.begin(), candidates.end(), [&](const Density& d) {
          return passes(p.bricks[i], d) || &d == &candidates.back();
        });
    double sum = 0;
    p.for_each([&](const Index3& i) {
      if (!p.counts[p.index(i)] || !p.bricks[p.index(i)].covered) return;
      Density d = own[p.index(i)];
      for (std::size_t a = 0; a < 3; ++a)
        for (int code = 0; code < 9; ++code) {
          Index3 other = i;
          other[(a + 1) % 3] += code % 3 - 1;
          other[(a + 2) % 3] += code / 3 - 1;
          bool exists = true;
          for (std::size_t k = 0; k < 3; ++k) exists = exists && other[k] >= 0 && other[k] < p.size[k];
          if (exists) d[a] = std::max(d[a], own[p.index(other)][a]);
        }
      if (d != low) sum += tile_size(d);
    });
    return sum;
  }

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
    out.covered = true;
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

  [[nodiscard]] bool passes(const BrickErrors& b, const Density& d) const {
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
  std::vector<Patch> patches_;
  std::int64_t counted_ = 0;
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
  const StorageForecast forecast(base, covered, q);
  if (forecast.knows_nothing()) return {};
  LevelTriple best{}, c{};
  double fewest = (1 - worth) * forecast.samples(best);
  for (c[0] = 0; c[0] <= 3; ++c[0])
    for (c[1] = 0; c[1] <= 3; ++c[1])
      for (c[2] = 0; c[2] <= 3; ++c[2]) {
        if (c == LevelTriple{0, 0, 0} || !is_possible(c, base.grid, q.granularity, q.rate)) continue;
        const double n = forecast.samples(c);
        if (n >= fewest) continue;
        fewest = n;
        best = c;
      }
  return best;
}

std::vector<float> take_base(Volume volume, const LevelTriple& c) {
  if (c == LevelTriple{}) return std::move(volume.samples);
  const Index3 n = volume.grid.samples();
  std::vector<float> out;
  for (std::int64_t z = 0; z < n[2]; z += std::int64_t{1} << c[0])
    for (std::int64_t y = 0; y < n[1]; y += std::int64_t{1} << c[1])
      for (std::int64_t x = 0; x < n[0]; x += std::int64_t{1} << c[2])
        out.push_back(volume.samples[at((z * n[1] + y) * n[0] + x)]);
  return out;
}

}  // namespace vdvr
