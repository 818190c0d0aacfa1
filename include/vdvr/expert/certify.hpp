// From a scan and a tolerance to a certified volume, in one call: what `vdvr build` does between reading its
// input and writing its output.
#pragma once

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/input_statement.hpp"
#include "vdvr/expert/noted_scan.hpp"
#include "vdvr/expert/plan.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {

/// Defaults that work; what is left open is taken from the scan or chosen by trial.
struct CertifyOptions {
  FieldOptions field;  ///< center: the scan's, unless given
  GridOptions grid;    ///< the covered region at the detector's pitch, unless given; with `build.roi` and no
                       ///< `size` those of its bricks that the region meets: the range is then theirs
  RateOptions rates;
  PlanSettings plan;  ///< forecast: of make_plan alone; certify() needs nothing of it
  BuildOptions build;
  InputStatement input;  ///< what was stated when the scan was read (Understood::stated), for the certificate
};

/// The grid that such a plan has.
VDVR_API Grid grid_to_certify(const ProjectionSet& scan, const CertifyOptions& options);

/// The plan that certify() follows. Throws what make_plan of plan.hpp and make_grid throw.
VDVR_API Plan make_plan(Device& device, const ProjectionSet& scan, const Tolerance& tolerance,
                        const CertifyOptions& options = {}, const Progress& progress = {});

/// Plans, builds, and completes the certificate: options and geometry noted in it, the content hashed.
///
/// Refuses what would promise nothing. Throws InputError for options that are out of range or exclude each
/// other, a scan that check_scan refuses, and a window or region of interest without a covered gold node;
/// ToleranceError where the tolerance is out of reach, with a way out, or where the volume does not hold it
/// for the sampler `buffer`, which every device has. For image3d the certificate itself says whether it holds
/// (holds_image3d). Settings that are never certified (comparison.hpp) give a volume that certifies nothing.
///
/// A journal in `options.build` is removed where going on would end at the same ToleranceError, and is
/// otherwise left to the caller. Cost: as make_plan and build.
VDVR_API BuildResult certify(Device& device, const ProjectionSet& scan, const Tolerance& tolerance,
                             const CertifyOptions& options = {}, const Progress& progress = {});

/// The same, of a plan made before from the same scan and options; one that is moved here gives its memory
/// back.
VDVR_API BuildResult certify(Device& device, const ProjectionSet& scan, Plan plan,
                             const CertifyOptions& options = {}, const Progress& progress = {});

}  // namespace vdvr
