#include "apps/vdvr/inputs.hpp"

#include <fmt/format.h>

#include "apps/common/messages.hpp"
#include "apps/common/progress.hpp"
#include "apps/vdvr/crew.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/preparation.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/rows_to_verify.hpp"
#include "vdvr/expert/volume_file.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/verify_file.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {

// --- scans ---

namespace {

// Digits, colons and commas make ranges; anything else that ends so is a file.
bool names_file(const Arguments& args) {
  return args.has("views") && args.text("views").find_first_not_of("0123456789:,") != std::string::npos;
}

/// --darks and --flats: a level, or none.
std::optional<double> level(const Arguments& args, const std::string& name, double if_none) {
  if (!args.has(name)) return {};
  const std::string text = args.text(name);
  return text == "none" ? if_none : parse_number("--" + name, text);
}

}  // namespace

void add_scan(Arguments& args) {
  args.group("Input (what its files do not say, or say otherwise)")
      .value("angles-file", "FILE",
             "for stacks and HDF5 files: angles, one per view; degrees, unless --angle-unit says otherwise")
      .value("angle-unit", "degrees|radians", "of the angles, whatever the file of them says")
      .value("shifts", "none|FILE",
             "how far the sample stood in each view towards higher columns [and rows], in the unit of the "
             "pitch: "
             "numbers, or FILE.h5:/dataset; none: it stood still")
      .value(
          "axis-roll", "DEG",
          "how far the axis of rotation leans in the detector's plane, in degrees, towards higher columns at "
          "higher rows (parallel beam)")
      .value("beam", "cone|parallel",
             "cone: by the distances of an NXtomo file, which is read as parallel beam otherwise")
      .value("entry", "NAME", "the group of an HDF5 file that holds the scan, where there are several")
      .value("views", "RANGES", "the projections used, half-open ranges counted from 0: 0:40,41:90")
      .value("darks", "none|LEVEL", "counts without beam, in place of darks; none: 0")
      .value("flats", "none|LEVEL", "counts of the open beam, in place of flats; none: 1")
      .value("beam-current", "none|DATASET",
             "of an HDF5 file: the beam's current in each frame, by which frames are divided; none: they are "
             "not "
             "(default: where the file has it)")
      .flag("transmission", "values are transmissions: normalised by flats and darks, without -log")
      .flag("line-integrals", "values are line integrals: normalised, and -log was taken")
      .flag("follow-links",
            "read and hash what HDF5 links and virtual datasets name outside the scan's folder too");
}

InputStatement input_statement(const Arguments& args, const InputStatement& stored) {
  InputStatement s = stored;
  if (args.has("entry")) s.entry = args.text("entry");
  if (args.has("views") && !names_file(args)) s.views = view_ranges_of(args.text("views"));
  else if (args.has("views") && !args.has("picture-tolerance"))
    throw InputError(
        fmt::format("--views: '{}' is no list of ranges, such as 0:40,41:90 (files of cameras go with "
                    "--picture-tolerance)",
                    args.text("views")));
  if (const auto dark = level(args, "darks", 0)) s.dark = dark;
  if (const auto flat = level(args, "flats", 1)) s.flat = flat;
  if (args.has("axis-roll")) {
    s.axis_roll_deg = args.number_or("axis-roll", 0);
    require_axis_roll(*s.axis_roll_deg, "--axis-roll");
  }
  if (args.has("beam-current")) s.beam_current = args.text("beam-current");
  if (args.has("transmission") && args.has("line-integrals"))
    throw InputError("--transmission and --line-integrals exclude each other");
  if (args.has("transmission")) s.values = SampleValues::transmission;
  if (args.has("line-integrals")) s.values = SampleValues::line_integrals;
  if (args.has("angle-unit")) {
    s.angle_unit = angle_unit_of(args.text("angle-unit"));
    if (!s.angle_unit)
      throw InputError(
          fmt::format("--angle-unit: '{}'; it must be degrees or radians", args.text("angle-unit")));
  }
  return s;
}

bool has_picture_views(const Arguments& args) {
  return args.has("picture-views") || (args.has("picture-tolerance") && names_file(args));
}

std::string picture_views(const Arguments& args) {
  return args.text(args.has("picture-views") ? "picture-views" : "views");
}

