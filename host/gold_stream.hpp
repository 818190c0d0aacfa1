// Gold, block by block: F on the grid refined by the gold rate, with the node slack T + P beside it, never
// whole in memory (docs/error-bounds.md). Called by plan.cpp, build.cpp and verify.cpp.
//
// A slab is a run of base cells in z whose filtered rows are on the device; blocks are columns of base cells
// inside it. A full pass uses large blocks, a repair or a sampled verification blocks of one brick; the code
// is the same.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/back_project.hpp"
#include "host/coverage.hpp"
#include "host/device_field.hpp"
#include "host/bound_table.hpp"
#include "host/projection_bounds.hpp"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/progress.hpp"

namespace vdvr {

struct GoldSettings {
  Grid grid;
  int granularity = 4;
  int rate = 8;
  int upsampling = 8;
  std::string u_filter = "linear";
  std::optional<std::pair<double, double>> window;
};

/// What one brick measured against gold.
struct BrickMeasure {
  std::int64_t brick = 0;
  float total = -1;  ///< largest |V - gold| + T + P; negative: no tested node
  float error = 0;   ///< largest |V - gold|
  float slack = 0;   ///< largest T + P: what even gold may err
  std::uint32_t violated =
      0;  ///< one bit per part of the closed brick: 9 z + 3 y + x, 0 low, 1 inside, 2 high
};

/// Result of the node test of one brick.
struct BrickClass {
  BrickMeasure base;  ///< the base samples, as stored, measured on it
  int level = 0;      ///< the lowest that passes; the top where only gold itself does
};

/// Upsampled rows over all slabs, and gold samples over all blocks, halos included.
struct GoldWork {
  double rows = 0, samples = 0;
};
struct GoldSpent {
  GoldWork work;
  double slab_seconds = 0, table_seconds = 0, block_seconds = 0;
};

class GoldStream {
 public:
  GoldStream(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler, const FieldSups& sups,
             const GoldSettings& settings);
  ~GoldStream();

  /// The blocks of one batch on the device, as handed to the callback.
  class Batch;
  using OnBatch = std::function<void(Batch&)>;

  /// Every brick of the grid (or those selected), in large blocks, slab by slab. `selected` is by brick; a
  /// block without a selected brick is skipped, and a few selected bricks are streamed as blocks of one
  /// brick.
  void run(const std::vector<std::uint8_t>& selected, const OnBatch& on_batch, const Progress& progress,
           const std::string& stage);

  /// Bricks that may hold a tested node; the others need not be streamed.
  [[nodiscard]] std::vector<std::uint8_t> bricks_near_coverage() const;

  /// fp32 error bound of any gold sample.
  [[nodiscard]] double arithmetic() const { return arithmetic_; }
  /// The part of every slack that is due to rounding: what second differences of rounded gold may hide.
  [[nodiscard]] double rounding_in_slack() const { return 1.5 * rounding_; }
  [[nodiscard]] const GoldSettings& settings() const { return settings_; }
  /// Bricks of a large block, x, y, z.
  [[nodiscard]] Index3 block_bricks() const { return {block_bricks_, block_bricks_, slab_bricks_}; }
  /// What `run` would compute for these bricks.
  [[nodiscard]] GoldWork work(const std::vector<std::uint8_t>& selected) const;
  /// What it has computed so far, and what that took.
  [[nodiscard]] const GoldSpent& spent() const { return spent_; }
  [[nodiscard]] std::uint64_t slab_bytes(std::int64_t cells_z) const;

 private:
  // Equal blocks of one slab, by their first bricks.
  struct Work {
    std::int64_t z, height, width_x, width_y;  // bricks
    std::vector<std::array<std::int64_t, 2>> first;
  };
  [[nodiscard]] std::vector<Work> partition(const std::vector<std::uint8_t>& selected) const;
  [[nodiscard]] double samples(std::int64_t width_x, std::int64_t width_y, std::int64_t height) const;
  [[nodiscard]] double kept_share(const Work& work, const std::array<std::int64_t, 2>& first) const;
  void run_slab(const Work& work, const std::vector<std::uint8_t>& selected, const OnBatch& on_batch,
                const std::function<void(double)>& tick);

