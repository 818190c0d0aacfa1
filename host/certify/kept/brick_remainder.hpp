// What T leaves out, brick by brick, from fourth differences of gold: at twice the rate of kept nodes with
// six taps in u, at the kept nodes themselves with linear or cubic interpolation (docs/error-bounds.md,
// section 5).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "host/certify/bounds/remainder_norms.hpp"
#include "host/certify/kept/kept_gold.hpp"
#include "host/field/fdk/region_parts.hpp"

namespace vdvr {

/// Bounds how far an eighth of the sum of three second derivatives, times the spacings' squares, lies from
/// the same sum of second differences of gold at the corners of its cell: (1/8) [ (5/24) sum_j X_jj + (2/8)
/// sum_{i<j} X_ij ], X_ij at least h_i^2 h_j^2 |F_iijj| in the cell and one step around it.
class BrickRemainder {
 public:
  /// Of bricks of `grid`, whose rates `kept` has; `differences` as Rates has them. The first four are
  /// referred to.
  BrickRemainder(opencl::State& state, KeptGold& kept, const FilteredScan& scan, const FieldSups& sups,
                 const Grid& grid, int granularity, int differences);

  /// Looks at the bricks selected[(z * bricks_y + y) * bricks_x + x] and what their stencils reach, as far as
  /// nobody has. Cost: gold at the rate of the differences, and six of these a node.
  void require(const std::vector<std::uint8_t>& selected, const Progress& progress);
  /// KeptGold::will_read of what that reads.
  void will_require(const std::vector<std::uint8_t>& selected);

  /// Bricks that are looked at together, some around the grid included.
  struct Block {
    Index3 first{}, bricks{};
  };
  /// What require() would look at.
  [[nodiscard]] std::vector<Block> open(const std::vector<std::uint8_t>& selected) const;
  /// What has been looked at.
  [[nodiscard]] std::vector<Block> known() const;
  /// Looks at these, of parallel beam all that require() needs: what is found, six numbers a brick, holds
  /// wherever it was found.
  void look_at(std::span<const Block> blocks, const Progress& progress);
  [[nodiscard]] std::vector<float> found(const Block& block) const;
  void take(const Block& block, std::span<const float> found);

  /// Of cells of gold on `lattice` in a brick that was required.
  [[nodiscard]] float of(std::int64_t brick, const GoldLattice& lattice) const;
  /// The largest part of it that sixth derivatives make, on bricks of three layers of cone beam: the lowest
  /// and the highest that are tested, and one between. Cost: a sum over all views for some bricks together.
  [[nodiscard]] double largest_of_sixth(const GoldLattice& lattice);

 private:
  using Maxima = std::array<float, 6>;  // xx, yy, zz, xy, xz, yz
  /// Half a step of gold's, at 2x or finer, in nodes: how far from the brick X has to hold.
  [[nodiscard]] std::int64_t step_of_gold(std::size_t axis) const {
    return std::max<std::int64_t>(1, rates_[axis] / 2);
  }
  [[nodiscard]] std::array<int, 3> phases(int differences) const;
  void set_parallel(const FilteredScan& scan, const FieldSups& sups);
  void set_cone();
  void add_sixth(const std::vector<std::uint8_t>& selected);
  [[nodiscard]] std::pair<int, int> heights_read(const GoldBox& box) const;
  [[nodiscard]] Maxima addends_of(const Index3& first, const Index3& bricks) const;
  [[nodiscard]] std::size_t slot(const Index3& position) const;
  [[nodiscard]] GoldBox box_of(const Index3& first, const Index3& bricks) const;
  [[nodiscard]] std::vector<GoldBox> boxes(std::span<const Block> blocks) const;
  [[nodiscard]] static std::uint64_t room_for(const GoldBox& box);
  [[nodiscard]] opencl::DeviceArray<float> launch(const Block& block, opencl::DeviceArray<float>& gold);
  template <class Sup>
  [[nodiscard]] double sum_of(const GoldLattice& lattice, Sup&& sup) const;
  template <class Visit>
  void for_each_block(Visit&& visit) const;
  template <class Visit>
  void for_each_slot(const Block& block, Visit&& visit) const;

  opencl::State& state_;
  KeptGold& kept_;
  const FilteredScan& scan_;
  const FieldSups& sups_;
  Coverage coverage_;
  Grid grid_;
  int granularity_;
  GoldLattice nodes_;                    // at which differences are taken
  Index3 rates_{};                       // nodes to a cell
  Index3 bricks_{}, rings_{};            // of the grid, and of bricks around it
  Index3 stencil_{};                     // nodes around the brick that X looks at
  std::vector<Maxima> maxima_;           // with the rings
  std::vector<std::uint8_t> looked_at_;  // alike
  Maxima factor_{}, addend_{};           // of a difference, by which X is bounded
  std::vector<Maxima> sixth_;            // what sixth derivatives add by brick; of cone beam alone
  std::vector<std::uint8_t> has_sixth_;
  std::array<double, 6> slack_{};  // what differences of computed gold err
  double lowest_ = 0, lowest_z_ = 0;
  // Of cone beam, what the stencils of tested cells read.
  std::optional<RegionOutline> read_;
  std::pair<double, double> read_z_{};
};

}  // namespace vdvr
