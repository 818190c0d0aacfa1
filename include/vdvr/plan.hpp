// Bounds at each rate, and the choice of rates that fit a tolerance. Builds nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vdvr/mixed_volume.hpp"
#include "vdvr/certificate.hpp"
#include "vdvr/comparison.hpp"
#include "vdvr/device.hpp"
#include "vdvr/reconstruct.hpp"

namespace vdvr {

struct Tolerance {
  std::optional<double> relative;  ///< fraction of the reference range, or as the settings' comparison says
  std::optional<double> absolute;  ///< density units; one of the two is set
};

struct RateOptions {
  std::optional<int> upsampling;  ///< none: auto
  std::string u_filter = "auto";  ///< auto | linear | cubic
  std::optional<int> gold;        ///< none: auto
};

/// What is stored, and what is foreseen.
struct PlanSettings {
  Comparison comparison{};
  std::string levels = "anisotropic";  ///< anisotropic: a level per axis | isotropic: one per brick
  int granularity = 4;                 ///< for what is foreseen
  /// log2 of cells per base cell, z, y, x; each divides granularity and cells. None: what is foreseen to
  /// store least, and 0 with isotropic levels.
  std::optional<LevelTriple> coarsening{};
  bool foresee =
      true;  ///< storage, memory and time, and the paper's bounds beside ours: half of a plan's cost
};

struct Plan {
  Grid grid;
  PlanSettings settings;
  FieldOptions field;
  double epsilon = 0, epsilon_abs = 0, reference_range = 0;
  int upsampling_u = 8;
  std::string u_filter = "linear";
  int gold_rate = 8;
  std::vector<Bound> bounds;       ///< all that were computed
  ErrorBudget budget;              ///< foreseen shares at the chosen rates; grid: what is left for it
  std::uint64_t gold_samples = 0;  ///< to be back-projected, per pass
  std::uint64_t memory_bytes = 0;  ///< peak of our allocations foreseen
  double seconds = 0;              ///< foreseen for build, from a measured back-projection rate
  double samples_ratio = 0;        ///< storage foreseen, from a sample of bricks
  std::int64_t not_covered_count = 0;
  double not_covered_fraction = 0;
  Volume base;                ///< the 1x reconstruction it rests on
  LevelTriple coarsening{};   ///< of the base that is stored
  std::vector<float> fitted;  ///< the base samples to store, where those are not F: midrange coefficients
  std::vector<std::string> notes;
};

/// Throws ToleranceError naming the binding term and the smallest epsilon that would do.
Plan make_plan(Device& device, const ProjectionSet& scan, const Grid& grid, const FieldOptions& field,
               const RateOptions& rates, const Tolerance& tolerance, const PlanSettings& settings = {},
               const Progress& progress = {});

}  // namespace vdvr
