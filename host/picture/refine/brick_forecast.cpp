// Errors of interpolation along each axis, which add up (docs/error-bounds.md, section 3).
#include "host/picture/refine/brick_forecast.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {
namespace {

std::array<int, 3> xyz(const LevelTriple& zyx) {
  return {static_cast<int>(zyx[2]), static_cast<int>(zyx[1]), static_cast<int>(zyx[0])};
}

std::size_t errors_of_brick(const VolumeLayout& layout) {
  return 3 + static_cast<std::size_t>(layout.coarsening[0] + layout.coarsening[1] + layout.coarsening[2]);
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::uint64_t BrickForecast::bytes(const Grid& grid, const VolumeLayout& layout) {
  return 4 * errors_of_brick(layout) * count(Bricks(grid, layout.granularity).size());
}

BrickForecast::BrickForecast(const Volume& base, const VolumeLayout& layout, int rate, double slack)
    : layout_(layout),
      bricks_(Bricks(base.grid, layout.granularity).along()),
      per_brick_(errors_of_brick(layout)),
      coarsening_(xyz(layout.coarsening)),
      finest_(xyz(finest_level(rate, layout.coarsening))),
      slack_(slack) {
  for (std::size_t a = 0; a < 2; ++a) first_[a + 1] = first_[a] + 1 + at(coarsening_[a]);
  const std::int64_t layer = bricks_[0] * bricks_[1];
  errors_.assign(per_brick_ * at(layer * bricks_[2]), 0.0f);
  parallel_for(bricks_[2], {}, "plan", [&](std::int64_t z) {
    for (std::int64_t i = z * layer; i < (z + 1) * layer; ++i) look_at(base, at(i));
  });
}

// At the spacings of coarse bases what is left out is known; finer ones err as second differences say.
void BrickForecast::look_at(const Volume& base, std::size_t brick) {
  // Of a wave of half the Nyquist frequency: the error between samples over an eighth of the second
  // difference.
  constexpr double between_samples = 1.2;
  const Bricks bricks(base.grid, layout_.granularity);
  const Index3 n = base.grid.samples(), place = bricks.position(static_cast<std::int64_t>(brick)),
               first = bricks.first_cell(place), cells = bricks.cells(place);
  const auto value = [&](const Index3& i) {
    return static_cast<double>(base.samples[at((i[2] * n[1] + i[1]) * n[0] + i[0])]);
  };
  Index3 i{};
  for (i[2] = first[2]; i[2] <= first[2] + cells[2]; ++i[2])
    for (i[1] = first[1]; i[1] <= first[1] + cells[1]; ++i[1])
      for (i[0] = first[0]; i[0] <= first[0] + cells[0]; ++i[0])
        for (std::size_t a = 0; a < 3; ++a) {
          const auto raise = [&](std::int64_t half, int level, double share) {
            Index3 low = i, high = i;
            low[a] -= half;
            high[a] += half;
            if (low[a] < 0 || high[a] >= n[a]) return;
            float& e = errors_[brick * per_brick_ + first_[a] + at(level)];
            e = std::max(e,
                         static_cast<float>(share * std::abs(0.5 * (value(low) + value(high)) - value(i))));
          };
          for (int level = 0; level < coarsening_[a]; ++level) {
            const std::int64_t spacing = std::int64_t{1} << (coarsening_[a] - level);
            if ((i[a] - first[a]) % spacing == spacing / 2) raise(spacing / 2, level, 1);
          }
          raise(1, coarsening_[a], between_samples / 4);
        }
}

double BrickForecast::along(std::size_t brick, std::size_t axis, int level) const {
  const int known = std::min(level, coarsening_[axis]);
  // At the gold rate nothing is left out.
  return level >= finest_[axis]
             ? 0
             : std::ldexp(static_cast<double>(errors_[brick * per_brick_ + first_[axis] + at(known)]),
                          -2 * (level - known));
}

void BrickForecast::compare(const std::vector<BrickMeasure>& measured) {
  std::vector<double> quotients, slack;
  int rate = 0;
  for (const BrickMeasure& m : measured) rate = std::max(rate, m.rate);
  for (const BrickMeasure& m : measured) {
    double expected = 0;
    for (std::size_t a = 0; a < 3; ++a) expected += along(at(m.brick), a, 0);
    if (expected > 0 && m.error > 0) quotients.push_back(static_cast<double>(m.error) / expected);
    if (m.rate == rate) slack.push_back(static_cast<double>(m.slack));
  }
  if (!quotients.empty()) scale_ = median(quotients);
  if (!slack.empty()) slack_ = std::min(slack_, median(slack));
}

double BrickForecast::error(std::size_t brick, const Level& level) const {
  double sum = slack_;
  for (std::size_t a = 0; a < 3; ++a) sum += scale_ * along(brick, a, level[a]);
  return sum;
}

std::uint64_t BrickForecast::samples(const Level& level) const {
  if (level == Level{}) return 0;
  std::uint64_t size = 1;
  for (std::size_t a = 0; a < 3; ++a)
    size *= static_cast<std::uint64_t>(std::ldexp(layout_.granularity, level[a] - coarsening_[a])) + 1;
  return size;
}

// The axis that errs most is the one to refine: it takes the fewest samples for what it gains.
BrickForecast::Level BrickForecast::level(std::size_t brick, double tolerance) const {
  Level level{};
  while (!(error(brick, level) <= tolerance)) {
    std::array<double, 3> errors{};
    for (std::size_t a = 0; a < 3; ++a) errors[a] = along(brick, a, level[a]);
    const auto worst =
        static_cast<std::size_t>(std::max_element(errors.begin(), errors.end()) - errors.begin());
    if (!(errors[worst] > 0)) break;
    if (layout_.levels == Levels::anisotropic) ++level[worst];
    else
      for (std::uint8_t& l : level) ++l;
  }
  return level;
}

std::vector<BrickForecast::Level> BrickForecast::closed(const std::vector<Level>& own) const {
  std::vector<Level> out = own, before;
  // Across one axis after the other: the largest of three neighbours, twice.
  for (std::size_t across = 0; across < 3; ++across) {
    before = out;
    const std::int64_t step = across == 0 ? 1 : across == 1 ? bricks_[0] : bricks_[0] * bricks_[1];
    for (std::int64_t i = 0; i < std::ssize(out); ++i) {
      const std::int64_t place = i / step % bricks_[across];
      for (const std::int64_t side : {-1, 1}) {
        if (place + side < 0 || place + side >= bricks_[across]) continue;
        for (std::size_t a = 0; a < 3; ++a)
          if (a != across) out[at(i)][a] = std::max(out[at(i)][a], before[at(i + side * step)][a]);
      }
    }
  }
  return out;
}

}  // namespace vdvr
