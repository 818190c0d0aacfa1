// A folder with scan.json: TIFF frames found by pattern, or an HDF5 file, with the geometry beside them
// (docs/inputs.md). Every name in scan.json is relative to the folder and stays within it. Called by
// read_scan.
#include "host/scan/scan_folder.hpp"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "host/io/natural_order.hpp"
#include "host/io/tiff.hpp"
#include "host/scan/hdf5_scan.hpp"
#include "host/scan/raster_scan.hpp"
#include "host/system/limits.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// scan.json with typed access; every complaint names the member.
class Description {
 public:
  explicit Description(const fs::path& folder) : folder_(folder), path_(folder / "scan.json") {
    std::error_code error;
    std::ifstream file(path_);
    if (!fs::is_regular_file(path_, error) || !file)
      fail("cannot be opened; a folder is a scan by its scan.json");
    // The description of a scan takes lines, not megabytes: a larger file is something else.
    constexpr std::uintmax_t largest = 16u << 20;
    if (fs::file_size(path_, error) > largest) fail("is too large for a description");
    try {
      json_ = json::parse(file, nullptr, true, true);
    } catch (const json::exception& e) {
      fail(fmt::format("is not JSON: {}", e.what()));
    }
    if (!json_.is_object()) fail("is not a JSON object");
    static const std::set<std::string> known{"projections", "hdf5",        "flats",  "darks", "angles",
                                             "angle_range", "use",         "center", "pitch", "unit",
                                             "air_columns", "description", "comment"};
    for (const auto& [key, value] : json_.items())
      if (!known.count(key)) fail(fmt::format("member '{}' is unknown", key));
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw FileError(fmt::format("{}: {}", path_.string(), what));
  }
  bool has(const char* key) const { return json_.contains(key); }
  const fs::path& folder() const { return folder_; }

  std::string text(const char* key) const {
    if (!json_.at(key).is_string()) fail(fmt::format("'{}' must be a string", key));
    return json_.at(key).get<std::string>();
  }
  double number(const char* key) const {
    if (!json_.at(key).is_number()) fail(fmt::format("'{}' must be a number", key));
    return json_.at(key).get<double>();
  }
  std::vector<std::string> texts(const char* key) const {
    if (json_.at(key).is_string()) return {text(key)};
    std::vector<std::string> all;
    if (!json_.at(key).is_array()) fail(fmt::format("'{}' must be a list of strings", key));
    for (const json& item : json_.at(key)) {
      if (!item.is_string()) fail(fmt::format("'{}' must be a list of strings", key));
      all.push_back(item.get<std::string>());
    }
    return all;
  }
  std::vector<double> numbers(const char* key) const {
    std::vector<double> all;
    for (const json& item : json_.at(key)) {
      if (!item.is_number()) fail(fmt::format("'{}' must be a list of numbers", key));
      all.push_back(item.get<double>());
    }
    return all;
  }
  bool is_list(const char* key) const { return json_.at(key).is_array(); }

  std::pair<std::int64_t, std::int64_t> range(const json& item, const char* key) const {
    if (!item.is_array() || item.size() != 2 || !item[0].is_number_integer() || !item[1].is_number_integer())
      fail(fmt::format("'{}' must be [first, last], two integers", key));
    return {item[0].get<std::int64_t>(), item[1].get<std::int64_t>()};
  }
  /// A half-open range within 0 .. count.
  std::pair<std::int64_t, std::int64_t> half_open(const char* key, std::int64_t count,
                                                  const char* what) const {
    const auto [first, end] = range(json_.at(key), key);
    if (!(0 <= first && first < end && end <= count))
      fail(fmt::format("'{}' = [{}, {}) is not a range within the {} {}", key, first, end, count, what));
    return {first, end};
  }
  std::vector<std::pair<std::int64_t, std::int64_t>> ranges(const char* key) const {
    std::vector<std::pair<std::int64_t, std::int64_t>> all;
    if (!json_.at(key).is_array()) fail(fmt::format("'{}' must be a list of [first, last]", key));
    for (const json& item : json_.at(key)) all.push_back(range(item, key));
    return all;
  }

  fs::path inside(const std::string& name, const char* key) const {
    const fs::path relative(name);
    if (name.empty() || relative.is_absolute() ||
        std::find(relative.begin(), relative.end(), "..") != relative.end())
      fail(fmt::format("'{}' names '{}'; names are relative to the folder and stay within it", key, name));
    return folder_ / relative;
  }

  /// Names relative to the folder; * ? [] in the last part, in natural order.
  std::vector<std::string> matches(const char* key) const {
    std::vector<std::string> all;
    for (const std::string& pattern : texts(key)) {
      const fs::path path = inside(pattern, key);
      std::vector<std::string> found;
      if (pattern.find_first_of("*?[") == std::string::npos) {
        found.push_back(pattern);
      } else {
        std::error_code error;
        for (const auto& entry : fs::directory_iterator(path.parent_path(), error))
          if (::fnmatch(path.filename().c_str(), entry.path().filename().c_str(), FNM_PERIOD) == 0)
            found.push_back((fs::path(pattern).parent_path() / entry.path().filename()).generic_string());
        if (error)
          fail(fmt::format("'{}': folder of '{}' cannot be listed: {}", key, pattern, error.message()));
        std::sort(found.begin(), found.end(), natural_less);
      }
      all.insert(all.end(), found.begin(), found.end());
    }
    if (all.empty()) fail(fmt::format("'{}' matches no file", key));
    return all;
  }

 private:
  fs::path folder_, path_;
  json json_;
};

