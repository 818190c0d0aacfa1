// Bounds at each rate, and the choice of rates that fit a tolerance. Builds nothing.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/comparison.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {

struct Tolerance {
  std::optional<double> relative{};  ///< fraction of the reference range, or as the settings' comparison says
  std::optional<double> absolute{};  ///< density units; one of the two is set

  /// As a density. `whole`: what a relative one is a fraction of.
  [[nodiscard]] double as_density(double whole) const {
    return absolute ? *absolute : relative.value_or(1) * whole;
  }
};

/// What is not given is chosen by trial.
struct RateOptions {
  std::optional<int> upsampling;
  std::optional<Interpolation> interpolation;
  std::optional<int> gold;
};

/// What is stored, and what is foreseen.
struct PlanSettings {
  Comparison comparison{};
  Levels levels = Levels::anisotropic;
  int granularity = 4;  ///< 1, 2, 4 or 8; less on grids thinner than a brick
  /// log2 of cells per base cell, z, y, x; each divides granularity and cells. None: what is foreseen to
  /// store least, and 0 with isotropic levels.
  std::optional<LevelTriple> coarsening{};
  bool forecast =
      true;  ///< storage, memory and time, and the paper's bounds beside ours: half of a plan's cost
  /// Of a large scan judge by a part: some views for bounds, a window of rows for everything; of any scan of
  /// cone beam, where something is foreseen, by columns on a radius. What is foreseen then are estimates, as
  /// the plan's notes say, and it cannot be built.
  bool estimate = false;
  /// What is foreseen is for this tolerance, no smaller than the plan's: where bricks begin that pictures
  /// then refine. None: the plan's.
  std::optional<Tolerance> everywhere{};
  /// What bricks [z][y][x] may err by, as densities, where they have tolerances of their own, of which the
  /// plan's is the smallest: rates are chosen for these. A plan that is made holds none.
  std::vector<float> by_brick{};
};

struct PreparedScan;
class Forecaster;

struct Plan {
  Grid grid;
  PlanSettings settings;
  FieldOptions field;
  double epsilon = 0, epsilon_abs = 0, reference_range = 0;
  std::optional<std::array<Vec3, 2>> range_at;  ///< Certificate::range_at
  Rates rates;
  VolumeLayout layout;
  std::vector<Bound> bounds;       ///< all that were computed
  ErrorBudget budget;              ///< foreseen shares at the chosen rates; grid: what is left for it
  std::uint64_t gold_samples = 0;  ///< to be back-projected, per pass
  std::uint64_t memory_bytes = 0;  ///< peak of our allocations foreseen
  std::uint64_t memory_of_rows = 0,
                memory_of_cells = 0;  ///< of those, what grows with the rows, with the grid
  std::uint64_t tile_bytes = 0;       ///< of tiles before closing, wherever they lie
  double seconds = 0;                 ///< foreseen for build, from a measured back-projection rate
  double seconds_of_rows = 0;  ///< of those, what grows with the detector's rows and not with the grid's
  double samples_ratio = 0;    ///< storage foreseen before repair, from a sample of bricks
  std::int64_t not_covered_count = 0;
  double not_covered_fraction = 0;
  Volume base;             ///< the 1x reconstruction it rests on; of an estimate, that of its rows
  bool estimated = false;  ///< from a part of the scan
  std::vector<std::string> notes;
  /// The filtered scan and the gold that was kept, on the device: a build of the same scan on it goes on from
  /// there. Reset it to free their memory.
  std::shared_ptr<PreparedScan> prepared{};
  /// Where something was foreseen: forecasts builds of other tolerances.
  std::shared_ptr<Forecaster> forecaster{};

  /// What its epsilon is a fraction of: other relative tolerances count by it too.
  [[nodiscard]] double whole() const { return epsilon_abs / epsilon; }
};

/// Throws ToleranceError naming the binding term and the smallest epsilon that would do.
VDVR_API Plan make_plan(Device& device, const ProjectionSet& scan, const Grid& grid,
                        const FieldOptions& field, const RateOptions& rates, const Tolerance& tolerance,
                        const PlanSettings& settings = {}, const Progress& progress = {});

}  // namespace vdvr
