// What bricks are foreseen to err at each level, and to store, from base samples alone. Nothing of a
// certificate rests on it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "host/certify/gold/gold_batch.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

class BrickForecast {
 public:
  /// `base` holds F on the grid; `slack` is what even gold may err. Cost: some passes over the samples, over
  /// all cores. Memory: up to 48 bytes a brick.
  BrickForecast(const Volume& base, const VolumeLayout& layout, int rate, double slack);

  /// Scales what is expected to what some bricks were measured to err at level 0, in the units of the base.
  void compare(const std::vector<BrickMeasure>& measured);

  using Level = std::array<std::uint8_t, 3>;  ///< x, y, z
  /// The level with the fewest samples that errs at most `tolerance`; the finest where none does.
  [[nodiscard]] Level level(std::size_t brick, double tolerance) const;
  /// With what closing asks for: what a brick needs along an axis, those that share a face or an edge along
  /// that axis need as well.
  [[nodiscard]] std::vector<Level> closed(const std::vector<Level>& own) const;
  /// What |V - F| may be, rounding and samplers aside.
  [[nodiscard]] double error(std::size_t brick, const Level& level) const;
  /// Of a tile; 0 at level 0.
  [[nodiscard]] std::uint64_t samples(const Level& level) const;
  [[nodiscard]] const Index3& bricks() const { return bricks_; }
  /// Bytes of one of this size.
  static std::uint64_t bytes(const Grid& grid, const VolumeLayout& layout);

 private:
  void look_at(const Volume& base, std::size_t brick);
  [[nodiscard]] double along(std::size_t brick, std::size_t axis, int level) const;

  VolumeLayout layout_;
  Index3 bricks_{};
  std::array<std::size_t, 3> first_{};  // of an axis, in what a brick has
  std::size_t per_brick_ = 0;
  std::array<int, 3> coarsening_{}, finest_{};  // x, y, z
  double slack_, scale_ = 1;
  std::vector<float> errors_;  // [brick][axis][level up to the grid's]
};

}  // namespace vdvr
