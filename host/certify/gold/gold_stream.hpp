// Gold, block by block: F on the grid refined by the gold rate, with the node slack T + P beside it, never
// whole in memory (docs/error-bounds.md).
//
// A slab is a run of base cells in z whose filtered rows are on the device; blocks are columns of base cells
// inside it. A full pass uses large blocks, a repair or a sampled verification blocks of one brick; the code
// is the same.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/base/opencl/kernel.hpp"
#include "host/base/system/parallel.hpp"
#include "host/certify/bounds/projection_bounds.hpp"
#include "host/certify/gold/gold_settings.hpp"
#include "host/certify/gold/gold_source.hpp"
#include "host/certify/gold/node_slack.hpp"
#include "host/certify/gold/search_triples.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/volume/sampler/device_field.hpp"
#include "shared/gold_shape.h"
#include "shared/untested.h"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// Bricks of `g` cells a side that may hold a tested node: their middles lie that near to the coverage.
std::vector<std::uint8_t> bricks_near(const Coverage& coverage, const Grid& grid, std::int64_t g);

/// Gold samples over all blocks, halos included, and the seconds that these took.
struct GoldSpent {
  double samples = 0, seconds = 0;
  GoldSpent& operator-=(const GoldSpent& earlier) {
    samples -= earlier.samples;
    seconds -= earlier.seconds;
    return *this;
  }
};

class GoldBatch;  // gold_batch.hpp

class GoldStream {
 public:
  /// `source`: of another stream of the same scan, grid and interpolation in u; none: its own.
  GoldStream(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
             const GoldSettings& settings, std::shared_ptr<GoldSource> source = nullptr);
  ~GoldStream();

  /// The blocks of one batch on the device, as handed to the callback.
  using Batch = GoldBatch;
  using OnBatch = std::function<void(Batch&)>;
  /// Computes something of a batch in a thread of its own, others beside it, so that the device need not wait
  /// for the host. What it returns the caller's thread calls, in the order of the blocks.
  using Compute = std::function<Take(Batch&)>;

  /// Every brick of the grid (or those selected), in large blocks, slab by slab. `selected` is by brick; a
  /// block without a selected brick is skipped, and one with few is cut to smaller ones around them. Fitted
  /// samples look further around a block than measuring does. Proposing fits samples too, and foresees what
  /// gold at `finer_rate` would find: second differences fall with the square of the spacing.
  enum class For { samples, measuring, proposing };
  void run(const std::vector<std::uint8_t>& selected, const OnBatch& on_batch, const Progress& progress,
           const std::string& stage, For purpose = For::measuring);

  /// Equal blocks of the same heights, by their first bricks.
  struct Work {
    std::int64_t z, height, width_x, width_y;  ///< bricks
    std::vector<std::array<std::int64_t, 2>> first;
    [[nodiscard]] Index3 size() const { return {width_x, width_y, height}; }
  };
  /// The blocks that `run` computes for these bricks, in its order.
  [[nodiscard]] std::vector<Work> works(const std::vector<std::uint8_t>& selected, For purpose);
  /// Some of them, `selected` and `purpose` as there: a block is the same whoever else is computed.
  void run_works(std::span<const Work> works, const std::vector<std::uint8_t>& selected,
                 const Compute& compute, const Progress& progress, const std::string& stage, For purpose);
  void run_in_strands(const std::vector<std::uint8_t>& selected, const Compute& compute,
                      const Progress& progress, const std::string& stage, For purpose = For::measuring) {
    run_works(works(selected, purpose), selected, compute, progress, stage, purpose);
  }
  /// Samples of all blocks of a work of works(), which was called last.
  [[nodiscard]] double cost(const Work& work) const;
  [[nodiscard]] SlabShape slab_of(const Work& work) const;
  /// Those of `selected` that lie in these blocks.
  [[nodiscard]] std::vector<std::uint8_t> bricks_of(std::span<const Work> works,
                                                    const std::vector<std::uint8_t>& selected) const;

  /// Bricks that may hold a tested node; the others need not be streamed.
  [[nodiscard]] std::vector<std::uint8_t> bricks_near_coverage() const;

