#include "apps/vdvr/scan_noise.hpp"

#include "apps/vdvr/inputs.hpp"

namespace vdvr::cli {

void add_noise(Arguments& args) {
  args.group("Noise (an estimate, beside what is certified)")
      .value("photons", "N0",
             "of a pixel in the open beam (default: from repeated flats, or the projections)")
      .value("sigma-p", "S", "the standard deviation of every line integral");
}

NoiseOptions noise_options(const Arguments& args) {
  NoiseOptions options;
  if (args.has("photons")) options.photons = args.positive_or("photons", 0);
  if (args.has("sigma-p")) options.sigma_p = args.positive_or("sigma-p", 0);
  return options;
}

NoiseFound noise_of_scan(const std::filesystem::path& path, const Arguments& args, const FieldOptions& field,
                         const ProjectionSet& scan) {
  NoiseFound found;
  found.noise = read_scan_noise(path, scan_options(args, field), scan, noise_options(args), &found.why);
  return found;
}

}  // namespace vdvr::cli
