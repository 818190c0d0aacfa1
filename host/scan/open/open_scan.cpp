#include "host/scan/open/open_scan.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <set>

#include "host/files/hdf5/hdf5_reader.hpp"
#include "host/files/io/length_unit.hpp"
#include "host/files/io/raster_file.hpp"
#include "host/files/io/text_encoding.hpp"
#include "host/scan/open/scan_folder.hpp"
#include "host/scan/raw/hdf5_frames.hpp"
#include "host/scan/raw/hdf5_scan.hpp"
#include "host/scan/raw/raster_scan.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

namespace fs = std::filesystem;

// The signature may follow a user block of 512, 1024, ... bytes (HDF5 File Format Specification, III.A).
bool is_hdf5(const fs::path& path) {
  const std::string signature("\x89HDF\r\n\x1a\n", 8);
  std::ifstream file(path, std::ios::binary);
  std::error_code error;
  const std::uint64_t size = fs::file_size(path, error);
  for (std::uint64_t at = 0; !error && at + signature.size() <= size; at = at == 0 ? 512 : 2 * at) {
    std::string start(signature.size(), '\0');
    file.seekg(static_cast<std::streamoff>(at));
    if (!file.read(start.data(), static_cast<std::streamsize>(start.size()))) return false;
    if (start == signature) return true;
  }
  return false;
}

bool is_json(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  char c = 0;
  file >> std::ws >> c;
  return c == '{' || path.filename() == "scan.json";
}

RawScan open_hdf5(const fs::path& path, const ScanOptions& options) {
  const InputStatement& stated = options.input;
  Hdf5Wanted wanted{stated.entry, options.beam,      !options.angles_file,
                    {},           stated.angle_unit, stated.beam_current};
  if (options.angles_file)
    wanted.angles_deg =
        in_degrees(read_numbers(*options.angles_file), stated.angle_unit.value_or(AngleUnit::degrees));
  RawScan raw = open_hdf5_scan(path, {}, options.follow_links, wanted);
  const auto angles = static_cast<std::int64_t>(wanted.angles_deg.size());
  if (options.angles_file && angles != raw.projections.count)
    throw FileError(fmt::format("{}: {} angles for the {} projections of {}", options.angles_file->string(),
                                angles, raw.projections.count, path.string()));
  if (raw.cone)
    raw.notes.insert(raw.notes.end(), raw.cone->geometry.notes.begin(), raw.cone->geometry.notes.end());
  return raw;
}

RawScan open_files(const fs::path& path, const ScanOptions& options, bool& folder) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status)) throw FileError(path.string() + ": no such file or folder");
  folder = fs::is_directory(status);
  const bool raster = !folder && is_raster_file(path);
  const bool hdf5 = !folder && !raster && is_hdf5(path);
  if (options.angles_file && !raster && !hdf5)
    throw InputError(path.string() +
                     ": an angles file goes with a stack or an HDF5 file; a scan.json has its 'angles'");
  if (!hdf5 && !options.input.entry.empty() && raster)
    throw InputError(path.string() + ": `entry` names a group of an HDF5 file, and this is a stack");
  if (folder) return open_scan_folder(path, options);
  if (!fs::is_regular_file(status)) throw FileError(path.string() + ": is neither a file nor a folder");
  if (fs::file_size(path, error) == 0) throw FileError(path.string() + ": is empty");
  if (hdf5) return open_hdf5(path, options);
  if (raster && options.beam == Beam::cone)
    throw InputError(
        path.string() +
        ": a stack states no distances, so cone beam (`beam`) cannot be read from it; describe the scan "
        "in scan.json by 'geometry'");
  if (raster) {
    if (!options.angles_file)
      throw InputError(path.string() + ": a stack needs its angles; give them with `angles_file`");
    return open_raster_scan(path, *options.angles_file,
                            options.input.angle_unit.value_or(AngleUnit::degrees));
  }
  if (is_json(path)) {
    if (path.filename() != "scan.json")
      throw FileError(path.string() + ": a scan's description is named scan.json");
    folder = true;
    return open_scan_folder(path.has_parent_path() ? path.parent_path() : ".", options);
  }
  throw FileError(path.string() +
                  ": is no scan: not HDF5 (Data Exchange, NXtomo), not a folder with scan.json, not an MHA "
                  "or NRRD stack; or its first bytes are missing");
}

// A description that may name an HDF5 file: by its member, or by a letter of it written as \\u0068.
bool may_name_hdf5(const fs::path& description) {
  std::error_code error;
  if (!fs::is_regular_file(description, error)) return false;
  constexpr std::uintmax_t largest = 16u << 20;  // the reader refuses a larger one
  std::string text(std::min(fs::file_size(description, error), largest), '\0');
  std::ifstream file(description, std::ios::binary);
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text = utf8_of(std::move(text));
  return text.find("hdf5") != std::string::npos || text.find('\\') != std::string::npos;
}

}  // namespace

// FILE of numbers, or FILE.h5:/dataset, whose attribute units counts; "none".
void shifts_by_option(const ScanOptions& options, RawScan& raw) {
  if (options.shifts == "none") {
    raw.shift_u.clear();
    raw.shift_v.clear();
    raw.shifts_source = "`shifts` none";
    return;
  }
  const std::size_t colon = options.shifts.find(":/");
  if (colon == std::string::npos) {
    state_shifts(raw, read_numbers(options.shifts), options.shifts);
    return;
  }
  const hdf5::Reader file(options.shifts.substr(0, colon), hdf5::Links::within_folder);
  const std::string object = options.shifts.substr(colon + 1);
  if (!file.is_dataset(object)) file.refuse(object, "no such dataset, the shifts (`shifts`)");
  const hdf5::Dataset data = file.numeric_dataset(object);
  if (count_of(data) > 2 * raw.projections.count)
    throw FileError(fmt::format("{}: {} numbers for {} projections; one for each is needed, or two",
                                data.name, count_of(data), raw.projections.count));
  std::vector<double> numbers = data.read_all();
  if (const auto unit = file.find_text(object, "units")) {
    const auto from = metres_exponent(utf8_of(*unit)), to = metres_exponent(raw.unit);
    if (utf8_of(*unit) != raw.unit && (!from || !to))
      throw FileError(
          fmt::format("{}: units '{}', and the pitch is in '{}': neither the same nor both lengths",
                      data.name, *unit, raw.unit));
    if (from && to)
      for (double& number : numbers) number *= std::pow(10.0, *from - *to);
  }
  state_shifts(raw, numbers, options.shifts);
}

RawScan open_scan(const fs::path& path, const ScanOptions& options, bool& folder) {
  RawScan raw = open_files(path, options, folder);
  if (!options.shifts.empty()) shifts_by_option(options, raw);
  if (options.input.axis_roll_deg)
    state_axis_roll(raw, *options.input.axis_roll_deg, path.string() + ": `axis_roll`");
  if (!options.input.views.empty()) select_views(raw, options.input.views);
  const std::set<std::string> names(raw.view_files.begin(), raw.view_files.end());
  for (const std::string& name : names) raw.files.emplace_back(name, raw.folder / name);
  return raw;
}

bool holds_hdf5(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return may_name_hdf5(path / "scan.json");
  if (!fs::is_regular_file(path, error)) return false;
  return is_hdf5(path) || (path.filename() == "scan.json" && may_name_hdf5(path));
}

}  // namespace vdvr::io