  /// fp32 error bound of any gold sample, the filter's included.
  [[nodiscard]] double arithmetic() const { return errors_.rounding + errors_.ramp; }
  /// P: how far a gold sample lies from the field of the computed filtered samples but for rounding; also
  /// where slack does not count.
  [[nodiscard]] double projection() const { return errors_.interpolation; }
  /// What interpolation adds to every slack.
  [[nodiscard]] double projection_in_slack() const {
    return settings_.grid_only ? 0 : errors_.interpolation + errors_.curved_interpolation;
  }
  /// The part of every slack that is due to rounding: what second differences of rounded gold may hide.
  [[nodiscard]] double rounding_in_slack() const { return settings_.grid_only ? 0 : errors_.curved_rounding; }
  [[nodiscard]] const std::shared_ptr<GoldSource>& source() const { return source_; }
  [[nodiscard]] const GoldSettings& settings() const { return settings_; }
  [[nodiscard]] opencl::State& state() const { return state_; }
  /// Bricks of a large block, x, y, z.
  [[nodiscard]] Index3 block_bricks() const { return {block_bricks_, block_bricks_, slab_bricks_}; }
  /// Keeps what `run` would need to keep for these bricks.
  void prepare(const std::vector<std::uint8_t>& selected, For purpose, const Progress& progress);
  /// KeptGold::will_read of what measuring these bricks reads.
  void will_measure(const std::vector<std::uint8_t>& selected);
  /// Samples that `run` would compute for these bricks, and tiles of kept gold that it would add.
  [[nodiscard]] double samples(const std::vector<std::uint8_t>& selected, For purpose);
  [[nodiscard]] std::int64_t missing_tiles(const std::vector<std::uint8_t>& selected, For purpose);
  /// What it has computed so far for a purpose, and what that took.
  [[nodiscard]] const GoldSpent& spent(For purpose) const {
    return spent_[static_cast<std::size_t>(purpose)];
  }

 private:
  struct Finer {
    GoldLattice lattice;
    GoldErrors errors;
    float of_curvature = 1;  // its second differences over these
  };
  [[nodiscard]] std::vector<Work> partition(const std::vector<std::uint8_t>& selected) const;
  [[nodiscard]] std::vector<float> margins(const std::vector<std::array<std::int64_t, 3>>& first_brick,
                                           std::int64_t nx, std::int64_t ny) const;
  [[nodiscard]] std::vector<std::array<std::int32_t, 2>> wanted(const std::vector<float>& margins,
                                                                std::int64_t nx, std::int64_t ny) const;
  // Blocks of a work that go together.
  struct Part {
    const Work* work = nullptr;
    std::size_t first = 0, blocks = 0;
  };
  [[nodiscard]] std::int64_t blocks_together(const Work& work) const;
  static void add_parts(std::vector<Part>& parts, const Work& work, std::size_t most);
  void begin_batch(Batch& batch, const Work& work) const;
  void require_room(Batch& batch, std::int64_t blocks) const;
  [[nodiscard]] double samples(std::int64_t width_x, std::int64_t width_y, std::int64_t height) const;
  [[nodiscard]] GoldBox box(const Work& work, const std::array<std::int64_t, 2>& first) const;
  [[nodiscard]] std::vector<GoldBox> boxes(std::span<const Work> works) const;
  [[nodiscard]] double kept_share(const Work& work, const std::array<std::int64_t, 2>& first) const;
  void begin(For purpose);
  void run_parts(std::span<const Work> works, const std::vector<std::uint8_t>& selected, bool in_strands_too,
                 const Compute& compute, const Progress& progress, const std::string& stage);
  void take_addends(Batch& batch) const;
  void fill(Batch& batch, const Part& part, const std::vector<std::uint8_t>& selected, std::mutex& filling);

  opencl::State& state_;
  GoldSettings settings_;
  Coverage coverage_;
  GoldLattice lattice_;
  GoldErrors errors_;
  std::optional<Finer> finer_;  // that measures what this one proposes
  std::int64_t slab_bricks_ = 1, block_bricks_ = 1;
  std::int64_t fit_halo_ = 1, halo_ = 1;  // gold nodes around a block: for samples, and in this run
  For purpose_ = For::measuring;          // of this run
  std::array<GoldSpent, 3> spent_;        // by purpose
  std::shared_ptr<GoldSource> source_;
};

/// Of the gold that base samples are fitted to, of a build with these settings.
GoldSettings fitting_settings(GoldSettings settings);
/// Which bricks of its grid hold base samples that `selected` bricks of the build's read.
std::vector<std::uint8_t> bricks_to_fit(const GoldStream& fitting, const GoldSettings& settings,
                                        const std::vector<std::uint8_t>& selected);
/// Base samples fitted to the trilinear filter where they are kept and these bricks read them; elsewhere
/// `base` stays. Gold at 2x their own rate serves: the error between base samples peaks near the middles of
/// edges, faces and cells, and a fit to those alone stored less than one to denser gold. Cost: a fiftieth of
/// a pass of gold at 8x.
void fit_base_samples(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                      const GoldSettings& settings, const std::vector<std::uint8_t>& selected,
                      std::vector<float>& base, const Progress& progress,
                      std::shared_ptr<GoldSource> source = nullptr);

}  // namespace vdvr
