// From a scan and a tolerance of any kind to a certified volume: all that `vdvr build` does between reading
// its input and writing its output. certify() of certify.hpp is the part that knows nothing of noise and
// pictures.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/noise_forecast.hpp"
#include "vdvr/expert/picture_refinement.hpp"

namespace vdvr {

/// Pictures that decide how fine bricks are.
struct PictureTolerance {
  WantedViews views;
  double levels = 8;      ///< of 255, that every pixel shall be certain to
  double finest = 0.002;  ///< the least tolerance that a brick can be asked for, fraction of the range
};

struct AskedTolerance {
  Tolerance tolerance;           ///< without sigmas; with pictures what holds everywhere
  std::optional<double> sigmas;  ///< of the scan's own noise, brick by brick
  std::optional<PictureTolerance> pictures{};
};

struct PlannedScan {
  AskedTolerance asked;
  Plan plan;
  std::optional<ScanNoise> noise;
  std::optional<BrickSigma> sigma;              ///< of F, where the noise is known
  std::string no_sigma;                         ///< why not, where the noise is
  std::shared_ptr<PictureRefinement> pictures;  ///< none, unless refined for some
  /// For a plan for pictures: the demands on bricks, and the tolerance that holds everywhere, density units.
  /// everywhere_abs() throws InputError where that is less than what a brick may be asked for.
  [[nodiscard]] VDVR_API PictureRefinementOptions refinement_options() const;
  [[nodiscard]] VDVR_API double everywhere_abs() const;
};

/// `noise`: of the scan (read_scan_noise()); with it sigma of F is noted whatever the tolerance, and no plan
/// fails for want of it. Throws what make_plan() throws; InputError for sigmas without noise, and for sigmas
/// and pictures together.
VDVR_API PlannedScan plan_scan(Device& device, const ProjectionSet& scan, const AskedTolerance& asked,
                               const std::optional<ScanNoise>& noise, const CertifyOptions& options = {},
                               const Progress& progress = {});
/// How build() holds each brick to what was asked of it; nothing where one tolerance holds for all.
VDVR_API std::optional<Refinement> refinement_of(const PlannedScan& planned);
/// Builds, and notes pictures and noise in the certificate. Takes the plan. Throws what certify() throws.
VDVR_API BuildResult certify_planned(Device& device, const ProjectionSet& scan, PlannedScan& planned,
                                     CertifyOptions options = {}, const Progress& progress = {});
/// Both. The plan looks no further ahead than the build needs.
VDVR_API BuildResult certify_scan(Device& device, const ProjectionSet& scan, const AskedTolerance& asked,
                                  const std::optional<ScanNoise>& noise, CertifyOptions options = {},
                                  const Progress& progress = {});

}  // namespace vdvr
