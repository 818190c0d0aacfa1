// Samples are drawn by a generator that the options seed, so that one file is tested alike each time.
#include "host/verify/bricks_to_verify.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <span>

#include "host/base/system/casts.hpp"
#include "vdvr/expert/region_of_interest.hpp"

namespace vdvr {
namespace {

constexpr std::size_t least_of_level = 8;

std::size_t share_of(double fraction, std::size_t members) {
  const double wanted = std::ceil(fraction * static_cast<double>(members));
  return std::min(members, std::max(least_of_level, static_cast<std::size_t>(wanted)));
}

// The certificate's worst node is in one of them, the others are spread over the volume.
std::vector<std::int64_t> layers_to_sample(std::int64_t count, std::int64_t worst, std::mt19937& random) {
  std::vector<std::int64_t> layers{worst};
  const std::int64_t others = std::min(count, layers_of_sample) - 1;
  for (std::int64_t i = 0; i < others; ++i) {
    const std::int64_t first = i * count / others, last = (i + 1) * count / others - 1;
    const std::int64_t layer =
        std::uniform_int_distribution<std::int64_t>(first, std::max(first, last))(random);
    if (std::find(layers.begin(), layers.end(), layer) == layers.end()) layers.push_back(layer);
  }
  return layers;
}

/// What is chosen among bricks that may be.
class Sample {
 public:
  Sample(const MixedVolume& volume, std::vector<std::uint8_t> allowed)
      : volume_(volume), allowed_(std::move(allowed)), chosen_(allowed_.size(), 0) {}

  void add(std::size_t brick) { chosen_[brick] = allowed_[brick]; }

  void add_column(std::int64_t column) {
    const Index3 n = volume_.bricks();
    for (std::int64_t z = 0; z < n[2]; ++z) add(at(z * n[0] * n[1] + column));
  }

  /// Bricks that may be chosen, by level.
  [[nodiscard]] std::map<LevelTriple, std::vector<std::size_t>> by_level(
      std::span<const std::int64_t> layers) const {
    const Index3 n = volume_.bricks();
    std::map<LevelTriple, std::vector<std::size_t>> out;
    for (const std::int64_t z : layers)
      for (std::int64_t i = z * n[0] * n[1]; i < (z + 1) * n[0] * n[1]; ++i)
        if (allowed_[at(i)]) out[volume_.level[at(i)]].push_back(at(i));
    return out;
  }

  [[nodiscard]] std::size_t chosen_of(std::span<const std::size_t> members) const {
    return at(std::count_if(members.begin(), members.end(), [&](std::size_t i) { return chosen_[i] != 0; }));
  }

  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(chosen_); }

 private:
  const MixedVolume& volume_;
  std::vector<std::uint8_t> allowed_, chosen_;
};

void add_of_layers(Sample& sample, std::span<const std::int64_t> layers, double fraction,
                   std::mt19937& random) {
  for (auto& [level, members] : sample.by_level(layers)) {
    std::shuffle(members.begin(), members.end(), random);
    for (const std::size_t i : std::span(members).first(share_of(fraction, members.size()))) sample.add(i);
  }
}

// A level is as frequent in the columns as it is in the volume, but for rare ones.
void add_columns(Sample& sample, const Index3& n, double fraction, std::mt19937& random) {
  std::vector<std::int64_t> columns(at(n[0] * n[1])), layers(at(n[2]));
  std::iota(columns.begin(), columns.end(), 0);
  std::iota(layers.begin(), layers.end(), 0);
  std::shuffle(columns.begin(), columns.end(), random);
  for (const std::int64_t c : std::span(columns).first(share_of(fraction, columns.size())))
    sample.add_column(c);
  for (auto& [level, members] : sample.by_level(layers)) {
    std::shuffle(members.begin(), members.end(), random);
    const std::size_t wanted = std::min(members.size(), least_of_level);
    for (std::size_t i = 0; i < members.size() && sample.chosen_of(members) < wanted; ++i)
      sample.add_column(static_cast<std::int64_t>(members[i]) % (n[0] * n[1]));
  }
}

}  // namespace

std::vector<std::uint8_t> all_bricks(const MixedVolume& volume, const Certificate& stored) {
  return bricks_of(stored.roi, volume.grid, volume.granularity);
}

std::vector<std::uint8_t> sample_of_bricks(const MixedVolume& volume, const Certificate& stored,
                                           const VerifyOptions& options, bool all_heights) {
  const Index3 n = volume.bricks(), worst = brick_at(volume, stored.worst_at);
  std::mt19937 random(options.seed);
  Sample sample(volume, all_bricks(volume, stored));
  if (all_heights) {
    add_columns(sample, n, options.fraction, random);
  } else {
    const std::vector<std::int64_t> layers = layers_to_sample(n[2], worst[2], random);
    add_of_layers(sample, layers,
                  options.fraction * static_cast<double>(n[2]) / static_cast<double>(layers.size()), random);
  }
  sample.add(at((worst[2] * n[1] + worst[1]) * n[0] + worst[0]));
  return sample.take();
}

}  // namespace vdvr
