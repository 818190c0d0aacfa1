// Stratified sampling of bricks (docs/performance.md).
#include "host/foresee.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

namespace vdvr {
namespace {

constexpr std::int64_t layers = 6, timed_blocks = 3;
constexpr double sampled_bricks = 480, fewest_of_stratum = 12;

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

Index3 bricks_of(const GoldSettings& s) {
  Index3 n{};
  for (std::size_t a = 0; a < 3; ++a) n[a] = (s.grid.cells[a] + s.granularity - 1) / s.granularity;
  return n;
}

// The larger signed sum of the second differences of base samples in each brick, an eighth of it: what
// trilinear interpolation of them may err by, if they resolved the field. They need not: it only sorts
// bricks.
std::vector<double> expected_error(const Volume& base, int granularity, const Index3& bricks) {
  const Index3 n = base.grid.samples();
  const auto value = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    return static_cast<double>(base.samples[at((z * n[1] + y) * n[0] + x)]);
  };
  std::vector<double> out(at(bricks[0] * bricks[1] * bricks[2]), 0.0);
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const double centre = 2 * value(x, y, z);
        double plus = 0, minus = 0;
        const auto add = [&](bool inside, double neighbours) {
          if (!inside) return;
          plus += std::max(0.0, neighbours - centre);
          minus += std::max(0.0, centre - neighbours);
        };
        const bool in_x = x > 0 && x + 1 < n[0], in_y = y > 0 && y + 1 < n[1], in_z = z > 0 && z + 1 < n[2];
        add(in_x, in_x ? value(x - 1, y, z) + value(x + 1, y, z) : 0);
        add(in_y, in_y ? value(x, y - 1, z) + value(x, y + 1, z) : 0);
        add(in_z, in_z ? value(x, y, z - 1) + value(x, y, z + 1) : 0);
        const auto brick = [&](std::int64_t i, std::size_t a) {
          return std::min(i / granularity, bricks[a] - 1);
        };
        double& e = out[at((brick(z, 2) * bricks[1] + brick(y, 1)) * bricks[0] + brick(x, 0))];
        e = std::max(e, std::max(plus, minus) / 8);
      }
  return out;
}

// One stratum per half octave of expected error over tolerance.
int stratum_of(double error, double tolerance) {
  return static_cast<int>(
      std::clamp(std::round(2 * std::log2(std::max(error / tolerance, 1e-9))), -8.0, 16.0));
}

struct Stratum {
  std::vector<std::int64_t> bricks, candidates;  // all, and those in the layers looked at
  double seen = 0, tile_samples = 0, refined = 0;
};

// Levels of the selected bricks, with the tiles extracted as build does.
template <class Visit>
void classify(opencl::State& state, GoldStream& stream, const DeviceField& field, double tolerance,
              const std::vector<std::uint8_t>& selected, Visit&& visit) {
  const opencl::DeviceArray<std::uint8_t> on_device(state, std::span<const std::uint8_t>(selected),
                                                    "sampled bricks");
  stream.run(
      selected,
      [&](GoldStream::Batch& batch) {
        const auto classes = batch.classify(field, static_cast<float>(tolerance), on_device);
        std::vector<std::pair<std::int64_t, LevelTriple>> tiles;
        for (const BrickClass& c : classes) {
          const int level = c.base.total < 0 ? 0 : c.level;
          const auto l = static_cast<std::uint8_t>(level);
          if (level > 0) tiles.emplace_back(c.base.brick, LevelTriple{l, l, l});
          visit(c.base.brick, level);
        }
        batch.extract(tiles);
      },
      {}, "foresee", GoldStream::For::samples);
}

// Whole blocks of the middle slab, at several radii.
std::vector<std::uint8_t> some_blocks(const GoldStream& stream, const Index3& n) {
  std::vector<std::uint8_t> selected(at(n[0] * n[1] * n[2]), 0);
  const Index3 block = stream.block_bricks();
  const auto begin = [&](std::size_t a, double f) {
    return static_cast<std::int64_t>(f * static_cast<double>(n[a])) / block[a] * block[a];
  };
  const std::int64_t z0 = begin(2, 0.5);
  for (std::int64_t i = 0; i < timed_blocks; ++i) {
    // Radii that stand for equal areas of the covered disc: blocks on the axis fit more than most.
    const double f = 0.5 - 0.5 * std::sqrt((2.0 * static_cast<double>(i) + 1) / (2.0 * timed_blocks));
    const std::int64_t x0 = begin(0, f), y0 = begin(1, 0.5);
    for (std::int64_t z = z0; z < std::min(n[2], z0 + block[2]); ++z)
      for (std::int64_t y = y0; y < std::min(n[1], y0 + block[1]); ++y)
        for (std::int64_t x = x0; x < std::min(n[0], x0 + block[0]); ++x)
          selected[at((z * n[1] + y) * n[0] + x)] = 1;
  }
  return selected;
}

