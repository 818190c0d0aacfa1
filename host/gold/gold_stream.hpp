// Gold, block by block: F on the grid refined by the gold rate, with the node slack T + P beside it, never
// whole in memory (docs/error-bounds.md). Called by plan.cpp, foresee.cpp, classify_bricks.cpp, build.cpp and
// measure_tightness.cpp.
//
// A slab is a run of base cells in z whose filtered rows are on the device; blocks are columns of base cells
// inside it. A full pass uses large blocks, a repair or a sampled verification blocks of one brick; the code
// is the same.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/bounds/projection_bounds.hpp"
#include "host/fbp/back_project.hpp"
#include "host/fbp/coverage.hpp"
#include "host/gold/cell_bounds.hpp"
#include "host/gold/fit_coefficients.hpp"
#include "host/gold/gold_settings.hpp"
#include "host/gold/node_slack.hpp"
#include "host/gold/search_triples.hpp"
#include "host/opencl/kernel.hpp"
#include "host/sampler/device_field.hpp"
#include "shared/gold_shape.h"
#include "shared/untested.h"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/progress.hpp"

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
  float total = -1;  ///< largest that |V - F| may be, from V - gold and the slack; negative: no tested node
  float error = 0;   ///< largest |V - gold|
  float slack = 0;   ///< largest T + P to either side: what even gold may err
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

/// Upsampled rows over all slabs, and gold samples over all blocks, halos included.
struct GoldWork {
  double rows = 0, samples = 0;
};
struct GoldSpent {
  GoldWork work;
  double slab_seconds = 0, table_seconds = 0, block_seconds = 0;
  GoldSpent& operator-=(const GoldSpent& earlier) {
    work.rows -= earlier.work.rows;
    work.samples -= earlier.work.samples;
    slab_seconds -= earlier.slab_seconds;
    table_seconds -= earlier.table_seconds;
    block_seconds -= earlier.block_seconds;
    return *this;
  }
};

class GoldStream {
 public:
  /// `cells`: bounds of base cells that another stream of the same grid and rates in u has, of gold finer or
  /// coarser (settings.coarse_rate); none: its own.
  GoldStream(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler, const FieldSups& sups,
             const GoldSettings& settings, std::shared_ptr<CellBounds> cells = nullptr);
  ~GoldStream();

  /// The blocks of one batch on the device, as handed to the callback.
  class Batch;
  using OnBatch = std::function<void(Batch&)>;

  /// Every brick of the grid (or those selected), in large blocks, slab by slab. `selected` is by brick; a
  /// block without a selected brick is skipped, and one with few is cut to smaller ones around them. Fitted
  /// samples look further around a block than measuring does.
  enum class For { samples, measuring };
  void run(const std::vector<std::uint8_t>& selected, const OnBatch& on_batch, const Progress& progress,
           const std::string& stage, For purpose = For::measuring);

  /// A run of brick layers whose rows are upsampled together.
  struct Slab {
    std::int64_t z = 0, height = 0;  ///< bricks
    bool operator==(const Slab&) const = default;
  };
  /// Equal blocks in one slab, by their first bricks.
  struct Work {
    std::int64_t z, height, width_x, width_y;  ///< bricks
    std::vector<std::array<std::int64_t, 2>> first;
    Slab slab;
    [[nodiscard]] Index3 size() const { return {width_x, width_y, height}; }
  };
  /// How many blocks of a work, from the given one on, somebody has the results of already.
  using Known = std::function<std::size_t(const Work&, std::size_t)>;
  /// The same without the blocks that are known.
  void run_unknown(const std::vector<std::uint8_t>& selected, const OnBatch& on_batch, const Known& known,
                   const Progress& progress, const std::string& stage, For purpose);
  [[nodiscard]] SlabShape slab_of(const Work& work) const;

  /// Bricks that may hold a tested node; the others need not be streamed.
  [[nodiscard]] std::vector<std::uint8_t> bricks_near_coverage() const;