InputKind kind_of(const fs::path& path, const Arguments& args) {
  std::error_code error;
  const fs::path file = file_of_volume(path);
  if (!fs::exists(file, error)) throw FileError(fmt::format("{}: no such file or folder", file.string()));
  if (file != path) return InputKind::volume;
  if (fs::is_directory(path, error)) return is_volume_input(path) ? InputKind::volume : InputKind::scan;
  if (fs::is_regular_file(path, error) && fs::file_size(path, error) == 0)
    throw FileError(fmt::format("{}: is empty", path.string()));
  // A truncated .vdvr no longer looks like one: let its own reader say what is wrong.
  if (path.extension() == ".vdvr" || is_vdvr(path)) return InputKind::certified;
  if (is_volume_input(path) && !args.has("angles-file")) return InputKind::volume;
  return InputKind::scan;
}

void require_certified(const fs::path& path, const Arguments& args) {
  if (kind_of(path, args) != InputKind::certified)
    throw InputError(
        fmt::format("{}: is not a certified volume; `vdvr build` makes one of a scan", path.string()));
}

namespace {

// Warnings go to the terminal whatever is printed there beside them.
void say_warnings(const Understood& understood, const Arguments& args) {
  for (const std::string& warning : understood.warnings)
    say(fmt::format("{}: WARNING: {}\n", args.who(), with_options(warning)));
}

void require_scan(const fs::path& path, const Arguments& args) {
  switch (kind_of(path, args)) {
    case InputKind::certified:
      throw InputError(fmt::format("{}: is a certified volume, not projections", path.string()));
    case InputKind::volume:
      if (std::error_code error; fs::is_directory(path, error))
        throw InputError(fmt::format(
            "{}: holds TIFF slices and no scan.json, so it is a volume; a scan is described by scan.json",
            path.string()));
      throw InputError(
          fmt::format("{}: is a volume; give --angles-file if it is a stack of projections", path.string()));
    case InputKind::scan:
      break;
  }
}

ScanOptions scan_options(const Arguments& args, const FieldOptions& field, std::optional<Beam> beam,
                         const InputStatement& stored) {
  ScanOptions options;
  if (args.has("angles-file")) options.angles_file = args.path("angles-file");
  options.beam = args.has("beam") ? beam_of(args.choice("beam", "parallel")) : beam;
  options.center = field.center;
  if (args.has("shifts")) options.shifts = args.text("shifts");
  options.preparation = field.preparation;
  options.input = input_statement(args, stored);
  options.follow_links = args.has("follow-links");
  const CommonOptions common = common_options(args);
  options.max_memory_bytes = common.max_memory;
  options.scratch = common.scratch;
  return options;
}

ProjectionSet load(const fs::path& path, const Arguments& args, const FieldOptions& field,
                   std::optional<Beam> beam, const InputStatement& stored, const Progress& progress,
                   Understood& understood) {
  require_scan(path, args);
  ProjectionSet scan = read_scan(path, scan_options(args, field, beam, stored), progress, &understood);
  if (!common_options(args).quiet) say_warnings(understood, args);
  return scan;
}

ProjectionSet checked(ProjectionSet scan, const fs::path& path) {
  try {
    for (auto& note : check_scan(scan)) scan.report.notes.push_back(std::move(note));
  } catch (InputError& e) {
    e.add_context(path.string());
    throw;
  }
  return scan;
}

}  // namespace

ProjectionSet load_any_scan(const fs::path& path, const Arguments& args, const FieldOptions& field,
                            const Progress& progress) {
  Understood understood;
  return load(path, args, field, {}, {}, progress, understood);
}

ProjectionSet load_scan(const fs::path& path, const Arguments& args, const FieldOptions& field,
                        const Progress& progress, Understood* understood) {
  Understood own;
  return checked(load(path, args, field, {}, {}, progress, understood ? *understood : own), path);
}

ScanOptions scan_options(const Arguments& args, const FieldOptions& field) {
  return scan_options(args, field, {}, {});
}

