// Tolerances in sigma; see vdvr/expert/noise_forecast.hpp.
#include "vdvr/expert/noise_forecast.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "host/base/system/casts.hpp"
#include "host/certify/forecaster.hpp"
#include "host/certify/gold/gold_settings.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certified_region.hpp"

namespace vdvr {
namespace {

// What is asked of a brick, as a density: below what is promised by more than sums in fp32 round by.
double asked_of_brick(double multiple, double sigma) {
  constexpr double margin = 1 - 0x1p-18;
  return multiple * margin * sigma;
}

std::vector<std::uint8_t> seen_samples(const Volume& sigma, const ProjectionSet& scan,
                                       const FieldOptions& field) {
  const CertifiedRegion region(scan, field);
  const Index3 n = sigma.grid.samples();
  std::vector<std::uint8_t> seen(sigma.samples.size(), 0);
  for (std::int64_t i = 0; i < sigma.grid.sample_count(); ++i)
    seen[at(i)] = sigma.samples[at(i)] > 0 &&
                  region.contains(sigma.grid.position({i % n[0], i / n[0] % n[1], i / n[0] / n[1]}));
  return seen;
}

SigmaRange range_of(const Volume& sigma, const std::vector<std::uint8_t>& seen) {
  std::vector<float> covered;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i]) covered.push_back(sigma.samples[i]);
  if (covered.empty())
    throw InputError(
        "no corner of a brick is covered by the scan, and there the noise is told: take a smaller `spacing` "
        "or "
        "`granularity`, or change `origin`, `size` or `center`");
  std::sort(covered.begin(), covered.end());
  return {static_cast<double>(covered.front()), static_cast<double>(covered[covered.size() / 2]),
          static_cast<double>(covered.back())};
}

}  // namespace

BrickSigma brick_sigma(const Volume& sigma, const ProjectionSet& scan, const FieldOptions& field,
                       const Grid& grid, int granularity) {
  const std::vector<std::uint8_t> seen = seen_samples(sigma, scan, field);
  const Index3 n = sigma.grid.samples(), bricks = Bricks(grid, granularity).along();
  BrickSigma out{{}, range_of(sigma, seen)};
  out.of_brick.resize(at(bricks[0] * bricks[1] * bricks[2]));
  for (std::int64_t z = 0; z < bricks[2]; ++z)
    for (std::int64_t y = 0; y < bricks[1]; ++y)
      for (std::int64_t x = 0; x < bricks[0]; ++x) {
        float least = std::numeric_limits<float>::infinity();
        for (std::int64_t c = 0; c < 8; ++c) {
          const std::size_t i = at(((z + (c >> 2)) * n[1] + y + ((c >> 1) & 1)) * n[0] + x + (c & 1));
          if (seen[i]) least = std::min(least, sigma.samples[i]);
        }
        out.of_brick[at((z * bricks[1] + y) * bricks[0] + x)] =
            std::isfinite(least) ? least : static_cast<float>(out.range.least);
      }
  return out;
}

BrickSigma sigma_of_plan(Device& device, const ProjectionSet& scan, const Plan& plan, const ScanNoise& noise,
                         const Progress& progress) {
  const int granularity = plan.layout.granularity;
  return brick_sigma(
      noise_of_field(device, scan, plan.field, noise.model, noise_grid(plan.grid, granularity), progress),
      scan, plan.field, plan.grid, granularity);
}

namespace {

// None where the plan looked at too little for it.
std::optional<SigmaForecast> forecast_of(const Plan& plan, const BrickSigma& sigma, double multiple,
                                         bool by_the_way) {
  // Of parallel beam an estimate is one of rows, or bounded by some views.
  const bool of_cone = plan.prepared && !plan.prepared->filtered.views.empty();
  if (!plan.forecaster || (plan.estimated && !of_cone)) return std::nullopt;
  NodeTolerance tolerance(0, sigma.of_brick);
  for (float& brick : tolerance.by_brick) {
    const double wanted = asked_of_brick(multiple, static_cast<double>(brick)) - plan.budget.arithmetic.value;
    // Below what rounding takes no tolerance is within reach: such a brick counts with the plan's.
    brick = static_cast<float>(wanted > 0 ? wanted : plan.epsilon_abs);
    tolerance.of_all = std::max(tolerance.of_all, static_cast<double>(brick));
  }
  if (!(tolerance.of_all > 0)) return std::nullopt;
  return SigmaForecast{multiple, plan.forecaster->samples_ratio(tolerance, by_the_way)};
}

}  // namespace

