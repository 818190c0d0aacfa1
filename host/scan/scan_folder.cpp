// A folder with scan.json: TIFF frames found by pattern, or an HDF5 file, with the geometry beside them
// (docs/inputs.md). Every name in scan.json is relative to the folder and stays within it. Called by
// read_scan.
#include "host/scan/scan_folder.hpp"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <memory>
#include <set>
#include <tuple>

#include "host/geometry/description.hpp"
#include "host/geometry/nikon_geometry.hpp"
#include "host/io/raster_file.hpp"
#include "host/io/tiff.hpp"
#include "host/scan/scan_members.hpp"
#include "host/scan/hdf5_scan.hpp"
#include "host/scan/raster_scan.hpp"
#include "host/system/limits.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

namespace fs = std::filesystem;

std::set<std::string> known_members() {
  std::set<std::string> known{"projections", "hdf5",        "flats",   "darks",      "angles",
                              "angle_range", "use",         "center",  "pitch",      "unit",
                              "air_columns", "description", "comment", "redundancy", "beam"};
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

// Frames of `key`, and their files into the hash.
Frames listed_frames(const Description& about, const char* key, RawScan& scan,
                     std::uint64_t max_memory_bytes) {
  if (!about.has(key))
    about.fail(fmt::format(
        "'{}' is missing; counts need flats and darks (line integrals say so with \"description\": "
        "\"line integrals\")",
        key));
  const auto names = about.matches(key);
  for (const auto& name : names) use_file(scan, about, name);
  return tiff_frames(about, names, scan, open_series(about, names, max_memory_bytes));
}

// Frames that all hold one number: the flats and darks of scanners that give a level for them.
Frames level_frame(double level, const RawScan& scan, const std::string& name) {
  Frames frames;
  frames.count = 1;
  frames.name = [name](std::int64_t) { return name; };
  frames.read = [level, size = scan.rows * scan.columns](std::int64_t, std::int64_t n, double* out) {
    std::fill_n(out, n * size, level);
  };
  return frames;
}

// Flats and darks, unless the values are line integrals.
void set_counts(const Description& about, const std::optional<NikonScan>& nikon, RawScan& scan,
                std::uint64_t max_memory_bytes) {
  scan.counts = true;
  if (about.has("description")) {
    if (about.text("description") != "line integrals")
      about.fail("'description' can only be \"line integrals\"");
    scan.counts = false;
  }
  if (!scan.counts) return;
  if (nikon && !about.has("flats") && !about.has("darks")) {
    scan.flats = level_frame(nikon->white_level, scan, nikon->path.string() + ": WhiteLevel");
    scan.darks = level_frame(0, scan, nikon->path.string() + ": the dark level");
    return;
  }
  scan.flats = listed_frames(about, "flats", scan, max_memory_bytes);
  scan.darks = listed_frames(about, "darks", scan, max_memory_bytes);
}

// `file_of_view`: by view the number of its name.
RawScan open_tiffs(const Description& about, const std::vector<std::string>& names,
                   std::uint64_t max_memory_bytes, std::vector<std::size_t>& file_of_view) {
  RawScan scan;
  const auto series = open_series(about, names, max_memory_bytes);
  const TiffStack& stack = series->stack();
  scan.rows = stack.rows;
  scan.columns = stack.columns;
  scan.integer = stack.is_integer;
  scan.projections = tiff_frames(about, names, scan, series);
  for (std::int64_t k = 0; k < stack.images; ++k) file_of_view.push_back(series->file_of(k));
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

RawScan open_hdf5(const Description& about, bool follow_links, bool cone) {
  for (const char* key : {"flats", "darks", "description"})
    if (about.has(key))
      about.fail(fmt::format("'{}' goes with 'projections'; an HDF5 file brings its own", key));
  const std::string name = about.text("hdf5");
  RawScan scan = open_hdf5_scan(about.inside(name, "hdf5"), about.folder(), follow_links, cone);
  scan.files.front().first = name;  // as scan.json has it
  return scan;
}

void set_geometry(const Description& about, RawScan& scan) {
  if (about.has("center")) scan.center = about.number("center");
  if (about.has("unit")) scan.unit = about.text("unit");
  if (about.has("pitch")) std::tie(scan.pitch_u, scan.pitch_v) = about.pair("pitch");
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

void set_angles(const Description& about, RawScan& scan) {
  if (about.has("redundancy")) about.fail("'redundancy' goes with cone-beam geometry");
  if (about.has("angles")) scan.theta_deg = listed_angles(about, scan);
  else if (about.has("angle_range")) about.fail("'angle_range' needs 'angles'");
  else if (!about.has("hdf5")) about.fail("'angles' is missing: a file of degrees, or a list");
  if (static_cast<std::int64_t>(scan.theta_deg.size()) != scan.projections.count)
    about.fail(fmt::format("{} angles for {} projections; 'angle_range' selects entries of 'angles'",
                           scan.theta_deg.size(), scan.projections.count));
}

}  // namespace

RawScan open_scan_folder(const fs::path& folder, std::uint64_t max_memory_bytes, std::optional<Beam> beam,
                         bool follow_links) {
  const Description about(folder / "scan.json", known_members());
  std::optional<NikonScan> nikon;
  if (about.has("nikon")) nikon = read_nikon(about.inside(about.text("nikon"), "nikon"));
  const bool own_projections = nikon && !about.has("projections") && !about.has("hdf5");
  if (!own_projections && about.has("projections") == about.has("hdf5"))
    about.fail("needs one of 'projections' and 'hdf5'");
  const bool distances = wants_distances(about, beam);
  RawScan scan;
  std::vector<std::string> names;         // of the projections' TIFF files; empty for one file of all
  std::vector<std::size_t> file_of_view;  // a name's number
  if (about.has("hdf5")) {
    scan = open_hdf5(about, follow_links, distances);
  } else {
    names = own_projections ? nikon_projections(*nikon, about) : about.matches("projections");
    const bool stack = names.size() == 1 && is_raster_file(folder / names.front());
    scan = stack ? open_stack(about, names.front(), max_memory_bytes)
                 : open_tiffs(about, names, max_memory_bytes, file_of_view);
    if (stack) names.clear();
    set_counts(about, nikon, scan, max_memory_bytes);
  }
  scan.format = "scan.json";
  use_file(scan, about, "scan.json");
  set_geometry(about, scan);
  if (distances) set_cone(about, "beam", scan);
  else if (const auto kind = cone_kind(about)) set_cone(about, *kind, scan);
  else set_angles(about, scan);
  const std::int64_t count = scan.projections.count;
  const auto [first, end] = about.has("use") ? about.half_open("use", count, "projections")
                                             : std::pair<std::int64_t, std::int64_t>(0, count);
  if (about.has("use")) select_views(scan, first, end);
  // Each file whose views are used, once.
  for (std::int64_t k = first; !names.empty() && k < end; ++k) {
    const std::size_t file = file_of_view[static_cast<std::size_t>(k)];
    if (k == first || file != file_of_view[static_cast<std::size_t>(k - 1)])
      use_file(scan, about, names[file]);
  }
  return scan;
}

}  // namespace vdvr::io
