// What a build will store and how long it will take, from a sample of its bricks.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "host/certify/classify_bricks.hpp"
#include "host/certify/gold/prepared_scan.hpp"
#include "host/volume/choose_lattice.hpp"
#include "vdvr/expert/plan.hpp"

namespace vdvr {

/// What a build will take.
struct BuildForecast {
  double samples_ratio = 0;  ///< samples stored per base sample, index and tiles included
  double seconds = 0;        ///< of classification and verification
  double kept_seconds = 0;   ///< of those, what gold takes that is kept
  std::uint64_t tile_bytes = 0;
  std::uint64_t kept_bytes = 0;  ///< of gold that will be kept and is not yet
};

/// Bricks that stand for all: those near the coverage, or of large grids those of some columns of blocks from
/// the lowest to the highest, at places that stand for equal areas of the covered disc.
std::vector<std::uint8_t> bricks_to_look_at(GoldStream& stream, const ParallelGeometry& geometry);
/// Columns of bricks side by side that estimates of cone beam look at: neighbours read the same kept nodes,
/// which take several times as long. Half of the grid along x by some cells, where bricks of every expected
/// error are as frequent as in all of it. Positions of bricks, x and y, the ends not included.
struct SampledColumns {
  /// `base` holds F on the grid, `near` says which bricks may hold a tested node,
  /// `tolerance` is what the node test may take. Cost: a pass over the samples.
  SampledColumns(const Volume& base, const std::vector<std::uint8_t>& near, int granularity,
                 double tolerance);
  /// Of bricks that may hold a tested node, those in these columns.
  [[nodiscard]] std::vector<std::uint8_t> of(std::vector<std::uint8_t> near) const;
  /// Where kept nodes count for them: as far as filters reach from the samples that fits around them look at.
  /// A fit forgets what lies beyond by a factor of four a sample.
  [[nodiscard]] PlanePart part() const;
  /// Whether that is so little of the grid, and what is kept around it, that it spares most of the work.
  [[nodiscard]] bool is_worth_it() const;

  std::array<std::int64_t, 2> first{}, end{};

 private:
  Grid grid_;
  int granularity_;
};

/// Of what plans look at, forecasts builds of different tolerances. Keeps the prepared scan, in whose units
/// it computes; what it takes and gives is in world units.
class Forecaster {
 public:
  /// `base` holds F on the grid, `stored` the base samples to store: these in the prepared scan's units, as
  /// the settings are.
  Forecaster(std::shared_ptr<PreparedScan> prepared, const GoldSettings& settings, const Volume& base,
             std::vector<float> stored, std::vector<std::uint8_t> looked_at);

  /// Classifies a few whole blocks, which tells the time, and some bricks of every stratum of expected error,
  /// which tells the storage, among those to look at. `tolerance` is what the node test may take. Raising
  /// bricks after closing is not foreseen. Cost: about 1 % of the build.
  BuildForecast forecast(const NodeTolerance& tolerance);
  /// Of that, the samples stored per base sample. Cost: half. `by_the_way`: by a quarter of the bricks, for a
  /// quarter of that; the two differ by some 3 %, and by up to 10. measured() stays.
  double samples_ratio(const NodeTolerance& tolerance, bool by_the_way);

  /// What closing takes that adds so many levels to bricks, one in each round of repair: their tiles anew and
  /// their measure, at the pace of what was foreseen last.
  double repair_seconds(const std::vector<std::uint8_t>& raises);

  /// Errors and slack of the base samples, on the bricks that were looked at last.
  [[nodiscard]] std::vector<BrickMeasure> measured() const;
  /// Of the base samples to store, of which there are so many.
  [[nodiscard]] IntegerLattice lattice(const Plan& plan, StorageChoice storage,
                                       const FilterErrors& filters) const;
  [[nodiscard]] std::size_t stored() const { return stored_.size(); }
  /// Bricks that may hold a tested node.
  [[nodiscard]] const std::vector<std::uint8_t>& near() const { return near_; }

 private:
  struct Classified;
  struct Fates;
  [[nodiscard]] NodeTolerance in_own_units(NodeTolerance tolerance) const;
  Fates foresee(const NodeTolerance& tolerance, bool by_the_way);
  [[nodiscard]] double ratio_of(const Fates& foreseen) const;
  std::vector<Classified> classify(const NodeTolerance& tolerance, const std::vector<std::uint8_t>& selected);
  void add_kept(BuildForecast& out);
  double first_pass_seconds(const NodeTolerance& tolerance);

  std::shared_ptr<PreparedScan> prepared_;
  GoldRates gold_;
  std::vector<float> stored_;
  std::vector<std::uint8_t> looked_at_, near_;
  std::vector<double> error_;  // expected, by brick
  std::int64_t base_samples_;  // of the grid
  std::vector<BrickMeasure> measured_;
  double tile_pace_ = 0, measure_pace_ = 0;  // seconds a gold sample
  DeviceField field_;
};

/// What tiles take: as classified, closed and on the device, but no more than an eighth of the limit of each
/// of the first two, since the rest lies in scratch.
std::uint64_t memory_of_tiles(std::uint64_t tiles, std::uint64_t limit, bool on_gpu);

}  // namespace vdvr
