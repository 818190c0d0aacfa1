// From the bottom up over cubes of 2^k bricks: a cube becomes one block where that costs no more points than
// its eight parts, each block counted with what it is worth. Then neighbours of one triple that make a box
// are joined.
#include "host/export/vtk_partition.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

constexpr double most_points = 0x1p24;

/// The cubes of one size: what each costs at best, its finest triple, and whether it is a block by itself.
struct Scale {
  Index3 cubes{};
  std::vector<float> cost;
  std::vector<LevelTriple> level;
  std::vector<bool> whole;

  [[nodiscard]] std::size_t number(const Index3& p) const {
    return at((p[2] * cubes[1] + p[1]) * cubes[0] + p[0]);
  }
};

class Partition {
 public:
  Partition(const MixedVolume& v, double worth) : v_(v), bricks_(v.bricks()), worth_(worth) {
    Scale finest{bricks_, {}, v.level, {}};
    for (std::size_t i = 0; i < v.level.size(); ++i)
      finest.cost.push_back(static_cast<float>(points(brick_box(i, bricks_, 0), v.level[i]) + worth_));
    finest.whole.assign(v.level.size(), true);
    scales_.push_back(std::move(finest));
    while (std::max({scales_.back().cubes[0], scales_.back().cubes[1], scales_.back().cubes[2]}) > 1)
      add_scale();
  }

  std::vector<VtkBlock> blocks() {
    collect(scales_.size() - 1, {0, 0, 0});
    for (std::size_t axis = 0; axis < 3; ++axis) join(axis);
    for (Box& box : boxes_) out_.push_back(block_of(box));
    return std::move(out_);
  }

 private:
  struct Box {
    Index3 first{}, count{};
    LevelTriple level{};
  };

  /// The bricks of cube `i` of a scale with `cubes`.
  [[nodiscard]] Box brick_box(std::size_t i, const Index3& cubes, std::size_t scale) const {
    const auto n = static_cast<std::int64_t>(i);
    const Index3 p{n % cubes[0], n / cubes[0] % cubes[1], n / cubes[0] / cubes[1]};
    Box box;
    for (std::size_t a = 0; a < 3; ++a) {
      box.first[a] = p[a] << scale;
      box.count[a] = std::min<std::int64_t>(std::int64_t{1} << scale, bricks_[a] - box.first[a]);
    }
    return box;
  }
  [[nodiscard]] std::int64_t cells_end(std::int64_t brick, std::size_t a) const {
    return std::min(v_.grid.cells[a], brick * v_.granularity);
  }
  [[nodiscard]] double points(const Box& box, const LevelTriple& level) const {
    double n = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t cells = cells_end(box.first[a] + box.count[a], a) - box.first[a] * v_.granularity;
      n *= std::ldexp(static_cast<double>(cells), level[2 - a] - v_.coarsening[2 - a]) + 1;
    }
    return n;
  }

  void add_scale() {
    const std::size_t k = scales_.size();
    const Scale& below = scales_.back();
    Scale next;
    for (std::size_t a = 0; a < 3; ++a) next.cubes[a] = (below.cubes[a] + 1) / 2;
    const std::size_t count = at(next.cubes[0] * next.cubes[1] * next.cubes[2]);
    next.cost.assign(count, 0);
    next.level.assign(count, LevelTriple{});
    next.whole.assign(count, false);
    for (std::int64_t z = 0; z < below.cubes[2]; ++z)
      for (std::int64_t y = 0; y < below.cubes[1]; ++y)
        for (std::int64_t x = 0; x < below.cubes[0]; ++x) {
          const std::size_t from = below.number({x, y, z}), to = next.number({x / 2, y / 2, z / 2});
          next.cost[to] += below.cost[from];
          for (std::size_t a = 0; a < 3; ++a)
            next.level[to][a] = std::max(next.level[to][a], below.level[from][a]);
        }
    for (std::size_t i = 0; i < count; ++i) {
      const double n = points(brick_box(i, next.cubes, k), next.level[i]);
      if (n > most_points || n + worth_ > static_cast<double>(next.cost[i])) continue;
      next.whole[i] = true;
      next.cost[i] = static_cast<float>(n + worth_);
    }
    scales_.push_back(std::move(next));
  }

  // As deep as there are scales: at most 24.
  void collect(std::size_t k, const Index3& p) {  // NOLINT(misc-no-recursion)
    const Scale& scale = scales_[k];
    const std::size_t i = scale.number(p);
    if (scale.whole[i]) {
      Box box = brick_box(i, scale.cubes, k);
      box.level = scale.level[i];
      boxes_.push_back(box);
      return;
    }
    const Index3 n = scales_[k - 1].cubes;
    for (std::int64_t z = 2 * p[2]; z < std::min(2 * p[2] + 2, n[2]); ++z)
      for (std::int64_t y = 2 * p[1]; y < std::min(2 * p[1] + 2, n[1]); ++y)
        for (std::int64_t x = 2 * p[0]; x < std::min(2 * p[0] + 2, n[0]); ++x) collect(k - 1, {x, y, z});
  }

  /// Boxes of one triple and one cross-section that follow one another along an axis.
  void join(std::size_t axis) {
    const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
    const auto key = [&](const Box& x) {
      return std::tuple(x.level, x.first[b], x.count[b], x.first[c], x.count[c], x.first[axis]);
    };
    std::sort(boxes_.begin(), boxes_.end(), [&](const Box& x, const Box& y) { return key(x) < key(y); });
    std::vector<Box> joined;
    for (const Box& box : boxes_) {
      if (!joined.empty()) {
        Box& last = joined.back();
        Box both = last;
        both.count[axis] += box.count[axis];
        const bool follows = last.level == box.level && last.first[b] == box.first[b] &&
                             last.count[b] == box.count[b] && last.first[c] == box.first[c] &&
                             last.count[c] == box.count[c] &&
                             last.first[axis] + last.count[axis] == box.first[axis];
        if (follows && points(both, box.level) <= most_points) {
          last = both;
          continue;
        }
      }
      joined.push_back(box);
    }
    boxes_ = std::move(joined);
  }

  [[nodiscard]] VtkBlock block_of(const Box& box) const {
    VtkBlock block;
    block.first_brick = box.first;
    block.bricks = box.count;
    block.origin = v_.grid.origin;
    for (std::size_t a = 0; a < 3; ++a) {
      const int k = box.level[2 - a] - v_.coarsening[2 - a];
      block.per_cell[a] = k;
      block.spacing[a] = std::ldexp(v_.grid.spacing[a], -k);
      const auto sample = [&](std::int64_t cell) { return k >= 0 ? cell << k : cell >> -k; };
      block.extent[2 * a] = sample(box.first[a] * v_.granularity);
      block.extent[2 * a + 1] = sample(cells_end(box.first[a] + box.count[a], a));
    }
    return block;
  }

  const MixedVolume& v_;
  Index3 bricks_;
  double worth_;
  std::vector<Scale> scales_;
  std::vector<Box> boxes_;
  std::vector<VtkBlock> out_;
};

}  // namespace

std::vector<VtkBlock> partition(const MixedVolume& volume, double worth) {
  return Partition(volume, worth).blocks();
}

}  // namespace vdvr
