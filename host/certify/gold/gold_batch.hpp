// One batch of blocks of gold on the device: what can be read from it, measured on it and made of it. Handed
// out by gold_stream.cpp; used by what streams gold.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "host/certify/gold/cell_test.hpp"
#include "host/certify/gold/fit_base.hpp"
#include "host/certify/gold/fit_tiles.hpp"
#include "host/certify/gold/gold_stream.hpp"
#include "host/certify/gold/node_tolerance.hpp"

namespace vdvr {

/// How far F may lie above and below gold's interpolant in the gold cells around a node: T + P to either
/// side.
struct Slack {
  float above = VDVR_UNTESTED, below = VDVR_UNTESTED;
  [[nodiscard]] bool tested() const { return above != VDVR_UNTESTED; }
  /// The most that |V - F| may be around a node where V - gold is `difference`.
  [[nodiscard]] float total(float difference) const {
    return std::max(difference + below, above - difference);
  }
};

/// What one brick measured against gold.
struct BrickMeasure {
  std::int64_t brick = 0;
  float total = -1;   ///< largest that |V - F| may be, from V - gold and the slack; negative: no tested node
  float error = 0;    ///< largest |V - gold|
  float slack = 0;    ///< largest T + P to either side: what even gold may err
  float passed = -1;  ///< largest total of a cell that is within the tolerance
  CellBox open{};     ///< holds the other cells
  std::uint32_t violated =
      0;         ///< one bit per part of the closed brick: 9 z + 3 y + x, 0 low, 1 inside, 2 high
  int rate = 0;  ///< of the gold
};

/// Result of the node test of one brick.
struct BrickClass {
  BrickMeasure base;          ///< the base samples, as stored, measured on it
  LevelTriple level{};        ///< the cheapest found that passes; the gold rate where only gold itself does
  bool passes = false;        ///< by the node test; gold itself is not tested
  AxisErrors along{};         ///< of a brick that the base does not suit
  std::vector<float> tile{};  ///< of a level above 0: its samples [z][y][x], before closing
};

class GoldBatch {
 public:
  ~GoldBatch();  // waits for what is enqueued: gold is of another queue
  GoldBatch(const GoldBatch&) = delete;
  GoldBatch& operator=(const GoldBatch&) = delete;

  /// Bricks of the batch that lie in the grid and are selected.
  [[nodiscard]] const std::vector<std::int64_t>& bricks() const { return bricks_; }
  /// The first brick of each block, x, y, z, and bricks per block.
  [[nodiscard]] const std::vector<std::array<std::int64_t, 3>>& first_brick() const { return first_brick_; }
  [[nodiscard]] Index3 block_bricks() const { return {bricks_x_, bricks_y_, bricks_z_}; }
  [[nodiscard]] const SlabShape& slab() const { return slab_; }
  /// In a run for proposing, T is that which GoldSettings::finer_rate would find: no bound.
  [[nodiscard]] bool proposing() const { return of_curvature_ < 1; }

  /// In a run for samples: the node test at levels 0 .. log2(rate), of all axes together or (anisotropic) of
  /// each, per brick of bricks(): |interpolant - F| may be at most the tolerance. Level 0 is measured on the
  /// stored base samples through the sampler: closing never changes those, so it is final. Bricks that no
  /// level suits get gold itself, with `gold_too`.
  std::vector<BrickClass> classify(const DeviceField& base, const NodeTolerance& tolerance,
                                   const opencl::DeviceArray<std::uint8_t>& selected, bool gold_too);

  /// What linear interpolation along single axes errs by in these bricks.
  std::vector<AxisErrors> axis_errors(const std::vector<std::int64_t>& bricks);

  /// Calls put(index, sample) for the fitted base samples of the blocks, where they may be kept: the index is
  /// that of [z][y][x] of the whole grid. Some come twice, the last one counts.
  void fit_base(const std::function<void(std::size_t, float)>& put);

  /// The largest |gold| at a covered node of the blocks.
  float largest_value() const;

  /// Calls visit(node index x, y, z in the brick, gold, Slack) for every node of one closed brick; reads the
  /// block back.
  template <class Visit>
  void for_each_node(std::int64_t brick, Visit&& visit) {
    require_slack();
    const auto [b, x, y, z] = place(brick);
    const std::vector<float> gold = gold_.to_host(), above = above_.to_host(), below = below_.to_host();
    const std::int64_t side = std::int64_t{settings_.granularity} * settings_.rate, h = shape_.halo;
    for (std::int64_t k = 0; k <= side && z * side + k < shape_.nz; ++k)
      for (std::int64_t j = 0; j <= side; ++j)
        for (std::int64_t i = 0; i <= side; ++i) {
          const std::int64_t nx = x * side + i, ny = y * side + j, nz = z * side + k;
          const std::int64_t column = (b * (shape_.ny + 2 * h) + ny + h) * (shape_.nx + 2 * h) + nx + h;
          const auto at = static_cast<std::size_t>(((b * shape_.ny + ny) * shape_.nx + nx) * stride_ + nz);
          visit(Index3{i, j, k}, gold[static_cast<std::size_t>(column * shape_.gold_stride + nz + h)],
                Slack{above[at], below[at]});
        }
  }

