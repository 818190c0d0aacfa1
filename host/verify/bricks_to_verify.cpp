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

  [[nodiscard]] const std::vector<std::uint8_t>& allowed() const { return allowed_; }
  [[nodiscard]] std::size_t chosen() const { return at(std::count(chosen_.begin(), chosen_.end(), 1)); }

  /// Bricks that may be chosen among these, by level.
  template <class Bricks>
  [[nodiscard]] std::map<LevelTriple, std::vector<std::size_t>> by_level(const Bricks& bricks) const {
    std::map<LevelTriple, std::vector<std::size_t>> out;
    for (const std::size_t i : bricks)
      if (allowed_[i]) out[volume_.level[i]].push_back(i);
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

std::vector<std::size_t> bricks_of(std::span<const std::int64_t> layers, const Index3& n) {
  std::vector<std::size_t> out;
  for (const std::int64_t z : layers)
    for (std::int64_t i = z * n[0] * n[1]; i < (z + 1) * n[0] * n[1]; ++i) out.push_back(at(i));
  return out;
}

void add_of_layers(Sample& sample, const Index3& n, std::span<const std::int64_t> layers, double fraction,
                   std::mt19937& random) {
  for (auto& [level, members] : sample.by_level(bricks_of(layers, n))) {
    std::shuffle(members.begin(), members.end(), random);
    for (const std::size_t i : std::span(members).first(share_of(fraction, members.size()))) sample.add(i);
  }
}

// A level is as frequent in the columns as it is in the volume, but for rare ones.
void add_columns(Sample& sample, const Index3& n, double fraction, std::mt19937& random) {
  std::vector<std::int64_t> columns(at(n[0] * n[1]));
  std::vector<std::size_t> bricks(at(n[0] * n[1] * n[2]));
  std::iota(columns.begin(), columns.end(), 0);
  std::iota(bricks.begin(), bricks.end(), 0);
  std::shuffle(columns.begin(), columns.end(), random);
  for (const std::int64_t c : std::span(columns).first(share_of(fraction, columns.size())))
    sample.add_column(c);
  for (auto& [level, members] : sample.by_level(bricks)) {
    std::shuffle(members.begin(), members.end(), random);
    const std::size_t wanted = std::min(members.size(), least_of_level);
    for (std::size_t i = 0; i < members.size() && sample.chosen_of(members) < wanted; ++i)
      sample.add_column(static_cast<std::int64_t>(members[i]) % (n[0] * n[1]));
  }
}

// A cube of bricks, cut to the grid.
std::vector<std::size_t> cube(const Index3& n, const Index3& first, std::int64_t side) {
  std::vector<std::size_t> out;
  for (std::int64_t z = first[2]; z < std::min(n[2], first[2] + side); ++z)
    for (std::int64_t y = first[1]; y < std::min(n[1], first[1] + side); ++y)
      for (std::int64_t x = first[0]; x < std::min(n[0], first[0] + side); ++x)
        out.push_back(at((z * n[1] + y) * n[0] + x));
  return out;
}

// Where cubes of that side begin that fill a box.
std::vector<Index3> cubes(const Index3& begin, const Index3& end, std::int64_t side) {
  std::vector<Index3> out;
  for (std::int64_t z = begin[2]; z < end[2]; z += side)
    for (std::int64_t y = begin[1]; y < end[1]; y += side)
      for (std::int64_t x = begin[0]; x < end[0]; x += side) out.push_back({x, y, z});
  return out;
}

// Blocks with six times as many bricks as are wanted, four at least, the worst brick's among them; of these
// whole parts, and of each level its least number.
void add_of_blocks(Sample& sample, const Index3& n, const VerifyOptions& options, const Index3& worst,
                   std::mt19937& random) {
  constexpr std::size_t fewest_blocks = 4, of_blocks = 6;
  const auto all = at(std::count(sample.allowed().begin(), sample.allowed().end(), 1));
  const std::size_t wanted = std::min(options.most_of_cone, share_of(options.fraction, all));
  std::vector<Index3> blocks = cubes({0, 0, 0}, n, bricks_of_block), parts;
  std::shuffle(blocks.begin(), blocks.end(), random);
  Index3 of_worst = worst;
  for (std::int64_t& first : of_worst) first -= first % bricks_of_block;
  std::iter_swap(blocks.begin(), std::find(blocks.begin(), blocks.end(), of_worst));
  std::vector<std::size_t> pool;
  std::size_t taken = 0, may_be = 0;
  for (const Index3& first : blocks) {
    if (taken >= fewest_blocks && may_be >= of_blocks * wanted) break;
    const std::vector<std::size_t> members = cube(n, first, bricks_of_block);
    const auto here = std::count_if(members.begin(), members.end(),
                                    [&](std::size_t i) { return sample.allowed()[i] != 0; });
    if (here == 0) continue;
    ++taken;
    may_be += at(here);
    pool.insert(pool.end(), members.begin(), members.end());
    Index3 end = first;
    for (std::size_t a = 0; a < 3; ++a) end[a] = std::min(n[a], end[a] + bricks_of_block);
    const std::vector<Index3> of_block = cubes(first, end, bricks_of_part);
    parts.insert(parts.end(), of_block.begin(), of_block.end());
  }
  std::shuffle(parts.begin(), parts.end(), random);
  for (std::size_t i = 0; i < parts.size() && sample.chosen() < wanted; ++i)
    for (const std::size_t brick : cube(n, parts[i], bricks_of_part)) sample.add(brick);
  for (auto& [level, members] : sample.by_level(pool)) {
    std::shuffle(members.begin(), members.end(), random);
    const std::size_t least = std::min(members.size(), least_of_level);
    for (std::size_t i = 0; i < members.size() && sample.chosen_of(members) < least; ++i)
      sample.add(members[i]);
  }
}

}  // namespace

std::vector<std::uint8_t> all_bricks(const MixedVolume& volume, const Certificate& stored) {
  return bricks_of(stored.roi, volume.grid, volume.granularity);
}

std::vector<std::uint8_t> sample_of_bricks(const MixedVolume& volume, const Certificate& stored,
                                           const VerifyOptions& options, SampleOf shape,
                                           std::vector<std::uint8_t> allowed) {
  const Index3 n = volume.bricks(), worst = brick_at(volume, stored.worst_at);
  std::mt19937 random(options.seed);
  Sample sample(volume, std::move(allowed));
  if (shape == SampleOf::columns) add_columns(sample, n, options.fraction, random);
  if (shape == SampleOf::blocks) add_of_blocks(sample, n, options, worst, random);
  if (shape == SampleOf::layers) {
    const std::vector<std::int64_t> layers = layers_to_sample(n[2], worst[2], random);
    add_of_layers(sample, n, layers,
                  options.fraction * static_cast<double>(n[2]) / static_cast<double>(layers.size()), random);
  }
  sample.add(at((worst[2] * n[1] + worst[1]) * n[0] + worst[0]));
  return sample.take();
}

}  // namespace vdvr
