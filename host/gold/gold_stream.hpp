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

class GoldBatch;  // gold_batch.hpp

class GoldStream {
 public:
  /// `cells`: bounds of base cells that another stream of the same grid and rates in u has, of gold finer or
  /// coarser (settings.coarse_rate); none: its own.
  GoldStream(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler, const FieldSups& sups,
             const GoldSettings& settings, std::shared_ptr<CellBounds> cells = nullptr);
  ~GoldStream();

  /// The blocks of one batch on the device, as handed to the callback.
  using Batch = GoldBatch;
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

}  // namespace vdvr