  /// fp32 error bound of any gold sample.
  [[nodiscard]] double arithmetic() const { return arithmetic_; }
  /// The part of every slack that is due to rounding: what second differences of rounded gold may hide.
  [[nodiscard]] double rounding_in_slack() const { return node_slack_ ? node_slack_->rounding() : 0; }
  [[nodiscard]] const std::shared_ptr<CellBounds>& cells() const { return cells_; }
  [[nodiscard]] const GoldSettings& settings() const { return settings_; }
  /// Bricks of a large block, x, y, z.
  [[nodiscard]] Index3 block_bricks() const { return {block_bricks_, block_bricks_, slab_bricks_}; }
  /// What `run` would compute for these bricks.
  [[nodiscard]] GoldWork work(const std::vector<std::uint8_t>& selected, For purpose);
  /// What it has computed so far for a purpose, and what that took.
  [[nodiscard]] const GoldSpent& spent(For purpose) const {
    return spent_[static_cast<std::size_t>(purpose)];
  }
  [[nodiscard]] std::uint64_t slab_bytes(std::int64_t cells_z) const;

 private:
  [[nodiscard]] std::vector<Work> partition(const std::vector<std::uint8_t>& selected) const;
  [[nodiscard]] std::vector<float> margins(const ColumnBlocks& columns) const;
  [[nodiscard]] std::vector<std::array<std::int32_t, 2>> wanted(const std::vector<float>& margins,
                                                                std::int64_t nx, std::int64_t ny) const;
  std::int64_t begin_batch(Batch& batch, const Work& work, const SlabShape& slab);
  [[nodiscard]] double samples(std::int64_t width_x, std::int64_t width_y, std::int64_t height) const;
  [[nodiscard]] std::int64_t padded_rows(std::int64_t height) const;
  [[nodiscard]] double kept_share(const Work& work, const std::array<std::int64_t, 2>& first) const;
  void begin(For purpose);
  void upsample(const Slab& slab);
  void run_blocks(const Work& work, std::size_t from, const std::vector<std::uint8_t>& selected,
                  const OnBatch& on_batch, const std::function<void(double)>& tick);

  opencl::State& state_;
  const FilteredScan& scan_;
  Upsampler& upsampler_;
  GoldSettings settings_;
  Coverage coverage_;
  UpsampledColumns columns_;
  std::int64_t slab_bricks_ = 1, block_bricks_ = 1;
  std::int64_t fit_halo_ = 1, halo_ = 1;  // gold nodes around a block: for samples, and in this run
  Slab upsampled_;                        // what projections_ holds, in a run
  UpsampledSlab projections_;
  For purpose_ = For::measuring;    // of this run
  std::array<GoldSpent, 2> spent_;  // by purpose
  double arithmetic_ = 0;
  std::shared_ptr<CellBounds> cells_;
  std::optional<NodeSlack> node_slack_;  // none: no bounds wanted
};

/// Base samples fitted to the trilinear filter where they are kept; elsewhere `base` stays. Gold at 2x their
/// own rate serves: the error between base samples peaks near the middles of edges, faces and cells, and a
/// fit to those alone stored less than one to denser gold. Cost: a fiftieth of a pass of gold at 8x.
void fit_base_samples(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler,
                      const FieldSups& sups, GoldSettings settings, std::vector<float>& base,
                      const Progress& progress);

class GoldStream::Batch {
 public:
  /// Bricks of the batch that lie in the grid and are selected.
  [[nodiscard]] const std::vector<std::int64_t>& bricks() const { return bricks_; }
  /// The first brick of each block, x, y, z, and bricks per block.
  [[nodiscard]] const std::vector<std::array<std::int64_t, 3>>& first_brick() const { return first_brick_; }
  [[nodiscard]] Index3 block_bricks() const { return {bricks_x_, bricks_y_, bricks_z_}; }
  [[nodiscard]] const SlabShape& slab() const { return slab_; }

