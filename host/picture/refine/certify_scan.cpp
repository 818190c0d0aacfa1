#include "vdvr/certify_scan.hpp"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

/// Beside a tolerance of another kind sigma is told where it can be had.
void find_sigma(Device& device, const ProjectionSet& scan, PlannedScan& planned, const Progress& progress) {
  if (!planned.noise) return;
  try {
    planned.sigma = sigma_of_plan(device, scan, planned.plan, *planned.noise, progress);
  } catch (const Error& e) {
    if (e.kind() == ErrorKind::interrupted) throw;
    planned.no_sigma = e.what();
  }
}

void plan_for_pictures(Device& device, const ProjectionSet& scan, PlannedScan& planned,
                       CertifyOptions options, const Progress& progress) {
  const PictureTolerance& wanted = *planned.asked.pictures;
  options.plan.everywhere = planned.asked.tolerance;
  // Pictures are of the whole grid, so a part of the scan does not do.
  options.plan.estimate = false;
  try {
    planned.plan = make_plan(device, scan, Tolerance{wanted.finest, {}}, options, progress);
  } catch (const ToleranceError& e) {
    throw ToleranceError(fmt::format("{}; with pictures it is `picture_finest` that is too small", e.what()));
  }
  static_cast<void>(planned.everywhere_abs());
  planned.pictures = std::make_shared<PictureRefinement>(wanted.views, scan, planned.plan.field,
                                                         planned.refinement_options(), progress);
}

}  // namespace

PictureRefinementOptions PlannedScan::refinement_options() const {
  PictureRefinementOptions options;
  options.levels = asked.pictures.value().levels;
  options.finest_abs = plan.epsilon_abs;
  return options;
}

double PlannedScan::everywhere_abs() const {
  const double everywhere = asked.tolerance.as_density(plan.whole());
  if (!(everywhere >= plan.epsilon_abs))
    throw InputError(
        fmt::format("`epsilon` {:.4g} lies below {:.4g}, the least that `picture_finest` asks of a brick",
                    everywhere, plan.epsilon_abs));
  return everywhere;
}

PlannedScan plan_scan(Device& device, const ProjectionSet& scan, const AskedTolerance& asked,
                      const std::optional<ScanNoise>& noise, const CertifyOptions& options,
                      const Progress& progress) {
  PlannedScan planned;
  planned.asked = asked;
  planned.noise = noise;
  if (asked.sigmas && asked.pictures)
    throw InputError("a tolerance in sigma excludes pictures: one of the two decides what bricks need");
  if (asked.sigmas) {
    if (!noise) throw InputError("`epsilon` in sigma needs the scan's noise, and none is known");
    PlanInSigma made = make_plan_in_sigma(device, scan, *asked.sigmas, *noise, options, progress);
    planned.plan = std::move(made.plan);
    planned.sigma = std::move(made.sigma);
    return planned;
  }
  if (asked.pictures) plan_for_pictures(device, scan, planned, options, progress);
  else planned.plan = make_plan(device, scan, asked.tolerance, options, progress);
  find_sigma(device, scan, planned, progress);
  return planned;
}

std::optional<Refinement> refinement_of(const PlannedScan& planned) {
  if (planned.pictures) return planned.pictures->refinement(planned.everywhere_abs());
  if (planned.asked.sigmas) return refinement_in_sigma(planned.sigma.value(), *planned.asked.sigmas);
  return std::nullopt;
}

BuildResult certify_planned(Device& device, const ProjectionSet& scan, PlannedScan& planned,
                            CertifyOptions options, const Progress& progress) {
  if (auto refinement = refinement_of(planned)) options.build.refinement = std::move(*refinement);
  BuildResult built = certify(device, scan, std::move(planned.plan), options, progress);
  if (planned.pictures) planned.pictures->note(built.certificate);
  if (planned.sigma) {
    const auto start = std::chrono::steady_clock::now();
    note_noise(device, scan, built, *planned.noise, *planned.sigma, planned.asked.sigmas, progress);
    built.seconds["noise"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return built;
}

BuildResult certify_scan(Device& device, const ProjectionSet& scan, const AskedTolerance& asked,
                         const std::optional<ScanNoise>& noise, CertifyOptions options,
                         const Progress& progress) {
  options.plan.forecast = false;
  PlannedScan planned = plan_scan(device, scan, asked, noise, options, progress);
  return certify_planned(device, scan, planned, std::move(options), progress);
}

}  // namespace vdvr
