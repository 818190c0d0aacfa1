#include "apps/vdvr/measure_scan.hpp"

#include <fmt/format.h>

#include "apps/vdvr/inputs.hpp"

namespace vdvr::cli {

ScanOfFile scan_of_file(const Arguments& args, const Certificate& certificate, const Progress& progress) {
  const auto path = args.path("projections");
  ScanOfFile out;
  Understood understood;
  out.projections = load_certified_scan(path, args, certificate, progress, &understood);
  check_projections(path, out.projections, certificate);
  out.flats = understood.flats;
  const NoiseFound found = noise_of_scan(path, args, certificate.field, out.projections);
  if (found.noise) out.noise = found.noise->model;
  out.source = found.noise ? found.noise->words : found.why;
  return out;
}

std::vector<std::string> mean_of_scan_lines(const MeanOfScan& own, const MeanMeasure& of_volume,
                                            const std::string& source) {
  std::vector<std::string> out{
      fmt::format("field mean     {:.8g}, by the projections: computed, not certified", own.mean)};
  if (!own.sigma) {
    out.push_back("sigma          not known: " + source);
    return out;
  }
  const std::string flats = own.of_flats >= 0.01
                                ? fmt::format("; {:.0f} % of its square are of the flats", 100 * own.of_flats)
                                : "";
  out.push_back(
      fmt::format("sigma          {:.3g} of the field mean, an estimate; the interval's half width is "
                  "{:.3g} of it{}",
                  *own.sigma, 0.5 * of_volume.mean.width() / *own.sigma, flats));
  out.push_back("  noise        " + source);
  return out;
}

}  // namespace vdvr::cli
