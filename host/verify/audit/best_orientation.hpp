// Which of the 48 turns and mirrors makes a volume look most like F.
#pragma once

#include "host/verify/audit/fit.hpp"
#include "host/verify/audit/orientation.hpp"

namespace vdvr {

/// Samples and columns that registration looks to either side.
constexpr int kReach = 2;

struct Placed {
  Orientation orientation;
  Index3 shift{0, 0, 0};  ///< whole samples beside those of the settings
  double unexplained = 1;
};

/// The one that explains most with a shift of its own, F being made with `settings`; a simpler one where it
/// explains nearly as much, and `current` unless another halves what is unexplained.
Placed best_orientation(Device& device, const ProjectionSet& scan, const Volume& volume,
                        const AuditOptions& options, const FitSettings& settings, const Orientation& current,
                        const Progress& progress);

}  // namespace vdvr
