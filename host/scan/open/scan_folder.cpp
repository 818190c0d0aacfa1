// A folder with scan.json: TIFF frames found by pattern, or an HDF5 file, with the geometry beside them
// (docs/inputs.md). Every name in scan.json is relative to the folder and stays within it.
#include "host/scan/open/scan_folder.hpp"

#include <fmt/format.h>
#include <fnmatch.h>

#include <memory>
#include <set>
#include <tuple>

#include "host/files/io/raster_file.hpp"
#include "host/files/io/tiff.hpp"
#include "host/scan/geometry/description.hpp"
#include "host/scan/open/circular_geometry.hpp"
#include "host/scan/open/nikon_geometry.hpp"
#include "host/scan/open/scan_members.hpp"
#include "host/scan/raw/hdf5_scan.hpp"
#include "host/scan/raw/raster_scan.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

namespace fs = std::filesystem;

std::set<std::string> known_members() {
  std::set<std::string> known{
      "projections", "hdf5",         "flats",  "darks",    "angles",      "angle_range",
      "use",         "center",       "pitch",  "unit",     "air_columns", "description",
      "comment",     "redundancy",   "beam",   "entry",    "angle_unit",  "half_acquisition",
      "flats_at",    "beam_current", "shifts", "axis_roll"};
  known.insert(cone_kinds.begin(), cone_kinds.end());
  return known;
}

// TIFF files, of one image or several each, as frames of the scan's size.
Frames tiff_frames(const Description& about, const std::vector<std::string>& names, const RawScan& scan,
                   const std::shared_ptr<TiffSeries>& series) {
  const TiffStack& stack = series->stack();
  if (stack.rows != scan.rows || stack.columns != scan.columns)
    throw FileError(fmt::format("{}: {} rows x {} columns, but the first projection has {} x {}",
                                (about.folder() / names.front()).string(), stack.rows, stack.columns,
                                scan.rows, scan.columns));
  Frames frames;
  frames.count = stack.images;
  frames.name = [series](std::int64_t k) { return series->name(k); };
  frames.read = [series, size = scan.rows * scan.columns](std::int64_t first, std::int64_t n, double* out) {
    for (std::int64_t k = 0; k < n; ++k) series->read(first + k, out + k * size);
  };
  return frames;
}

std::shared_ptr<TiffSeries> open_series(const Description& about, const std::vector<std::string>& names,
                                        std::uint64_t max_memory_bytes) {
  std::vector<fs::path> files;
  for (const auto& name : names) files.push_back(about.folder() / name);
  return std::make_shared<TiffSeries>(std::move(files), max_memory_bytes);
}

// MetaImage and NRRD stacks among the files, as they follow each other.
Frames stack_frames(const fs::path& path, const RawScan& scan, std::uint64_t max_memory_bytes) {
  const RawScan stack = open_raster_stack(path, max_memory_bytes);
  if (stack.rows != scan.rows || stack.columns != scan.columns)
    throw FileError(fmt::format("{}: {} rows x {} columns, but the projections have {} x {}", path.string(),
                                stack.rows, stack.columns, scan.rows, scan.columns));
  return stack.projections;
}

// Frames of `flats` or `darks`, TIFF files or one stack, and their files into the hash; or the level that
// stands for them.
void set_reference(const Description& about, const char* key, std::uint64_t max_memory_bytes, RawScan& scan,
                   Frames& frames, std::optional<double>& level) {
  if (about.is_number(key) || about.is_text(key, "none")) {
    level = about.is_number(key) ? about.number(key) : key == std::string("flats") ? 1.0 : 0.0;
    frames = level_frame(*level, scan.rows * scan.columns, fmt::format("'{}', {:g}", key, *level));
    return;
  }
  const auto names = about.matches(key);
  for (const auto& name : names) use_file(scan, about, name);
  const fs::path first = about.folder() / names.front();
  if (names.size() > 1 || !is_raster_file(first)) {
    frames = tiff_frames(about, names, scan, open_series(about, names, max_memory_bytes));
    return;
  }
  frames = stack_frames(first, scan, max_memory_bytes);
  const RasterHeader header = read_raster_header(first);
  if (header.data_file != header.file)
    use_file(scan, about,
             (fs::path(names.front()).parent_path() / header.data_file.filename()).generic_string());
}