  opencl::State& state_;
  const FilteredScan& scan_;
  Upsampler& upsampler_;
  FieldSups sups_;
  GoldSettings settings_;
  Coverage coverage_;
  UpsampledColumns columns_;
  std::vector<float> cell_p_;       // P per base cell once computed, [z][y][x]; negative: not yet
  std::vector<float> cell_addend_;  // 2.5 P and the remainder of T, alike
  std::int64_t slab_bricks_ = 1, block_bricks_ = 1;
  GoldSpent spent_;
  double arithmetic_ = 0;
  double rounding_ = 0;   // the part of it that differs from sample to sample
  double remainder_ = 0;  // of T, anywhere in the field
};

class GoldStream::Batch {
 public:
  /// Bricks of the batch that lie in the grid and are selected.
  [[nodiscard]] const std::vector<std::int64_t>& bricks() const { return bricks_; }

  /// The node test at levels 0 .. log2(rate) (isotropic), per brick of bricks(): |interpolant - gold| + slack
  /// <= tolerance. Level 0 is measured on the stored base samples through the sampler: closing never changes
  /// those, so it is final.
  std::vector<BrickClass> classify(const DeviceField& base, float tolerance,
                                   const opencl::DeviceArray<std::uint8_t>& selected);

  /// Per brick of bricks(): the largest and the smallest P of its base cells.
  std::vector<std::pair<float, float>> largest_p();

  /// Calls visit(node index x, y, z in the brick, gold, slack) for every node of one closed brick; reads the
  /// block back.
  template <class Visit>
  void for_each_node(std::int64_t brick, Visit&& visit) const {
    const auto [b, x, y, z] = place(brick);
    const std::vector<float> gold = gold_.to_host(), slack = slack_.to_host();
    const std::int64_t side = std::int64_t{settings_.granularity} * settings_.rate;
    for (std::int64_t k = 0; k <= side && z * side + k < nz_; ++k)
      for (std::int64_t j = 0; j <= side; ++j)
        for (std::int64_t i = 0; i <= side; ++i) {
          const std::int64_t nx = x * side + i, ny = y * side + j, nz = z * side + k;
          visit(Index3{i, j, k},
                gold[static_cast<std::size_t>(((b * (ny_ + 2) + ny + 1) * (nx_ + 2) + nx + 1) * gold_stride_ +
                                              nz + 1)],
                slack[static_cast<std::size_t>(((b * ny_ + ny) * nx_ + nx) * stride_ + nz)]);
        }
  }

  /// Gold samples of the requested tiles, in the order asked, concatenated: float [z][y][x] each.
  std::vector<float> extract(const std::vector<std::pair<std::int64_t, LevelTriple>>& tiles);

  /// Measures a stored field on every selected brick.
  std::vector<BrickMeasure> measure(const DeviceField& field, float tolerance,
                                    const opencl::DeviceArray<std::uint8_t>& selected);

 private:
  friend class GoldStream;
  struct Results;
  Results run_measure(const DeviceField& field, float tolerance,
                      const opencl::DeviceArray<std::uint8_t>& selected);
  Batch(opencl::State& state, const GoldSettings& settings) : state_(state), settings_(settings) {}
  [[nodiscard]] std::array<std::int64_t, 4> place(std::int64_t brick) const;  // block, then x, y, z inside it
  [[nodiscard]] std::uint64_t blocks() const { return first_brick_.size(); }

  opencl::State& state_;
  const GoldSettings& settings_;
  std::int64_t bricks_x_ = 0, bricks_y_ = 0, bricks_z_ = 0;  // per block
  std::int64_t nx_ = 0, ny_ = 0, nz_ = 0, gold_stride_ = 0, stride_ = 0;
  float lowest_ = 0;  // margin below which a column is untested
  std::vector<std::array<std::int64_t, 3>> first_brick_;
  std::vector<std::int64_t> bricks_;
  std::map<std::int64_t, std::array<std::int64_t, 4>> place_;
  opencl::DeviceArray<float> gold_, slack_, margin_, p_;
};

}  // namespace vdvr
