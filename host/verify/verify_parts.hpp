// The parts of VerifyField's work: bricks whose nodes are held at once, blocks of pieces that are computed
// one after another, batches of these on the device. Included by verify_field.cpp, verify_parts.cpp and
// verify_pieces.cpp alone.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/verify/verify_field.hpp"

namespace vdvr {

// Of gold nodes: RADIUS of the kernel.
constexpr std::int64_t verify_halo = 2;

// Gold cells of a piece's side at most: what is computed at once stays small whatever the rate.
constexpr std::int64_t most_piece_cells = 64;

// Floats after a buffer's end that 16-lane reads may touch.
constexpr std::int64_t lanes_beyond = 64;

/// How the selected bricks are cut into pieces, and these joined to blocks that are computed at once.
struct VerifyField::Shape {
  std::int64_t rate = 1;               // gold cells to a cell of the grid
  Vec3 h{};                            // gold spacing
  std::int64_t width = 1, height = 1;  // pieces per block across z, pieces per slab along z
  std::int64_t cells = 1;              // gold cells of a piece's side
  std::int64_t per_brick = 1;          // pieces of a brick's side
  Index3 pieces{};                     // of the grid
  std::int64_t nx = 0, nz = 0, z_padded = 0, error_padded = 0, words = 0;
  std::int64_t slab_z = 0;  // first layer of pieces
  VerifyNodes::Part nodes;  // that gold is made of
  FieldBounds bounds;       // of parallel beam
  float correction = 1;     // of all bounds

  /// Where a piece begins along an axis.
  [[nodiscard]] double begin(const Grid& grid, std::size_t axis, std::int64_t piece) const {
    return grid.origin[axis] +
           static_cast<double>(piece * cells) / static_cast<double>(rate) * grid.spacing[axis];
  }
  /// The brick that a piece belongs to, (z * bricks_y + y) * bricks_x + x.
  [[nodiscard]] std::size_t brick(const Index3& n, std::int64_t x, std::int64_t y, std::int64_t z) const {
    return at((z / per_brick * n[1] + y / per_brick) * n[0] + x / per_brick);
  }
};

struct VerifyField::Batch {
  std::vector<cl_int4> first, items;
  std::vector<std::int64_t> bricks;  // of the items
  std::vector<std::uint8_t> tested;  // [block][y][x] gold cell columns
};

/// Bricks whose nodes are held at once.
struct VerifyField::Part {
  VerifyNodes::Part nodes;
  std::vector<std::uint8_t> selected;
};

/// Blocks that are computed one after another, from the same heights.
struct VerifyField::Slab {
  std::int64_t z = 0;
  std::vector<std::array<std::int64_t, 2>> blocks;
};

/// The bricks that are selected lie in [first, end) along each axis.
struct BoxOfBricks {
  Index3 first{INT64_MAX, INT64_MAX, INT64_MAX}, end{0, 0, 0};
  std::int64_t bricks = 0;

  BoxOfBricks(const Index3& n, const std::vector<std::uint8_t>& selected) {
    for (std::int64_t i = 0; i < static_cast<std::int64_t>(selected.size()); ++i) {
      if (!selected[at(i)]) continue;
      ++bricks;
      const Index3 p{i % n[0], i / n[0] % n[1], i / n[0] / n[1]};
      for (std::size_t a = 0; a < 3; ++a) {
        first[a] = std::min(first[a], p[a]);
        end[a] = std::max(end[a], p[a] + 1);
      }
    }
  }
  [[nodiscard]] std::int64_t size() const {
    return (end[0] - first[0]) * (end[1] - first[1]) * (end[2] - first[2]);
  }
};

}  // namespace vdvr