// What scan.json says of the values, and its flats and darks. They win over an HDF5 file's.
void set_counts(const Description& about, const std::optional<NikonScan>& nikon,
                std::uint64_t max_memory_bytes, RawScan& scan) {
  if (about.has("description")) {
    scan.stated = sample_values_of(about.text("description"));
    if (!scan.stated)
      about.fail("'description' can only be \"line integrals\", \"transmission\" or \"counts\"");
    scan.values_source = "'description' of scan.json";
  }
  if (scan.stated && scan.stated != SampleValues::counts) {
    if (about.has("flats") || about.has("darks"))
      scan.notes.push_back(fmt::format("'flats' and 'darks' are not used: values are {}, as {} says",
                                       text_of(*scan.stated), scan.values_source));
    return;
  }
  if (nikon && !about.has("flats") && !about.has("darks") && !about.has("hdf5")) {
    const std::int64_t size = scan.rows * scan.columns;
    scan.flats = level_frame(nikon->white_level, size, nikon->path.string() + ": WhiteLevel");
    scan.darks = level_frame(0, size, nikon->path.string() + ": the dark level");
    scan.flat_level = nikon->white_level;
    scan.dark_level = 0;
    return;
  }
  // What the HDF5 file says of its own flats is of others.
  if (about.has("flats")) scan.beam_in_time = {};
  if (about.has("flats")) set_reference(about, "flats", max_memory_bytes, scan, scan.flats, scan.flat_level);
  if (about.has("darks")) set_reference(about, "darks", max_memory_bytes, scan, scan.darks, scan.dark_level);
  const std::string name = (about.folder() / "scan.json").string();
  if (scan.no_flats.empty()) scan.no_flats = name + ": 'flats' is missing";
  if (scan.no_darks.empty()) scan.no_darks = name + ": 'darks' is missing";
}

RawScan open_tiffs(const Description& about, const std::vector<std::string>& names,
                   std::uint64_t max_memory_bytes) {
  RawScan scan;
  const auto series = open_series(about, names, max_memory_bytes);
  const TiffStack& stack = series->stack();
  scan.rows = stack.rows;
  scan.columns = stack.columns;
  scan.integer = stack.is_integer;
  scan.projections = tiff_frames(about, names, scan, series);
  for (std::int64_t k = 0; k < stack.images; ++k) scan.view_files.push_back(names[series->file_of(k)]);
  scan.shared_files = stack.images != static_cast<std::int64_t>(names.size());
  return scan;
}

// One stack that 'projections' names; its files under their names in the folder.
RawScan open_stack(const Description& about, const std::string& name, std::uint64_t max_memory_bytes) {
  RawScan scan = open_raster_stack(about.folder() / name, max_memory_bytes);
  for (auto& [hashed, path] : scan.files) hashed = (fs::path(name).parent_path() / hashed).generic_string();
  return scan;
}

// Whether cone beam is asked for by distances, in scan.json or beside it.
bool wants_distances(const Description& about, std::optional<Beam> beam) {
  const auto kind = cone_kind(about);
  std::optional<Beam> stated;
  if (about.has("beam")) stated = beam_of(about.text("beam"));
  if (about.has("beam") && !stated)
    about.fail(fmt::format("'beam' is \"{}\"; it must be \"cone\" or \"parallel\"", about.text("beam")));
  const std::string name = (about.folder() / "scan.json").string();
  if (kind && stated)
    about.fail(fmt::format("'{}' and 'beam' both describe the geometry; leave one of them out", *kind));
  if (kind && beam)
    throw InputError(fmt::format("{}: '{}' describes the geometry; leave `beam` out", name, *kind));
  if (stated && beam && *stated != *beam)
    throw InputError(
        fmt::format("{}: 'beam' is \"{}\"; `beam` asks for {}", name, text_of(*stated), text_of(*beam)));
  if (stated.value_or(beam.value_or(Beam::parallel)) != Beam::cone) return false;
  if (!about.has("hdf5")) {
    const std::string what =
        "cone beam by distances is read from an NXtomo file ('hdf5'); describe other scans by 'geometry'";
    if (stated) about.fail(what);
    throw InputError(name + ": " + what);
  }
  return true;
}

// Kinds of geometry that bring their own angles; 'geometry' may.
bool brings_angles(const Description& about) {
  const auto kind = cone_kind(about);
  return kind && (*kind != "geometry" || circular_description(about).has("angles"));
}