std::vector<SigmaForecast> forecast_in_sigma(const Plan& plan, const BrickSigma& sigma,
                                             std::span<const double> multiples) {
  std::vector<SigmaForecast> out;
  for (const double multiple : multiples)
    if (const auto forecast = forecast_of(plan, sigma, multiple, true)) out.push_back(*forecast);
  return out;
}

PlanInSigma make_plan_in_sigma(Device& device, const ProjectionSet& scan, double multiple,
                               const ScanNoise& noise, const CertifyOptions& options,
                               const Progress& progress) {
  if (!(multiple > 0) || !std::isfinite(multiple))
    throw InputError(fmt::format("a tolerance of {} sigma must be positive and finite", multiple));
  FieldOptions field = options.field;
  field.center = stated_center(field, scan.geometry);
  const Grid grid = grid_to_certify(scan, options);
  const int granularity = fitting_granularity(options.plan.granularity, grid);
  PlanInSigma out;
  out.sigma =
      brick_sigma(noise_of_field(device, scan, field, noise.model, noise_grid(grid, granularity), progress),
                  scan, field, grid, granularity);
  CertifyOptions whole = options;
  whole.plan.estimate = false;
  whole.plan.by_brick = refinement_in_sigma(out.sigma, multiple).by_brick;
  out.plan = make_plan(device, scan, Tolerance{{}, asked_of_brick(multiple, out.sigma.range.least)}, whole,
                       progress);
  if (const auto forecast = forecast_of(out.plan, out.sigma, multiple, false))
    out.plan.samples_ratio = forecast->samples_ratio;
  return out;
}

Refinement refinement_in_sigma(const BrickSigma& sigma, double multiple) {
  Refinement out;
  for (const float s : sigma.of_brick) {
    out.by_brick.push_back(static_cast<float>(asked_of_brick(multiple, static_cast<double>(s))));
    out.everywhere_abs = std::max(out.everywhere_abs, multiple * static_cast<double>(s));
  }
  out.digest = fmt::format("{} sigma of {}", multiple, sigma_sha256(sigma.of_brick));
  return out;
}

void note_noise(Certificate& c, const ScanNoise& noise, const BrickSigma& sigma,
                std::optional<double> multiple) {
  const SigmaRange& range = sigma.range;
  c.noise = NoiseRecord{.source = noise.model.source,
                        .photons = noise.model.photons,
                        .least = range.least,
                        .median = range.median,
                        .largest = range.largest,
                        .tolerance_sigmas = multiple,
                        .rms_in_sigma = {},
                        .split_ratio = {},
                        .worst_image3d = {},
                        .sha256 = sigma_sha256(sigma.of_brick)};
  c.brick_sigma = sigma.of_brick;
  if (!multiple || c.comparison) return;
  c.holds_buffer = c.holds_buffer && within_tolerance(c, c.total_buffer, false);
  if (c.total_image3d && c.holds_image3d)
    c.holds_image3d = *c.holds_image3d && within_tolerance(c, *c.total_image3d, true);
  if (!c.holds_buffer) {
    const double worst = worst_in_sigma(c, false);
    throw ToleranceError(
        fmt::format("a brick's bound is {:.4g} of its sigma, where {:.4g} is asked: allow "
                    "at least {:.3g}sigma",
                    worst, *multiple, 1.02 * worst));
  }
}

// Those that follow depend on how memory divides a reconstruction, and files would differ.
static double six_digits(double x) {
  if (!(x > 0)) return x;
  const double unit = std::pow(10.0, std::floor(std::log10(x)) - 5);
  return std::round(x / unit) * unit;
}

void note_noise(Device& device, const ProjectionSet& scan, BuildResult& built, const ScanNoise& noise,
                const BrickSigma& sigma, std::optional<double> multiple, const Progress& progress) {
  note_noise(built.certificate, noise, sigma, multiple);
  try {
    if (const auto mean = mean_error(device, scan, built.volume, built.certificate, progress)) {
      built.certificate.noise->rms_in_sigma = six_digits(mean->in_sigma);
      built.certificate.noise->rms_points = mean->points;
    }
    if (const auto split = split_of_views(device, scan, built.certificate.field, noise.model, progress)) {
      built.certificate.noise->split_ratio = six_digits(split->ratio());
      built.certificate.noise->split_resolved = split->resolved;
    }
  } catch (const ResourceError&) {
    // The volume and all that is promised of it stand without.
  }
}

}  // namespace vdvr
