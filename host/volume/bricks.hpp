// The bricks of a grid: how many, where, and what cells they hold. Bricks are numbered [bz][by][bx].
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "vdvr/expert/grid.hpp"

namespace vdvr {

class Bricks {
 public:
  Bricks(const Grid& grid, int granularity) : grid_(grid), granularity_(granularity) {
    for (std::size_t a = 0; a < 3; ++a) along_[a] = (grid.cells[a] + granularity - 1) / granularity;
  }

  /// Bricks along x, y, z.
  [[nodiscard]] const Index3& along() const { return along_; }
  [[nodiscard]] std::int64_t granularity() const { return granularity_; }
  [[nodiscard]] std::int64_t size() const { return along_[0] * along_[1] * along_[2]; }
  [[nodiscard]] std::int64_t number(const Index3& p) const {
    return (p[2] * along_[1] + p[1]) * along_[0] + p[0];
  }
  [[nodiscard]] Index3 position(std::int64_t brick) const {
    return {brick % along_[0], brick / along_[0] % along_[1], brick / along_[0] / along_[1]};
  }
  /// The first of its cells.
  [[nodiscard]] Index3 first_cell(const Index3& p) const {
    return {p[0] * granularity_, p[1] * granularity_, p[2] * granularity_};
  }
  /// Of its cells, those that lie in the grid.
  [[nodiscard]] Index3 cells(const Index3& p) const {
    Index3 n{};
    for (std::size_t a = 0; a < 3; ++a)
      n[a] = std::min<std::int64_t>(granularity_, grid_.cells[a] - p[a] * granularity_);
    return n;
  }
  /// Low and high corner of its closed box, cut to the grid.
  [[nodiscard]] std::pair<Vec3, Vec3> box(const Index3& p) const {
    const Index3 first = first_cell(p), n = cells(p);
    std::pair<Vec3, Vec3> box;
    for (std::size_t a = 0; a < 3; ++a) {
      box.first[a] = grid_.origin[a] + static_cast<double>(first[a]) * grid_.spacing[a];
      box.second[a] = grid_.origin[a] + static_cast<double>(first[a] + n[a]) * grid_.spacing[a];
    }
    return box;
  }

 private:
  Grid grid_;
  std::int64_t granularity_;
  Index3 along_{};
};

}  // namespace vdvr
