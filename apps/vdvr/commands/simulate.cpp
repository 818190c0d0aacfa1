// vdvr simulate: projections of a phantom or of a volume, as Data Exchange.
#include "vdvr/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/common/progress.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/volume_file.hpp"

namespace vdvr::cli {
namespace {

void add_options(Arguments& args) {
  args.group("Object")
      .value("phantom", "marschner-lobb|shepp-logan|sphere|FILE.json",
             "a built-in phantom or a list of ellipsoids")
      .value("volume", "FILE", "an MHA or NRRD volume, put centrally on the axis");
  args.group("Scan")
      .value("angles", "K", "views (default 74, 202 or 180: as the object's usual set-up)")
      .value("arc", "DEG", "views lie at k * arc / angles (default 180)")
      .value("detector", "UxV", "columns x rows (default 65x65, 129x129, or what the volume needs)")
      .value("pitch", "P[,PV]",
             "world units per column [and per row] (default 1, or the volume's smallest spacing)")
      .flag("point", "line integrals at the pixel centres")
      .flag("band-limited", "ideal low-pass at the detector's Nyquist frequency (default)")
      .value("noise-sigma", "S", "Gaussian noise, as a fraction of the largest line integral")
      .value("seed", "N", "of the noise (default 1)")
      .value("median", "N", "side of a square median window on the fine detector, odd (default 1: none)")
      .value("gaussian", "SU,SV",
             "standard deviations of a blur on the fine detector, in fine pixels (default none)")
      .value("binning", "N", "fine pixels per detector pixel, both ways (default 1)")
      .value("output,o", "FILE.h5", "the Data Exchange file to write");
}

/// The object, and the scan that is usual for it; its size follows the detector.
struct Setup {
  std::string name;
  std::optional<Volume> volume;
  SimulateOptions scan;
};

Volume centred(Volume volume) {
  for (std::size_t a = 0; a < 3; ++a)
    volume.grid.origin[a] = -0.5 * static_cast<double>(volume.grid.cells[a]) * volume.grid.spacing[a];
  return volume;
}

Setup setup_for(const Arguments& args) {
  if (args.has("phantom") == args.has("volume"))
    throw InputError("give one object: either --phantom or --volume");
  Setup setup;
  if (args.has("volume")) {
    setup.name = args.text("volume");
    setup.volume = centred(read_volume(setup.name, common_options(args).max_memory));
    const Grid& g = setup.volume->grid;
    const double pitch = *std::min_element(g.spacing.begin(), g.spacing.end());
    const double width = std::hypot(static_cast<double>(g.cells[0]) * g.spacing[0],
                                    static_cast<double>(g.cells[1]) * g.spacing[1]);
    setup.scan.pitch_u = setup.scan.pitch_v = pitch;
    setup.scan.columns = static_cast<std::int64_t>(std::ceil(width / pitch)) + 1;
    setup.scan.rows =
        static_cast<std::int64_t>(std::ceil(static_cast<double>(g.cells[2]) * g.spacing[2] / pitch)) + 1;
    setup.scan.unit = g.unit;
    return setup;
  }
  setup.name = args.text("phantom");
  if (setup.name == "marschner-lobb") {
    setup.scan.angles = 74;
    setup.scan.columns = setup.scan.rows = 65;
  } else if (setup.name == "shepp-logan") {
    setup.scan.angles = 202;
  }
  return setup;
}

void apply_scan_options(const Arguments& args, SimulateOptions& scan) {
  scan.angles = static_cast<int>(args.integer_or("angles", scan.angles, 1, 1 << 20));
  scan.arc_deg = args.positive_or("arc", scan.arc_deg);
  if (const auto size = args.sizes("detector", 2)) {
    scan.columns = (*size)[0];
    scan.rows = (*size)[1];
  }
  if (args.has("pitch")) {
    const bool both = args.text("pitch").find(',') != std::string::npos;
    const auto pitch = *args.numbers("pitch", both ? 2 : 1);
    scan.pitch_u = pitch.front();
    scan.pitch_v = pitch.back();
    if (!(scan.pitch_u > 0 && scan.pitch_v > 0))
      throw InputError(fmt::format("--pitch: {} is not above 0", args.text("pitch")));
  }
  if (args.has("point") && args.has("band-limited"))
    throw InputError("give one of --point and --band-limited");
  scan.band_limited = !args.has("point");
  scan.noise_sigma = args.number_or("noise-sigma", 0);
  if (!(scan.noise_sigma >= 0))
    throw InputError(fmt::format("--noise-sigma: {} is below 0", scan.noise_sigma));
  scan.median = static_cast<int>(args.integer_or("median", 1, 0, 255));
  scan.binning = static_cast<int>(args.integer_or("binning", 1, 1, 64));
  if (const auto blur = args.numbers("gaussian", 2)) {
    scan.gaussian_u = (*blur)[0];
    scan.gaussian_v = (*blur)[1];
    if (!(scan.gaussian_u >= 0 && scan.gaussian_v >= 0))
      throw InputError(fmt::format("--gaussian: {} has a part below 0", args.text("gaussian")));
  }
  const CommonOptions common = common_options(args);
  scan.max_memory_bytes = common.max_memory;
  scan.scratch = common.scratch;
  scan.seed = static_cast<std::uint64_t>(args.integer_or("seed", 1, 0, std::int64_t{1} << 62));
}

/// Built-in phantoms fill the detector: half of its width is 32 sqrt(2) / sqrt(2) pixels for the usual
/// Marschner-Lobb set-up and one unit of Shepp-Logan for its own (docs/phantoms.md).
Phantom phantom_for(Setup& setup) {
  const SimulateOptions& s = setup.scan;
  const double half_u = 0.5 * static_cast<double>(s.columns - 1) * s.pitch_u;
  const double half_v = 0.5 * static_cast<double>(s.rows - 1) * s.pitch_v;
  if (setup.volume) return volume_phantom(std::move(*setup.volume));
  const std::filesystem::path file(setup.name);
  if (file.extension() == ".json") return read_phantom(file);
  if (setup.name != "marschner-lobb" && setup.name != "shepp-logan" && setup.name != "sphere")
    throw InputError(fmt::format(
        "--phantom: '{}' is not one of: marschner-lobb, shepp-logan, sphere, FILE.json", setup.name));
  if (!(half_u > 0)) throw InputError(fmt::format("--detector: {} needs at least 2 columns", setup.name));
  if (setup.name == "marschner-lobb") return marschner_lobb(half_u / std::sqrt(2.0));
  if (setup.name == "shepp-logan") return shepp_logan(half_u);
  return sphere(0.75 * (half_v > 0 ? std::min(half_u, half_v) : half_u));
}

}  // namespace

int simulate_command(Arguments& args) {
  add_options(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const auto output = args.path("output");
  std::vector<std::filesystem::path> inputs;
  if (args.has("volume")) inputs.push_back(args.path("volume"));
  check_output(output, common.force, inputs);

  ProgressLine progress(args.who(), common.quiet);
  Setup setup = setup_for(args);
  apply_scan_options(args, setup.scan);
  const Phantom phantom = phantom_for(setup);
  const ProjectionSet scan = simulate(phantom, setup.scan, progress.callback());
  throw_if_stopped();
  write_data_exchange(output, scan);
  progress.clear();

  const auto [lo, hi] = std::minmax_element(scan.data.begin(), scan.data.end());
  const Json json = {{"output", output.string()},
                     {"object", phantom.name},
                     {"geometry", geometry_json(scan.geometry)},
                     {"band_limited", setup.scan.band_limited},
                     {"noise_sigma", setup.scan.noise_sigma},
                     {"range", {*lo, *hi}},
                     {"notes", scan.report.notes}};
  print_result(common, json, [&] {
    fmt::print("{}: {} views of {} x {} pixels of {}, line integrals {:.6g} to {:.6g}\n", output.string(),
               scan.geometry.views(), scan.geometry.columns, scan.geometry.rows, phantom.name, *lo, *hi);
    print_notes(scan.report.notes);
  });
  return 0;
}

}  // namespace vdvr::cli
