// Tolerances in units of the scan's own noise: what they are of the range, what builds of them would store,
// and builds of them (docs/noise.md). The bound of each brick is proved; sigma, which it is held to, is
// estimated.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/noise.hpp"
#include "vdvr/expert/plan.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// The standard deviation of F at covered samples of a noise_grid(), density units.
struct SigmaRange {
  double least = 0, median = 0, largest = 0;
};

/// Sigma of F brick by brick.
struct BrickSigma {
  /// [bz][by][bx], density units: the least at those corners of the brick that views see, of a brick without
  /// such a corner the least of all.
  std::vector<float> of_brick;
  SigmaRange range;
};
/// `sigma`: on noise_grid(grid, granularity). Throws InputError where no sample is covered.
VDVR_API BrickSigma brick_sigma(const Volume& sigma, const ProjectionSet& scan, const FieldOptions& field,
                                const Grid& grid, int granularity);
/// The same of a plan, by one more back-projection (noise_of_field).
VDVR_API BrickSigma sigma_of_plan(Device& device, const ProjectionSet& scan, const Plan& plan,
                                  const ScanNoise& noise, const Progress& progress = {});

/// A build whose bricks may each err by so many sigmas of their own.
struct SigmaForecast {
  double multiple = 1;
  double samples_ratio = 0;  ///< stored per base sample, as Plan::samples_ratio
};

/// The plan's rates are taken as they are, which suits tolerances no smaller than its own. Nothing of a plan
/// that was made without a forecast or from a part of the scan. Cost: a plan's look at some bricks for each,
/// a quarter of those that it looks at for its own tolerance: the two differ by some 3 %, and by up to 10.
VDVR_API std::vector<SigmaForecast> forecast_in_sigma(const Plan& plan, const BrickSigma& sigma,
                                                      std::span<const double> multiples);

/// A plan whose epsilon is what the quietest brick may err by.
struct PlanInSigma {
  Plan plan;
  BrickSigma sigma;
};
/// Of the whole scan, never estimated from a part. Throws what make_plan() throws; InputError for a multiple
/// that is not positive and finite.
VDVR_API PlanInSigma make_plan_in_sigma(Device& device, const ProjectionSet& scan, double multiple,
                                        const ScanNoise& noise, const CertifyOptions& options = {},
                                        const Progress& progress = {});
/// How build() holds each brick to `multiple` times its sigma.
VDVR_API Refinement refinement_in_sigma(const BrickSigma& sigma, double multiple);
/// What interpolation errs by on average: the root mean square of (V - F) / sigma over covered points between
/// samples. An estimate, where the largest is proved.
struct MeanError {
  double in_sigma = 0;
  std::int64_t points = 0;
};
/// Of a certificate with its `brick_sigma`. Nothing where fewer than a hundred points are covered. Cost: a
/// reconstruction at some ten thousand points. Throws what reconstruct() throws.
VDVR_API std::optional<MeanError> mean_error(Device& device, const ProjectionSet& scan,
                                             const MixedVolume& volume, const Certificate& certificate,
                                             const Progress& progress = {});
/// Writes what is known of the noise into the certificate of a build: with `multiple` of a build so refined,
/// which is then promised. Throws ToleranceError where a brick's bound is more.
VDVR_API void note_noise(Certificate& certificate, const ScanNoise& noise, const BrickSigma& sigma,
                         std::optional<double> multiple = {});
/// The same, and the mean error and the split of the views, where memory is left to find them.
VDVR_API void note_noise(Device& device, const ProjectionSet& scan, BuildResult& built,
                         const ScanNoise& noise, const BrickSigma& sigma, std::optional<double> multiple = {},
                         const Progress& progress = {});

}  // namespace vdvr
