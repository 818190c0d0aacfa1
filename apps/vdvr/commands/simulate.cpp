// vdvr simulate: projections of a phantom or of a volume, as Data Exchange; of cone beam a folder.
#include "vdvr/expert/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/common/output_folder.hpp"
#include "apps/common/progress.hpp"
#include "apps/vdvr/cone.hpp"
#include "apps/vdvr/inputs.hpp"
#include "apps/vdvr/output.hpp"
#include "vdvr/error.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr::cli {
namespace {

void add_options(Arguments& args) {
  args.group("Object")
      .value("phantom", "marschner-lobb|shepp-logan|sphere|foam|FILE.json",
             "a built-in phantom or a list of ellipsoids")
      .value("pores", "N", "of the foam, which --seed places (default 1000)")
      .value("volume", "FILE", "an MHA or NRRD volume, put centrally on the axis");
  args.group("Scan")
      .value("angles", "K", "views (default 74, 202 or 180: as the object's usual set-up)")
      .value("arc", "DEG", "views lie at k * arc / angles (default 180)")
      .value("detector", "UxV", "columns x rows (default 65x65, 129x129, or what the volume needs)")
      .value("pitch", "P[,PV]",
             "world units per column [and per row] (default 1, or the volume's smallest spacing)")
      .value("detector-offset", "S", "columns by which the detector is moved towards higher ones (default 0)")
      .value("shifts", "FILE",
             "how far the object stands in each view towards higher columns [and rows], in world units "
             "(parallel "
             "beam)")
      .value(
          "axis-roll", "DEG",
          "how far the axis leans in the detector's plane, towards higher columns at higher rows (parallel "
          "beam; default 0)")
      .flag("point", "line integrals at the pixel centres")
      .flag("band-limited", "ideal low-pass at the detector's Nyquist frequency (default)")
      .value("noise-sigma", "S", "Gaussian noise, as a fraction of the largest line integral")
      .value(
          "photons", "N0",
          "counts of N0 photons a pixel in the open beam, with 10 flats and 10 darks, as a detector has them")
      .value(
          "flat-runs", "R",
          "of --photons: runs of ten flats, the first before and the last behind all projections (default 1)")
      .value("flat-drift", "D",
             "of --photons: by this share the open beam tilts across the columns, from the first to the last "
             "frame "
             "(default 0)")
      .value(
          "beam-decay", "D",
          "of --photons: the share of its current that the beam loses; the currents are written (default 0)")
      .value("seed", "N", "of the noise, and of a foam (default 1)")
      .value("median", "N", "side of a square median window on the fine detector, odd (default 1: none)")
      .value("gaussian", "SU,SV",
             "standard deviations of a blur on the fine detector, in fine pixels (default none)")
      .value("binning", "N", "fine pixels per detector pixel, both ways (default 1)")
      .value("output,o", "FILE.h5", "the Data Exchange file to write; with --cone a folder");
  args.group("Cone beam")
      .value("cone", "R,D",
             "distances from the source to the axis and to the detector; --arc is then 360 by default, and "
             "--pitch that on the detector")
      .value("tilt", "IN,OUT", "of the detector in its plane and out of it, degrees (default 0,0)")
      .value("sense", "1|-1", "of rotation (default 1)")
      .value("focal-spot", "W", "side of a square source (default 0: a point)")
      .value("supersampling", "N", "rays along each side of a pixel, and of the source (default 1)");
}

/// The object, and the scan that is usual for it; its size follows the detector.
struct Setup {
  std::string name;
  std::optional<Volume> volume;
  int pores = 0;  ///< of a foam
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
    setup.volume = centred(load_volume(setup.name, args));
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
  if (setup.name != "foam") refuse(args, {"pores"}, "is for --phantom foam");
  setup.pores = static_cast<int>(args.integer_or("pores", 1000, 1, 100'000));
  if (setup.name == "marschner-lobb") {
    setup.scan.angles = 74;
    setup.scan.columns = setup.scan.rows = 65;
  } else if (setup.name == "shepp-logan") {
    setup.scan.angles = 202;
  }
  return setup;
}

void apply_cone_options(const Arguments& args, SimulateOptions& scan) {
  const auto distances = args.numbers("cone", 2);
  if (!distances) {
    scan.detector_offset = args.number_or("detector-offset", 0);
    refuse(args, {"tilt", "sense", "focal-spot", "supersampling"}, "goes with --cone");
    return;
  }
  ConeSetup cone;
  cone.source_to_axis = (*distances)[0];
  cone.source_to_detector = (*distances)[1];
  if (!(cone.source_to_axis > 0 && cone.source_to_detector > 0))
    throw InputError(fmt::format("--cone: {} has a distance that is not above 0", args.text("cone")));
  cone.detector_offset = args.number_or("detector-offset", 0);
  if (const auto tilt = args.numbers("tilt", 2)) {
    cone.in_plane_deg = (*tilt)[0];
    cone.out_of_plane_deg = (*tilt)[1];
  }
  cone.sense = args.choice("sense", "1") == "1" ? 1 : -1;
  cone.focal_spot = args.number_or("focal-spot", 0);
  cone.supersampling = static_cast<int>(args.integer_or("supersampling", 1, 1, 16));
  // As seen at the axis the defaults are those of parallel beam.
  scan.arc_deg = 360;
  scan.pitch_u *= cone.source_to_detector / cone.source_to_axis;
  scan.pitch_v *= cone.source_to_detector / cone.source_to_axis;
  scan.cone = cone;
}

void apply_scan_options(const Arguments& args, SimulateOptions& scan) {
  apply_cone_options(args, scan);
  scan.angles = static_cast<int>(args.integer_or("angles", scan.angles, 1, 1 << 20));
  scan.arc_deg = args.positive_or("arc", scan.arc_deg);
  if (const auto size = args.sizes("detector", 2)) {
    scan.columns = (*size)[0];
    scan.rows = (*size)[1];
  }
  if (const auto pitch = args.one_or_two("pitch")) {
    scan.pitch_u = (*pitch)[0];
    scan.pitch_v = (*pitch)[1];
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
  if (args.has("shifts")) {
    if (scan.cone) throw InputError("--shifts: is of parallel beam");
    scan.shifts = read_shifts(args.path("shifts"), scan.angles);
  }
  if (args.has("axis-roll")) {
    if (scan.cone) throw InputError("--axis-roll: is of parallel beam; cone beam has --tilt");
    scan.axis_roll_deg = args.number_or("axis-roll", 0);
    require_axis_roll(scan.axis_roll_deg, "--axis-roll");
  }
  const CommonOptions common = common_options(args);
  scan.max_memory_bytes = common.max_memory;
  scan.scratch = common.scratch;
  scan.seed = static_cast<std::uint64_t>(args.integer_or("seed", 1, 0, std::int64_t{1} << 62));
}

std::optional<PhotonCounts> photon_counts(const Arguments& args, const SimulateOptions& scan) {
  if (!args.has("photons")) {
    refuse(args, {"flat-runs", "flat-drift", "beam-decay"}, "goes with --photons");
    return std::nullopt;
  }
  refuse(args, {"noise-sigma", "median", "gaussian", "binning"},
         "excludes --photons: it counts in the detector's pixels");
  PhotonCounts counts;
  counts.photons = args.positive_or("photons", 0);
  counts.seed = scan.seed;
  counts.flat_runs = args.integer_or("flat-runs", 1, 1, 1 << 20);
  counts.flat_drift = args.number_or("flat-drift", 0);
  counts.beam_decay = args.number_or("beam-decay", 0);
  return counts;
}

/// Refuses what read_scan would call dead. Poisson's variate of a mean m is 0 with a probability of e^-m.
void require_light(const ProjectionSet& scan, double photons) {
  double dark = 0, largest = 0;
  for (const float p : scan.data) {
    dark += std::exp(-photons * std::exp(-static_cast<double>(p)));
    largest = std::max(largest, static_cast<double>(p));
  }
  dark /= static_cast<double>(scan.data.size());
  if (3 * dark < 1) return;
  throw InputError(fmt::format(
      "--photons {:g}: line integrals reach {:.3g}, and {:.0f} % of the pixels would count no photon; take a "
      "smaller --pitch (line integrals of built-in phantoms are multiples of it), an object of smaller "
      "densities, or more photons",
      photons, largest, 100 * dark));
}

/// Built-in phantoms fill the detector: half of its width is 32 sqrt(2) / sqrt(2) pixels for the usual
/// Marschner-Lobb set-up and one unit of Shepp-Logan for its own (docs/phantoms.md).
Phantom phantom_for(Setup& setup) {
  const SimulateOptions& s = setup.scan;
  const double at_axis = s.cone ? s.cone->source_to_axis / s.cone->source_to_detector : 1;
  const double half_u = 0.5 * static_cast<double>(s.columns - 1) * s.pitch_u * at_axis;
  const double half_v = 0.5 * static_cast<double>(s.rows - 1) * s.pitch_v * at_axis;
  if (setup.volume) return volume_phantom(std::move(*setup.volume));
  const std::filesystem::path file(setup.name);
  if (file.extension() == ".json") return read_phantom(file);
  if (setup.name != "marschner-lobb" && setup.name != "shepp-logan" && setup.name != "sphere" &&
      setup.name != "foam")
    throw InputError(fmt::format(
        "--phantom: '{}' is not one of: marschner-lobb, shepp-logan, sphere, foam, FILE.json", setup.name));
  if (!(half_u > 0)) throw InputError(fmt::format("--detector: {} needs at least 2 columns", setup.name));
  if (setup.name == "marschner-lobb") return marschner_lobb(half_u / std::sqrt(2.0));
  if (setup.name == "shepp-logan") return shepp_logan(half_u);
  if (setup.name == "foam")
    return foam(half_u - s.pitch_u, half_v > 0 ? half_v : half_u, setup.pores, s.seed);
  return sphere(0.75 * (half_v > 0 ? std::min(half_u, half_v) : half_u));
}

}  // namespace

int simulate_command(Arguments& args) {
  add_options(args);
  add_volume_input(args);
  add_common(args);
  if (!args.parse()) return 0;
  const CommonOptions common = common_options(args);
  const auto output = args.path("output");
  std::vector<std::filesystem::path> inputs;
  if (args.has("volume")) inputs.push_back(args.path("volume"));
  Setup setup = setup_for(args);
  apply_scan_options(args, setup.scan);
  const std::optional<PhotonCounts> counts = photon_counts(args, setup.scan);
  std::optional<OutputFolder> folder;
  if (setup.scan.cone)
    folder.emplace(output, std::vector<std::string>{"projections.h5", "scan.json"}, common.force);
  else check_output(output, common.force, inputs);

  ProgressLine progress(args.who(), common.quiet);
  const Phantom phantom = phantom_for(setup);
  const ProjectionSet scan = simulate(phantom, setup.scan, progress.callback());
  throw_if_stopped();
  if (counts) require_light(scan, counts->photons);
  if (folder) {
    folder->begin();
    write_cone_scan(output, scan, setup.scan, counts);
  } else if (counts) {
    write_photon_counts(output, scan, *counts);
  } else {
    write_data_exchange(output, scan);
  }
  progress.clear();

  const auto ends = std::minmax_element(scan.data.begin(), scan.data.end());
  Json json = {{"output", output.string()},
               {"object", phantom.name},
               {"geometry", geometry_json(scan.geometry)},
               {"band_limited", setup.scan.band_limited},
               {"noise_sigma", setup.scan.noise_sigma},
               {"photons", counts ? Json(counts->photons) : Json()},
               {"range", {*ends.first, *ends.second}},
               {"notes", scan.report.notes}};
  if (scan.cone) json["cone"] = cone_json(scan);
  print_result(common, json, [&] {
    fmt::print("{}: {} views of {} x {} pixels of {}, line integrals {:.6g} to {:.6g}\n", output.string(),
               scan.geometry.views(), scan.geometry.columns, scan.geometry.rows, phantom.name, *ends.first,
               *ends.second);
    if (scan.cone) print_cone(scan);
    print_notes(scan.report.notes);
  });
  return 0;
}

}  // namespace vdvr::cli