namespace {

ProjectionSet load_as_stated(const fs::path& path, const Arguments& args, const Certificate& certificate,
                             const FieldOptions& field, const Progress& progress,
                             Understood* understood_there = nullptr) {
  FieldOptions recorded = field;
  recorded.preparation = as_recorded(field.preparation);
  const auto geometry = noted_geometry(certificate);
  const InputStatement stored = noted_input(certificate);
  std::error_code error;
  // Folders say it themselves; no other file is of cone beam.
  const bool bare = fs::is_regular_file(path, error) && path.filename() != "scan.json";
  Understood own;
  Understood& understood = understood_there ? *understood_there : own;
  ProjectionSet scan = load(path, args, recorded,
                            geometry && geometry->cone && bare ? std::optional(Beam::cone) : std::nullopt,
                            stored, progress, understood);
  if (understood.stated != stored)
    throw MismatchError(
        fmt::format("{}: options state of the input: {}; the volume was built with: {}", path.string(),
                    text_of(understood.stated),
                    stored == InputStatement{} ? "what the file itself says" : text_of(stored)));
  return scan;
}

}  // namespace

ProjectionSet load_certified_scan(const fs::path& path, const Arguments& args, const Certificate& certificate,
                                  const Progress& progress, Understood* understood) {
  return checked(load_as_stated(path, args, certificate, certificate.field, progress, understood), path);
}

ProjectionSet load_scan_to_verify(const fs::path& path, const Arguments& args, const Certificate& certificate,
                                  const Progress& progress) {
  FieldOptions measured = certificate.field;
  measured.preparation.half_acquisition = false;
  measured.preparation.padding = Padding::none;
  measured.preparation.heights = Heights::as_seen;
  const CommonOptions common = common_options(args);
  return checked(rows_to_verify(load_as_stated(path, args, certificate, measured, progress),
                                certificate.field, common.max_memory, common.scratch),
                 path);
}

// --- the noise of scans ---

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

NoiseFound noise_of_scan(const fs::path& path, const Arguments& args, const FieldOptions& field,
                         const ProjectionSet& scan) {
  NoiseFound found;
  found.noise = read_scan_noise(path, scan_options(args, field), scan, noise_options(args), &found.why);
  return found;
}

// --- volumes ---

void add_volume_input(Arguments& args) {
  args.value("nan-as", "V", "of a uniform volume: read samples that are no finite numbers as V");
}

Volume load_volume(const fs::path& path, const Arguments& args) {
  std::optional<double> nan_as;
  if (args.has("nan-as")) nan_as = args.number_or("nan-as", 0);
  return read_volume(path, common_options(args).max_memory, nan_as);
}

VdvrFile open_certified(const fs::path& path, const Arguments& args, bool unverified) {
  const CommonOptions common = common_options(args);
  const std::uint64_t memory = common.max_memory / static_cast<std::uint64_t>(processes_here());
  if (unverified) return read_large_vdvr(path, memory, common.scratch, Altered::report);
  VdvrFile file = read_large_certified(path, memory, common.scratch);
  if (file.seal == Seal::none && !common.quiet)
    say(
        fmt::format("{}: {} is unsealed: of an earlier version, or edited since; `vdvr verify` compares "
                    "its certificate with the projections\n",
                    args.who(), path.string()));
  return file;
}

void check_projections(const fs::path& path, const ProjectionSet& scan, const Certificate& certificate) {
  try {
    check_input(scan, certificate);
  } catch (MismatchError& e) {
    e.add_context(path.string());
    throw;
  }
}

Scene open_scene(const fs::path& path, const Arguments& args, const std::string& method, bool unverified) {
  switch (kind_of(path, args)) {
    case InputKind::certified: {
      VdvrFile file = open_certified(path, args, unverified);
      // Samples on the grid alone are an ordinary volume; the certificate says nothing about their
      // interpolation.
      if (method == "dvr") return {as_mixed(on_grid(file.volume)), std::nullopt, false};
      return {std::move(file.volume), std::move(file.certificate), !unverified};
    }
    case InputKind::volume:
      return {as_mixed(load_volume(path, args)), std::nullopt, false};
    case InputKind::scan:
      break;
  }
  throw InputError(
      fmt::format("{}: is neither a certified volume nor a uniform one (MHA, NRRD, FILE.h5:/dataset, TIFF "
                  "slices); build or reconstruct it first, or draw projections with --method d2vr",
                  path.string()));
}

}  // namespace vdvr::cli
