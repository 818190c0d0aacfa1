// Tiles fitted to the trilinear filter, brick by brick and each at a level of its own, and tested against
// gold (docs/error-bounds.md, sections 13 and 15).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "shared/gold_shape.h"
#include "shared/lattice_shape.h"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// Samples of finer levels than the base's hardly gain after two steps.
constexpr int level_fit_steps = 2;
/// What a step takes of the middle of the errors around a sample (docs/error-bounds.md, section 13): of a
/// smooth field little, since neighbours of other levels, whose samples do not move with a brick's, agree
/// less; where bricks have tolerances of their own, which are those of noise, more than all.
constexpr float smooth_fit_share = 0.8f, noise_fit_share = 1.2f;

/// How tiles are fitted.
struct FitSteps {
  int count = level_fit_steps;     ///< 0: gold at the nodes
  float share = smooth_fit_share;  ///< of the middle of the errors
  float curvature = 0;             ///< as BaseFit's
};

/// Blocks of gold with their slack, on the device: layouts as in kernels/certify/gold/node_slack.cl.
struct TestedGold {
  const opencl::DeviceArray<float>&gold, &margin;
  const opencl::DeviceArray<float>&above, &below;  ///< of what is not to be tested: anything
  VdvrGoldShape shape{};
  std::int64_t z_first = 0, z_last = 0;  ///< tested nodes along z
};

/// A brick of a block by its first node, and nodes from sample to sample: powers of two.
struct TileToFit {
  std::int64_t block = 0;
  Index3 node{}, spacing{};
};

class TileFit {
 public:
  explicit TileFit(opencl::State& state) : state_(state) {}

  /// Samples of these tiles. `side`: nodes of a brick, less one. With `tested`, returns the largest that
  /// |interpolant - F| may be at the nodes of each brick, negative where none is tested. Samples stay until
  /// the next call. One launch. Cost: a step has 27 evaluations of the interpolant per sample of the brick
  /// and around it, the test one a node.
  std::vector<float> operator()(const TestedGold& gold, std::span<const TileToFit> tiles, std::int64_t side,
                                const FitSteps& steps, bool tested);

  /// How many of these tiles, from the first on, fit into so many floats: one at least.
  [[nodiscard]] static std::size_t together(const TestedGold& gold, std::span<const TileToFit> tiles,
                                            std::int64_t side, int steps, std::uint64_t floats);

  /// Of tile i of the last call: its first sample in samples(), and floats from one to the next.
  struct Place {
    std::uint64_t first = 0;
    Index3 step{};
  };
  [[nodiscard]] Place place(std::size_t i) const;
  [[nodiscard]] const opencl::DeviceArray<float>& samples() const { return room_; }

 private:
  opencl::State& state_;
  std::vector<VdvrTileFit> tiles_;
  int steps_ = 0;
  opencl::DeviceArray<float> room_;
};

}  // namespace vdvr
