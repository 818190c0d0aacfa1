// How far the bounds lie above the truth: the largest bound over the largest error that a finer gold shows.
#pragma once

#include <string>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {

/// Largest bounds and largest errors over the same nodes and cells, density units.
struct Tightness {
  double gold_bound = 0, gold_error = 0;  ///< T of gold itself: without the shares of P and rounding in it
  double projection_bound = 0;            ///< P: interpolation in u and between kept nodes, a constant
  double projection_error = 0;
  double arithmetic = 0;
  std::int64_t bricks = 0;  ///< looked at in full: those of the largest bounds, and random ones
};

/// The truth is gold at 4 times the rate from
/// six taps in u at 16x, whose own error is below 1 % of what is measured. Cost: two passes over the grid,
/// then bricks at the finer rate.
VDVR_API Tightness measure_tightness(Device& device, const ProjectionSet& scan, const Grid& grid,
                                     const FieldOptions& field, const Rates& rates,
                                     const Progress& progress = {});

}  // namespace vdvr
