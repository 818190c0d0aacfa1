// Figures of a volume as it is, and of what it is when put where it belongs.
#include "vdvr/expert/audit.hpp"

#include <algorithm>

#include "host/base/opencl/host_memory.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/scan/units.hpp"
#include "host/verify/audit/audit_bound.hpp"
#include "host/verify/audit/audit_points.hpp"
#include "host/verify/audit/audited_volume.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/trust.hpp"

namespace vdvr {
namespace {

// The certified upper end may exceed what was found at nodes by so much before finer gold is asked.
constexpr double kSharp = 1.02;

AuditFigures figures_of(Device& device, const ProjectionSet& scan, const Volume& volume,
                        const AuditOptions& options, const Progress& progress) {
  opencl::State& state = device.state();
  // A displaced detector's rows may be made twice as long.
  const std::uint64_t padded = scan.cone && scan.cone->redundancy == Redundancy::displaced ? 2 : 1;
  const std::uint64_t all = padded * static_cast<std::uint64_t>(scan.size()) * sizeof(double);
  const HostMemory table(state,
                         scan.data.scratch() ? std::min(all, scan.data.scratch()->resident_bytes()) : all,
                         "cosine coefficients of the filtered projections");
  const HostMemory copy(state, volume.samples.size() * sizeof(float), "the audited part of the volume");
  const ExactField exact(scan, options.field, progress);
  const AuditedVolume w(volume, Coverage(exact.geometry(), exact.views()), options);
  AuditFigures figures;
  const std::vector<Vec3> samples = compare_samples(device, scan, options.field, exact, w, figures, progress);
  if (options.within) figures.within = *options.within * (options.within_share ? figures.span() : 1);
  AuditBound bound;
  try {
    bound = bound_between(state, exact, w, kSharp, figures.within, units_of(scan).density(), progress);
    figures.upper = bound.upper;
    figures.finest_rate = bound.finest_rate;
  } catch (const InputError& e) {
    figures.why_no_upper = e.what();
  }
  search_worst(exact, w, bound.worst, samples, figures, progress);
  return figures;
}

}  // namespace

Audit audit(Device& device, const ProjectionSet& scan, const Volume& volume, const AuditOptions& options,
            const Progress& progress) {
  require_trusted(device, "auditing a volume");
  check_scan(scan);
  Audit out;
  if (!options.as_is) out.registration = register_volume(device, scan, volume, options, progress);
  out.as_is = figures_of(device, scan, volume, options, progress);
  if (!out.registration || out.registration->words.empty()) return out;
  const HostMemory copy(device.state(), volume.samples.size() * sizeof(float), "the registered volume");
  const Volume right = registered_volume(volume, *out.registration);
  AuditOptions then = options;
  then.within.reset();
  then.field.filter = out.registration->window;
  if (out.registration->center != 0)
    then.field.center = stated_center(options.field, scan.geometry) + out.registration->center;
  out.registered = figures_of(device, scan, right, then, progress);
  return out;
}

}  // namespace vdvr
