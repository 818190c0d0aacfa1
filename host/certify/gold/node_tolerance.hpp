// What |V - F| may be at the nodes of bricks: one value, or less of some.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace vdvr {

/// A node on the border of several bricks is held to the least of theirs, since each of them is tested with
/// its border.
struct NodeTolerance {
  // NOLINTNEXTLINE(google-explicit-constructor): most volumes have one tolerance
  NodeTolerance(double all) : of_all(all) {}
  NodeTolerance(double all, std::vector<float> bricks) : of_all(all), by_brick(std::move(bricks)) {}
  [[nodiscard]] double of(std::size_t brick) const {
    return by_brick.empty() ? of_all : std::min(of_all, static_cast<double>(by_brick[brick]));
  }
  /// Of each brick the smaller of the two.
  void lower_to(const NodeTolerance& other) {
    of_all = std::min(of_all, other.of_all);
    if (by_brick.empty()) by_brick = other.by_brick;
    else
      for (std::size_t i = 0; i < other.by_brick.size(); ++i)
        by_brick[i] = std::min(by_brick[i], other.by_brick[i]);
  }

  double of_all;
  std::vector<float> by_brick;  ///< of the grid, [bz][by][bx]; empty: none has one of its own
};

}  // namespace vdvr