  /// In a run for samples: the node test at levels 0 .. log2(rate), of all axes together or (anisotropic) of
  /// each, per brick of bricks(): |interpolant - F| may be at most the tolerance. Level 0 is measured on the
  /// stored base samples through the sampler: closing never changes those, so it is final. Bricks that no
  /// level suits get gold itself, with `gold_too`.
  std::vector<BrickClass> classify(const DeviceField& base, float tolerance,
                                   const opencl::DeviceArray<std::uint8_t>& selected, bool gold_too);

  /// What linear interpolation along single axes errs by in these bricks.
  std::vector<AxisErrors> axis_errors(const std::vector<std::int64_t>& bricks);

  /// Writes the fitted base samples of the blocks into `base` [z][y][x] of the whole grid, where they may be
  /// kept.
  void fit_base(std::vector<float>& base);

  /// The largest |gold| at a covered node of the blocks.
  float largest_value() const;

  /// Per brick of bricks(): the largest and the smallest P of its base cells.
  std::vector<std::pair<float, float>> largest_p();

  /// Calls visit(node index x, y, z in the brick, gold, Slack) for every node of one closed brick; reads the
  /// block back.
  template <class Visit>
  void for_each_node(std::int64_t brick, Visit&& visit) const {
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

  /// Measures a stored field on every selected brick.
  std::vector<BrickMeasure> measure(const DeviceField& field, float tolerance,
                                    const opencl::DeviceArray<std::uint8_t>& selected);

 private:
  friend class GoldStream;
  struct Results;
  struct TileRequest;
  struct Candidate;
  [[nodiscard]] TileRequest request(std::int64_t brick, const Index3& spacing, std::uint64_t offset) const;
  void try_levels(std::vector<Candidate>& candidates, const TripleSearch& search, float tolerance);
  std::vector<float> errors_at(const LevelTriple& level, const std::vector<std::int64_t>& bricks);
  std::vector<float> copy_tiles(const LevelTriple& level, const std::vector<std::int64_t>& bricks,
                                const LevelSamples* lattice);
  [[nodiscard]] opencl::Defines brick_nodes() const;
  [[nodiscard]] VdvrGoldShape shape_on_device() const;
  Results run_measure(const DeviceField& field, float tolerance,
                      const opencl::DeviceArray<std::uint8_t>& selected);
  Batch(opencl::State& state, const GoldSettings& settings)
      : state_(state), settings_(settings), fit_(state, shape_) {}
  void choose(std::vector<std::array<std::int64_t, 2>> first, std::int64_t first_z,
              const std::vector<std::uint8_t>& selected);
  [[nodiscard]] std::array<std::int64_t, 4> place(std::int64_t brick) const;  // block, then x, y, z inside it
  [[nodiscard]] std::uint64_t blocks() const { return first_brick_.size(); }
  /// Samples of a level on these bricks; valid until the next call.
  const LevelSamples& lattice(const LevelTriple& level, const std::vector<std::int64_t>& bricks);
  [[nodiscard]] Index3 spacing_of(const LevelTriple& level) const;
  /// Place in arrays per brick of the blocks, [block][z][y][x].
  [[nodiscard]] std::size_t slot(std::int64_t brick) const;
  [[nodiscard]] std::vector<std::uint8_t> flags(const std::vector<std::int64_t>& bricks) const;

  opencl::State& state_;
  const GoldSettings& settings_;
  std::int64_t bricks_x_ = 0, bricks_y_ = 0, bricks_z_ = 0;  // per block
  GoldBlocks shape_;
  SlabShape slab_;
  std::int64_t stride_ = 0;     // of the slack's columns
  std::vector<float> margins_;  // what margin_ holds
  LatticeFit fit_;
  std::vector<std::array<std::int64_t, 3>> first_brick_;
  std::vector<std::int64_t> bricks_;
  std::map<std::int64_t, std::array<std::int64_t, 4>> place_;
  opencl::DeviceArray<float> gold_, above_, below_, margin_, p_;
};

}  // namespace vdvr
