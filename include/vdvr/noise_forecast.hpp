// Tolerances in units of the scan's own noise: what they are of the range, and what builds of them would
// store.
#pragma once

#include <span>
#include <vector>

#include "vdvr/export.hpp"
#include "vdvr/field_options.hpp"
#include "vdvr/grid.hpp"
#include "vdvr/plan.hpp"
#include "vdvr/projections.hpp"

namespace vdvr {

/// The standard deviation of F at covered samples of a noise_grid(), density units.
struct SigmaRange {
  double least = 0, median = 0, largest = 0;
};
/// Throws InputError where no sample is covered.
VDVR_API SigmaRange sigma_range(const Volume& sigma, const ProjectionSet& scan, const FieldOptions& field);

/// A build whose bricks may each err by so many sigmas of their own.
struct SigmaForecast {
  double multiple = 1;
  double samples_ratio = 0;  ///< stored per base sample, as Plan::samples_ratio
};

/// `sigma`: on noise_grid(plan.grid, plan.layout.granularity); a brick's is the least of its corners. The
/// plan's rates are taken as they are, which suits tolerances no smaller than its own. Nothing of a plan that
/// was made without foresight or from a part of the scan. Cost: a plan's look at some bricks for each.
VDVR_API std::vector<SigmaForecast> foresee_in_sigma(const Plan& plan, const Volume& sigma,
                                                     std::span<const double> multiples);

}  // namespace vdvr