// By option, else by scan.json. A format that has a unit of its own is not told another.
std::optional<AngleUnit> stated_angle_unit(const Description& about, const ScanOptions& options) {
  std::optional<AngleUnit> unit;
  if (about.has("angle_unit")) {
    unit = angle_unit_of(about.text("angle_unit"));
    if (!unit)
      about.fail(fmt::format("'angle_unit' is \"{}\"; it must be \"degrees\" or \"radians\"",
                             about.text("angle_unit")));
  }
  if (options.input.angle_unit) unit = options.input.angle_unit;
  const auto kind = cone_kind(about);
  if (!unit || !kind || *kind == "geometry") return unit;
  const std::string says =
      fmt::format("the format of '{}' says what its angles are counted in; leave ", *kind);
  if (about.has("angle_unit")) about.fail(says + "'angle_unit' out");
  throw InputError(fmt::format("{}: {}`angle_unit` out", (about.folder() / "scan.json").string(), says));
}

RawScan open_hdf5(const Description& about, const ScanOptions& options, bool cone,
                  std::optional<AngleUnit> unit) {
  Hdf5Wanted wanted;
  wanted.angle_unit = unit;
  wanted.beam_current = options.input.beam_current;
  wanted.entry = options.input.entry;
  if (wanted.entry.empty() && about.has("entry")) wanted.entry = about.text("entry");
  if (cone) wanted.beam = Beam::cone;
  else if (options.beam || about.has("beam") || cone_kind(about)) wanted.beam = Beam::parallel;
  wanted.own_angles = !about.has("angles") && !brings_angles(about);
  RawScan of_angles;
  of_angles.angle_unit = unit.value_or(AngleUnit::degrees);
  if (about.has("angles")) wanted.angles_deg = listed_angles(about, of_angles);
  const std::string name = about.text("hdf5");
  RawScan scan = open_hdf5_scan(about.inside(name, "hdf5"), about.folder(), options.follow_links, wanted);
  scan.files.front().first = name;  // as scan.json has it
  return scan;
}

void set_geometry(const Description& about, RawScan& scan) {
  if (about.has("center")) scan.center = about.number("center");
  if (about.has("half_acquisition")) scan.half_acquisition = about.flag("half_acquisition");
  if (about.has("unit")) scan.unit = about.text("unit");
  if (about.has("pitch")) {
    std::tie(scan.pitch_u, scan.pitch_v) = about.pair("pitch");
    scan.pitch_stated = true;
  }
  if (!about.has("air_columns")) return;
  scan.air_columns = about.ranges("air_columns");
  std::int64_t count = 0;
  for (const auto& [first, last] : scan.air_columns) {
    if (!(0 <= first && first <= last && last < scan.columns))
      about.fail(
          fmt::format("'air_columns' [{}, {}] is not within the {} columns", first, last, scan.columns));
    count += last - first + 1;
  }
  if (count < 2) about.fail("'air_columns' must name at least two columns: a line is fitted through them");
}

// A list of scan.json, or the numbers of a file beside it.
std::vector<double> listed_numbers(const Description& about, const char* key, RawScan& scan) {
  if (about.is_list(key)) return about.numbers(key);
  const std::string name = about.text(key);
  std::vector<double> all = read_numbers(about.inside(name, key));
  use_file(scan, about, name);
  return all;
}

// When flats were taken, and how bright the beam was.
void set_beam_in_time(const Description& about, const InputStatement& stated, RawScan& scan) {
  const std::int64_t projections = scan.projections.count, flats = scan.flats.count;
  for (const char* key : {"flats_at", "beam_current"})
    if (about.has(key) && !about.is_text(key, "none") && (flats == 0 || scan.flat_level))
      about.fail(fmt::format("'{}' needs flats that are images", key));
  if (about.has("flats_at")) {
    const auto places = listed_numbers(about, "flats_at", scan);
    if (std::ssize(places) != flats)
      about.fail(
          fmt::format("'flats_at' has {} numbers for {} flats; one for each is needed: how many "
                      "projections were taken before it",
                      places.size(), flats));
    place_flats(scan, places, (about.folder() / "scan.json").string() + ": 'flats_at'");
  }
  BeamInTime& beam = scan.beam_in_time;
  if (!stated.beam_current.empty() && stated.beam_current != "none" && !about.has("hdf5"))
    throw InputError(fmt::format("{}: `beam_current` names a dataset of an HDF5 file, and there is no 'hdf5'",
                                 (about.folder() / "scan.json").string()));
  if (!about.has("beam_current") || !stated.beam_current.empty()) return;
  beam.projection_currents.clear();
  beam.flat_currents.clear();
  if (about.is_text("beam_current", "none")) return;
  const auto currents = listed_numbers(about, "beam_current", scan);
  if (std::ssize(currents) != projections + flats)
    about.fail(
        fmt::format("'beam_current' has {} numbers for {} projections and {} flats; one for each is "
                    "needed, projections first",
                    currents.size(), projections, flats));
  beam.currents = "'beam_current' of scan.json";
  beam.projection_currents = {currents.begin(), currents.begin() + projections};
  beam.flat_currents = {currents.begin() + projections, currents.end()};
}