  /// In a run for samples: samples of tiles of bricks of the batch, in the order asked, concatenated: float
  /// [z][y][x] each. They are gold at the top level, fitted below it if the settings say so.
  std::vector<float> extract(const std::vector<std::pair<std::int64_t, LevelTriple>>& tiles);

  /// Measures a stored field on every selected brick. `parts`: also which parts of it violate the tolerance,
  /// at the cost of that brick once more. `cells`: by brick of the grid those to test; none: all.
  std::vector<BrickMeasure> measure(const DeviceField& field, const NodeTolerance& tolerance,
                                    const opencl::DeviceArray<std::uint8_t>& selected, bool parts = false,
                                    std::span<const CellBox> cells = {});

 private:
  friend class GoldStream;
  struct TileRequest;
  struct Candidate;
  [[nodiscard]] TileRequest request(std::int64_t brick, const Index3& spacing, const TileFit::Place& place,
                                    std::uint64_t offset) const;
  void try_levels(std::vector<Candidate> open, const TripleSearch& search, const NodeTolerance& tolerances);
  using Tiles = std::span<const std::pair<std::int64_t, LevelTriple>>;
  /// Of tiles that are fitted together, whose samples tile_fit_ then has: the first, how many, and what the
  /// node test finds if asked.
  using OnFitted = std::function<void(std::size_t, std::size_t, const std::vector<float>&)>;
  void fit_tiles(Tiles tiles, bool tested, const OnFitted& visit);
  void take_passed(Tiles tiles, const std::vector<float>& errors, std::span<Candidate> candidates,
                   const TripleSearch& search, const NodeTolerance& tolerances,
                   std::vector<Candidate>& failed);
  std::vector<std::vector<float>> tiles_of_gold(Tiles tiles);
  std::vector<std::vector<float>> copy_tiles(Tiles tiles, const std::vector<TileFit::Place>& places,
                                             const opencl::DeviceArray<float>& samples);
  [[nodiscard]] opencl::Defines brick_nodes() const;
  [[nodiscard]] VdvrGoldShape shape_on_device() const;
  void take_addends(const std::vector<float>& addends, const GoldErrors& errors, float of_curvature);
  // Slack node by node, made when first asked for.
  void require_slack();
  GoldBatch(opencl::State& state, const GoldSettings& settings)
      : state_(state), settings_(settings), base_fit_(state, shape_), tile_fit_(state) {}
  void choose(std::vector<std::array<std::int64_t, 2>> first, std::int64_t first_z,
              const std::vector<std::uint8_t>& selected);
  [[nodiscard]] std::array<std::int64_t, 4> place(std::int64_t brick) const;  // block, then x, y, z inside it
  [[nodiscard]] std::uint64_t blocks() const { return first_brick_.size(); }
  [[nodiscard]] std::int64_t side() const { return std::int64_t{settings_.granularity} * settings_.rate; }
  [[nodiscard]] Index3 spacing_of(const LevelTriple& level) const;
  /// Place in arrays per brick of the blocks, [block][z][y][x].
  [[nodiscard]] std::size_t slot(std::int64_t brick) const;
  /// Nodes of a column that a work-item does, of kernels launched so.
  [[nodiscard]] cl_int nodes_each() const;
  [[nodiscard]] opencl::Range columns_of_bricks(std::uint64_t bricks) const;
  [[nodiscard]] opencl::DeviceArray<cl_int4> places(const std::vector<std::int64_t>& bricks) const;

  opencl::State& state_;  // a strand's, but of gold_
  const GoldSettings& settings_;
  std::int64_t bricks_x_ = 0, bricks_y_ = 0, bricks_z_ = 0;  // per block
  GoldBlocks shape_;
  SlabShape slab_;
  std::int64_t stride_ = 0;     // of the slack's columns
  std::vector<float> margins_;  // what margin_ holds
  BaseFit base_fit_;
  TileFit tile_fit_;
  std::vector<std::array<std::int64_t, 3>> first_brick_;
  std::vector<std::int64_t> bricks_;
  std::map<std::int64_t, std::array<std::int64_t, 4>> place_;
  GoldErrors errors_;
  float of_curvature_ = 1;  // of T and of the middle that samples are fitted to
  bool has_slack_ = false;
  opencl::DeviceArray<float> gold_, above_, below_, margin_, addend_;
};

}  // namespace vdvr