// TIFF files as frames, all of one size.
Frames tiff_frames(const fs::path& folder, const std::vector<std::string>& names, const RawScan& scan) {
  const std::int64_t rows = scan.rows, columns = scan.columns;
  Frames frames;
  frames.count = static_cast<std::int64_t>(names.size());
  const auto list = std::make_shared<const std::vector<std::string>>(names);
  frames.name = [folder, list](std::int64_t k) {
    return (folder / (*list)[static_cast<std::size_t>(k)]).string();
  };
  frames.read = [folder, list, rows, columns](std::int64_t first, std::int64_t n, double* out) {
    for (std::int64_t k = 0; k < n; ++k) {
      const fs::path path = folder / (*list)[static_cast<std::size_t>(first + k)];
      const TiffImage image = read_tiff(path);
      if (image.rows != rows || image.columns != columns)
        throw FileError(fmt::format("{}: {} rows x {} columns, but the first projection has {} x {}",
                                    path.string(), image.rows, image.columns, rows, columns));
      std::copy(image.samples.begin(), image.samples.end(), out + k * rows * columns);
    }
  };
  return frames;
}

void use_file(RawScan& scan, const fs::path& folder, const std::string& name) {
  scan.files.emplace_back(name, folder / name);
}

// Frames of `key`, and their files into the hash.
Frames listed_frames(const Description& about, const char* key, RawScan& scan) {
  if (!about.has(key))
    about.fail(fmt::format(
        "'{}' is missing; counts need flats and darks (line integrals say so with \"description\": "
        "\"line integrals\")",
        key));
  const auto names = about.matches(key);
  for (const auto& name : names) use_file(scan, about.folder(), name);
  return tiff_frames(about.folder(), names, scan);
}

// The angles: a file of numbers or a list, cut by angle_range.
std::vector<double> listed_angles(const Description& about, RawScan& scan) {
  std::vector<double> angles;
  if (about.is_list("angles")) {
    angles = about.numbers("angles");
  } else {
    const std::string name = about.text("angles");
    angles = read_numbers(about.inside(name, "angles"));
    use_file(scan, about.folder(), name);
  }
  if (!about.has("angle_range")) return angles;
  const auto [first, end] =
      about.half_open("angle_range", static_cast<std::int64_t>(angles.size()), "angles");
  return {angles.begin() + first, angles.begin() + end};
}

RawScan open_tiffs(const Description& about, std::uint64_t max_memory_bytes,
                   std::vector<std::string>& names) {
  RawScan scan;
  names = about.matches("projections");
  const TiffImage first = read_tiff(about.folder() / names.front(), max_memory_bytes);
  scan.rows = first.rows;
  scan.columns = first.columns;
  scan.integer = first.is_integer;
  scan.projections = tiff_frames(about.folder(), names, scan);
  scan.counts = true;
  if (about.has("description")) {
    if (about.text("description") != "line integrals")
      about.fail("'description' can only be \"line integrals\"");
    scan.counts = false;
  }
  if (scan.counts) {
    scan.flats = listed_frames(about, "flats", scan);
    scan.darks = listed_frames(about, "darks", scan);
  }
  if (!about.has("angles")) about.fail("'angles' is missing: a file of degrees, or a list");
  return scan;
}

void set_geometry(const Description& about, RawScan& scan) {
  if (about.has("center")) scan.center = about.number("center");
  if (about.has("unit")) scan.unit = about.text("unit");
  if (about.has("pitch")) {
    const auto pitch =
        about.is_list("pitch") ? about.numbers("pitch") : std::vector<double>(2, about.number("pitch"));
    if (pitch.size() != 2) about.fail("'pitch' must be one number or [u, v]");
    scan.pitch_u = pitch[0];
    scan.pitch_v = pitch[1];
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

}  // namespace

RawScan open_scan_folder(const fs::path& folder, std::uint64_t max_memory_bytes) {
  const Description about(folder);
  if (about.has("projections") == about.has("hdf5")) about.fail("needs one of 'projections' and 'hdf5'");
  RawScan scan;
  std::vector<std::string> names;  // of the projections, one file each; empty for HDF5
  if (about.has("hdf5")) {
    for (const char* key : {"flats", "darks", "description"})
      if (about.has(key))
        about.fail(fmt::format("'{}' goes with 'projections'; an HDF5 file brings its own", key));
    const std::string name = about.text("hdf5");
    scan = open_hdf5_scan(about.inside(name, "hdf5"));
    scan.files.clear();
    use_file(scan, folder, name);
  } else {
    scan = open_tiffs(about, max_memory_bytes, names);
  }
  scan.format = "scan.json";
  use_file(scan, folder, "scan.json");
  if (about.has("angles")) scan.theta_deg = listed_angles(about, scan);
  if (!about.has("angles") && about.has("angle_range")) about.fail("'angle_range' needs 'angles'");
  if (static_cast<std::int64_t>(scan.theta_deg.size()) != scan.projections.count)
    about.fail(fmt::format("{} angles for {} projections; 'angle_range' selects entries of 'angles'",
                           scan.theta_deg.size(), scan.projections.count));
  set_geometry(about, scan);
  const std::int64_t count = scan.projections.count;
  const auto [first, end] = about.has("use") ? about.half_open("use", count, "projections")
                                             : std::pair<std::int64_t, std::int64_t>(0, count);
  if (about.has("use")) select_views(scan, first, end);
  for (std::int64_t k = first; !names.empty() && k < end; ++k)
    use_file(scan, folder, names[static_cast<std::size_t>(k)]);
  return scan;
}

}  // namespace vdvr::io