// By view a number (columns) or a pair (and rows), as a list or in a file; "none".
void set_shifts(const Description& about, RawScan& scan) {
  if (!about.has("shifts")) return;
  const std::string source = (about.folder() / "scan.json").string() + ": 'shifts'";
  if (about.is_text("shifts", "none")) {
    scan.shift_u.clear();
    scan.shift_v.clear();
    scan.shifts_source = source;
    return;
  }
  state_shifts(scan,
               about.is_table("shifts") ? about.table("shifts", 2) : listed_numbers(about, "shifts", scan),
               source);
}

void set_axis_roll(const Description& about, RawScan& scan) {
  if (about.has("axis_roll"))
    state_axis_roll(scan, about.number("axis_roll"),
                    (about.folder() / "scan.json").string() + ": 'axis_roll'");
}

void set_angles(const Description& about, RawScan& scan) {
  if (about.has("redundancy")) about.fail("'redundancy' goes with cone-beam geometry");
  if (about.has("angles")) scan.theta_deg = listed_angles(about, scan);
  else if (about.has("angle_range")) about.fail("'angle_range' needs 'angles'");
  else if (!about.has("hdf5")) about.fail("'angles' is missing: a file of numbers, or a list");
  if (static_cast<std::int64_t>(scan.theta_deg.size()) != scan.projections.count)
    about.fail(fmt::format("{} angles for {} projections; 'angle_range' selects entries of 'angles'",
                           scan.theta_deg.size(), scan.projections.count));
}

void require_entry_of_hdf5(const Description& about, const ScanOptions& options) {
  const std::string what = "names a group of an HDF5 file, and there is no 'hdf5'";
  if (about.has("hdf5")) return;
  if (about.has("entry")) about.fail("'entry' " + what);
  if (!options.input.entry.empty())
    throw InputError(fmt::format("{}: `entry` {}", (about.folder() / "scan.json").string(), what));
}

void use_views(const Description& about, RawScan& scan) {
  ViewRanges ranges = about.one_or_more_ranges("use");
  try {
    select_views(scan, ranges);
  } catch (const InputError& e) {
    about.fail(fmt::format("'use': {}", e.what()));
  }
}

}  // namespace

RawScan open_scan_folder(const fs::path& folder, const ScanOptions& options) {
  const Description about(folder / "scan.json", known_members());
  std::optional<NikonScan> nikon;
  if (about.has("nikon")) nikon = read_nikon(about.inside(about.text("nikon"), "nikon"));
  const bool own_projections = nikon && !about.has("projections") && !about.has("hdf5");
  if (!own_projections && about.has("projections") == about.has("hdf5"))
    about.fail("needs one of 'projections' and 'hdf5'");
  const bool distances = wants_distances(about, options.beam);
  require_entry_of_hdf5(about, options);
  const auto angle_unit = stated_angle_unit(about, options);
  RawScan scan;
  if (about.has("hdf5")) {
    scan = open_hdf5(about, options, distances, angle_unit);
  } else {
    const auto names = own_projections ? nikon_projections(*nikon, about) : about.matches("projections");
    const bool stack = names.size() == 1 && is_raster_file(folder / names.front());
    scan = stack ? open_stack(about, names.front(), options.max_memory_bytes)
                 : open_tiffs(about, names, options.max_memory_bytes);
  }
  set_counts(about, nikon, options.max_memory_bytes, scan);
  scan.format = "scan.json";
  scan.folder = folder;
  scan.angle_unit = angle_unit.value_or(AngleUnit::degrees);
  use_file(scan, about, "scan.json");
  set_beam_in_time(about, options.input, scan);
  set_geometry(about, scan);
  if (distances) set_cone(about, "beam", scan);
  else if (const auto kind = cone_kind(about)) set_cone(about, *kind, scan);
  else set_angles(about, scan);
  set_shifts(about, scan);
  set_axis_roll(about, scan);
  // Views that options choose are chosen among all.
  if (about.has("use") && options.input.views.empty()) use_views(about, scan);
  return scan;
}

}  // namespace vdvr::io
