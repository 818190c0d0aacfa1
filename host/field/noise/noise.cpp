// The noise of a scan and of F; see vdvr/expert/noise.hpp.
#include "vdvr/expert/noise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/system/casts.hpp"
#include "host/field/noise/estimate_photons.hpp"
#include "host/field/noise/field_variance.hpp"
#include "host/field/noise/passed_noise.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/extend_rows.hpp"

namespace vdvr {
namespace {

// Two sources agree within this factor.
constexpr double agreement = 1.5;
// A pixel's well holds some 10^5 to 10^6 electrons: 10^9 photons would be thousands of exposures, averaged.
constexpr double most_photons = 1e9;
// Below about ten counts the logarithm's variance is no longer one over the counts.
constexpr double fewest_counts = 10, share_of_few = 0.1;

void require_positive(const char* option, const std::optional<double>& value, const char* what) {
  if (value && !(*value > 0 && std::isfinite(*value)))
    throw InputError(fmt::format("`{}` {} must be {} above 0", option, *value, what));
}

LineIntegralNoise of_photons(double photons, const char* source) {
  LineIntegralNoise noise;
  noise.photon = {static_cast<float>(1 / photons)};
  noise.photons = photons;
  noise.source = source;
  return noise;
}

std::optional<ScanNoise> stated(const NoiseOptions& options) {
  require_positive("photons", options.photons, "a number of photons");
  require_positive("sigma_p", options.sigma_p, "a standard deviation of line integrals");
  if (options.photons && options.sigma_p) throw InputError("give one of `photons` and `sigma_p`");
  ScanNoise out;
  out.agreed = true;
  if (options.photons) {
    out.model = of_photons(*options.photons, "stated");
    out.words = fmt::format("{:.4g} photons a pixel in the open beam, as stated", *options.photons);
    return out;
  }
  if (!options.sigma_p) return std::nullopt;
  out.model.constant = *options.sigma_p * *options.sigma_p;
  out.model.source = "stated";
  out.words = fmt::format("line integrals with a standard deviation of {:.4g}, as stated", *options.sigma_p);
  return out;
}

// The share of pixels whose counts are too few for a variance of 1 / counts.
double share_of_few_counts(const ProjectionSet& scan, double photons) {
  const auto size = static_cast<std::int64_t>(scan.data.size()),
             step = std::max<std::int64_t>(1, size / 1000000);
  std::int64_t few = 0, all = 0;
  for (std::int64_t i = 0; i < size; i += step, ++all)
    few += photons * std::exp(-static_cast<double>(scan.data[at(i)])) < fewest_counts ? 1 : 0;
  return static_cast<double>(few) / static_cast<double>(all);
}

double largest_of(const ProjectionSet& scan) {
  float largest = 0;
  for (const float p : scan.data) largest = std::max(largest, std::abs(p));
  return static_cast<double>(largest);
}

// No detector counts e^-30 of the open beam; nobody scans what takes less than a hundredth of it.
bool are_logarithms(const ProjectionSet& scan) {
  const double largest = largest_of(scan);
  return largest >= 0.01 && largest <= 30;
}

double ratio_of(double a, double b) { return std::max(a, b) / std::min(a, b); }

std::string photons_text(const std::optional<double>& photons) {
  return photons ? fmt::format("{:.4g}", *photons) : "none";
}

constexpr const char* too_little = "the scan has too few views or columns to tell its noise";
constexpr const char* no_noise = "these data hold no noise to speak of";

// The larger of two numbers of photons.
struct Best {
  std::optional<double> photons;
  const char* source = "second differences";
  bool agreed = false;
  Best(const std::optional<double>& by_differences, const std::optional<double>& by_wedge)
      : photons(by_differences),
        agreed(by_differences && by_wedge && ratio_of(*by_differences, *by_wedge) <= agreement) {
    if (!by_wedge || (photons && *photons >= *by_wedge)) return;
    photons = by_wedge;
    source = "empty wedge";
  }
};

// Of line integrals in whatever unit, with the same variance everywhere; `whose` says why.
template <class None>
std::optional<ScanNoise> of_other_integrals(const ProjectionSet& scan, const std::string& whose,
                                            const None& none) {
  const auto by_differences = photons_by_differences(scan, Integrals::others),
             by_wedge = photons_by_wedge(scan, Integrals::others);
  const Best best(by_differences, by_wedge);
  if (!best.photons) return none(too_little);
  const double sigma = 1 / std::sqrt(*best.photons), largest = largest_of(scan);
  if (sigma * std::sqrt(most_photons) < largest)
    return none(
        fmt::format("line integrals differ by {:.2g} between neighbouring views, of {:.3g} at most: {}",
                    sigma, largest, no_noise));
  ScanNoise out;
  out.model.constant = sigma * sigma;
  out.model.source = best.source;
  out.agreed = best.agreed;
  const auto text = [](const std::optional<double>& inverse) {
    return inverse ? fmt::format("{:.4g}", 1 / std::sqrt(*inverse)) : "none";
  };
  out.words = fmt::format(
      "line integrals with a standard deviation of {:.4g} ({}) from the projections alone: {} by second "
      "differences, {} by the sinogram's empty wedge",
      sigma, whose, text(by_differences), text(by_wedge));
  return out;
}

}  // namespace

std::optional<ScanNoise> scan_noise(const ProjectionSet& scan, const NoiseOptions& options,
                                    const std::optional<LineIntegralNoise>& by_flats, std::string* why) {
  if (std::optional<ScanNoise> given = stated(options)) {
    if (changes_noise(scan.report.preparation))
      given->words += "; the projections were prepared, which lowers their noise: sigma is too large";
    return given;
  }
  if (scan.geometry.extension != own_detector(scan.geometry).extension)
    return scan_noise(own_rows(scan), options, by_flats, why);
  const auto none = [&](std::string reason) -> std::optional<ScanNoise> {
    if (why) *why = std::move(reason);
    return std::nullopt;
  };
  if (!scan.geometry.series.none())
    return none(
        "the views are put together of others, by height; state the noise of these by `photons` or "
        "`sigma_p`");
  if (changes_noise(scan.report.preparation))
    return none(
        "the projections were prepared, which changes what their noise looks like; state the noise of the "
        "unprepared ones by `photons`");
  if (!by_flats && !are_logarithms(scan))
    return of_other_integrals(
        scan, fmt::format("they are no logarithms of counts: the largest is {:.3g}", largest_of(scan)), none);
  ScanNoise out;
  out.by_differences = photons_by_differences(scan);
  out.by_wedge = photons_by_wedge(scan);
  if (by_flats) out.by_flats = by_flats->photons;
  const Best best(out.by_differences, out.by_wedge);
  if (by_flats) {
    out.model = *by_flats;
    out.agreed = best.photons && ratio_of(*best.photons, *out.by_flats) <= agreement;
    out.words = fmt::format(
        "{:.4g} photons a pixel in the open beam from repeated flats; the projections "
        "alone say {}",
        *out.by_flats, photons_text(best.photons));
  } else {
    if (!best.photons) return none(too_little);
    // Noise that does not grow with the line integral is not of counts: the sources then agree without it.
    if (!best.agreed)
      if (auto same =
              of_other_integrals(scan,
                                 fmt::format("as counts the sources would say {} and {} photons",
                                             photons_text(out.by_differences), photons_text(out.by_wedge)),
                                 [](const std::string&) { return std::optional<ScanNoise>(); });
          same && same->agreed)
        return same;
    out.model = of_photons(*best.photons, best.source);
    out.agreed = best.agreed;
    out.words = fmt::format(
        "{:.4g} photons a pixel in the open beam from the projections alone: {} by second "
        "differences, {} by the sinogram's empty wedge",
        *best.photons, photons_text(out.by_differences), photons_text(out.by_wedge));
  }
  if (out.model.photons > most_photons)
    return none(
        fmt::format("{:.2g} photons a pixel would explain what differs between neighbouring views, more "
                    "than detectors count: {}",
                    out.model.photons, no_noise));
  if (const double dead =
          static_cast<double>(scan.report.dead_pixels) / static_cast<double>(scan.data.size());
      dead > share_of_few)
    return none(
        fmt::format("{:.0f} % of the pixels counted nothing; state the noise by `sigma_p`", 100 * dead));
  if (const double few = share_of_few_counts(scan, out.model.photons); few > share_of_few)
    return none(
        fmt::format("{:.0f} % of the pixels counted fewer than {} of {:.3g} photons, too few for their "
                    "variance to be told; state it by `sigma_p`",
                    100 * few, fewest_counts, out.model.photons));
  return out;
}

Volume noise_of_field(Device& device, const ProjectionSet& scan, const FieldOptions& field,
                      const LineIntegralNoise& noise, const Grid& grid, const Progress& progress) {
  FieldVariance variance = field_variance(device.state(), scan, field, noise, grid, progress);
  Volume sigma{grid, std::move(variance.samples)};
  for (float& s : sigma.samples)
    s = static_cast<float>(std::sqrt(std::max(0.0, static_cast<double>(s)) * variance.scale));
  return sigma;
}

Grid noise_grid(const Grid& grid, int granularity) {
  Grid coarse = grid;
  for (std::size_t a = 0; a < 3; ++a) {
    coarse.cells[a] = (grid.cells[a] + granularity - 1) / granularity;
    coarse.spacing[a] = grid.spacing[a] * granularity;
  }
  return coarse;
}

}  // namespace vdvr