GoldSpent difference(const GoldSpent& after, const GoldSpent& before) {
  GoldSpent d = after;
  d.work.rows -= before.work.rows;
  d.work.samples -= before.work.samples;
  d.slab_seconds -= before.slab_seconds;
  d.table_seconds -= before.table_seconds;
  d.block_seconds -= before.block_seconds;
  return d;
}

double seconds_of(const GoldWork& work, const GoldSpent& spent, bool tables) {
  return work.rows * (spent.slab_seconds + (tables ? spent.table_seconds : 0)) /
             std::max(1.0, spent.work.rows) +
         work.samples * spent.block_seconds / std::max(1.0, spent.work.samples);
}

}  // namespace

Foreseen foresee_build(opencl::State& state, GoldStream& stream, const Volume& base, double tolerance) {
  const GoldSettings& settings = stream.settings();
  const Index3 n = bricks_of(settings);
  const std::vector<std::uint8_t> near = stream.bricks_near_coverage();
  const DeviceField field(state, as_mixed(base, settings.granularity));

  // Time, after one brick that builds kernels.
  std::vector<std::uint8_t> one(near.size(), 0);
  one[at((n[2] / 2 * n[1] + n[1] / 2) * n[0] + n[0] / 2)] = 1;
  classify(state, stream, field, tolerance, one, [](std::int64_t, int) {});
  const GoldSpent warm = stream.spent();
  classify(state, stream, field, tolerance, some_blocks(stream, n), [](std::int64_t, int) {});
  const GoldSpent large = difference(stream.spent(), warm);

  // Storage.
  const auto error = expected_error(base, settings.granularity, n);
  const std::int64_t looked_at = std::min(layers, n[2]);
  std::vector<std::uint8_t> in_layer(at(n[2]), 0);
  for (std::int64_t i = 0; i < looked_at; ++i) in_layer[at((2 * i + 1) * n[2] / (2 * looked_at))] = 1;
  std::map<int, Stratum> strata;
  for (std::size_t i = 0; i < near.size(); ++i) {
    if (!near[i]) continue;
    Stratum& s = strata[stratum_of(error[i], tolerance)];
    s.bricks.push_back(static_cast<std::int64_t>(i));
    if (in_layer[at(static_cast<std::int64_t>(i) / (n[0] * n[1]))])
      s.candidates.push_back(static_cast<std::int64_t>(i));
  }
  // Tiles grow with the error to the power 3/2, and so does their spread: sample in that proportion (Neyman).
  const auto weight = [](int key, const Stratum& s) {
    return static_cast<double>(s.bricks.size()) * std::pow(2.0, 0.75 * key);
  };
  double all_weights = 0;
  for (const auto& [key, s] : strata) all_weights += weight(key, s);
  std::mt19937 random(1);
  std::vector<std::uint8_t> sampled(near.size(), 0);
  for (auto& [key, s] : strata) {
    std::shuffle(s.candidates.begin(), s.candidates.end(), random);
    const double wanted = std::max(fewest_of_stratum, sampled_bricks * weight(key, s) / all_weights);
    s.candidates.resize(std::min(s.candidates.size(), static_cast<std::size_t>(wanted)));
    for (const std::int64_t i : s.candidates) sampled[at(i)] = 1;
  }
  const GoldSpent before = stream.spent();
  classify(state, stream, field, tolerance, sampled, [&](std::int64_t brick, int level) {
    Stratum& s = strata[stratum_of(error[at(brick)], tolerance)];
    s.seen += 1;
    s.refined += level > 0 ? 1 : 0;
    s.tile_samples += level > 0 ? std::pow((settings.granularity << level) + 1, 3) : 0.0;
  });
  const GoldSpent small = difference(stream.spent(), before);

  // A stratum without a brick in the layers takes after the one below it.
  double tile_samples = 0, mean = 0, share = 0;
  std::vector<std::uint8_t> refined(near.size(), 0);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const auto& [key, s] : strata) {
    if (s.seen > 0) {
      mean = s.tile_samples / s.seen;
      share = s.refined / s.seen;
    }
    tile_samples += mean * static_cast<double>(s.bricks.size());
    for (const std::int64_t i : s.bricks) refined[at(i)] = unit(random) < share ? 1 : 0;
  }
  Foreseen out;
  const auto samples = static_cast<double>(base.samples.size());
  out.samples_ratio = (samples + static_cast<double>(near.size()) + tile_samples) / samples;
  out.tile_bytes = static_cast<std::uint64_t>(4 * tile_samples);
  out.seconds = seconds_of(stream.work(near, GoldStream::For::samples), large, true) +
                seconds_of(stream.work(refined, GoldStream::For::measuring), small, false);
  return out;
}

}  // namespace vdvr
