// Scans in HDF5. Data Exchange (De Carlo et al. 2014): /exchange/data, data_white, data_dark, theta. NXtomo
// (NeXus): instrument/detector/data and image_key (0 projection, 1 flat, 2 dark, 3 invalid),
// sample/rotation_angle. Layout [angle][v][u], or [v][angle][u] where an `axes` attribute puts the angle
// second (sinogram order). Called by read_scan.
#include "host/scan/hdf5_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "host/hdf5/hdf5_reader.hpp"
#include "host/scan/nxtomo_beam.hpp"
#include "host/system/limits.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

using hdf5::Dataset, hdf5::Reader;
using DatasetPointer = std::shared_ptr<const Dataset>;

// The axis of the angles by the names in `axes`, "theta:y:x" or one string per axis; -1 when they do not say.
int angle_axis(const Reader& file, const std::string& object) {
  std::vector<std::string> names = file.find_texts(object, "axes");
  if (names.size() == 1) {
    std::string text = names[0];
    std::replace_if(
        text.begin(), text.end(), [](char c) { return std::string(",[] ").find(c) != std::string::npos; },
        ':');
    names.clear();
    for (std::size_t start = 0; start < text.size();) {
      const std::size_t end = std::min(text.find(':', start), text.size());
      if (end > start) names.push_back(text.substr(start, end - start));
      start = end + 1;
    }
  }
  for (std::size_t a = 0; a < names.size(); ++a)
    for (const char* word : {"theta", "angle", "rotation"})
      if (names[a].find(word) != std::string::npos) return static_cast<int>(a);
  return -1;
}

struct Stack {
  DatasetPointer data;
  int axis = 0;  // of the frames
  std::int64_t count = 0, rows = 0, columns = 0;
};

// A dataset as frames. A two-dimensional one is a single frame.
Stack open_stack(const Reader& file, const std::string& object, int fallback_axis) {
  Stack stack;
  stack.data = std::make_shared<const Dataset>(file.numeric_dataset(object));
  const auto shape = stack.data->extents();
  checked_bytes(shape, sizeof(double), stack.data->name);
  if (shape.size() == 2) {
    stack.count = 1;
    stack.rows = shape[0];
    stack.columns = shape[1];
    return stack;
  }
  if (shape.size() != 3)
    throw FileError(fmt::format("{}: shape {}; three axes are needed, [angle][v][u]", stack.data->name,
                                shape_text(shape)));
  const int stated = angle_axis(file, object);
  stack.axis = stated >= 0 ? stated : fallback_axis;
  if (stack.axis > 1)
    throw FileError(
        fmt::format("{}: 'axes' puts the angle on axis {}; it must be the first (projections) or the second "
                    "(sinograms)",
                    stack.data->name, stack.axis));
  const auto axis = static_cast<std::size_t>(stack.axis);
  stack.count = shape[axis];
  stack.rows = shape[1 - axis];
  stack.columns = shape[2];
  return stack;
}

// Frames first .. first + n - 1 of a stack as out[n][row][column].
void read_run(const Stack& stack, std::int64_t first, std::int64_t n, double* out) {
  const std::int64_t rows = stack.rows, columns = stack.columns;
  if (stack.data->shape.size() == 2)
    return stack.data->read(std::array<std::int64_t, 2>{0, 0}, std::array<std::int64_t, 2>{rows, columns},
                            out);
  if (stack.axis == 0)
    return stack.data->read(std::array<std::int64_t, 3>{first, 0, 0},
                            std::array<std::int64_t, 3>{n, rows, columns}, out);
  std::vector<double> sinograms(static_cast<std::size_t>(n * rows * columns));
  stack.data->read(std::array<std::int64_t, 3>{0, first, 0}, std::array<std::int64_t, 3>{rows, n, columns},
                   sinograms.data());
  for (std::int64_t k = 0; k < n; ++k)
    for (std::int64_t v = 0; v < rows; ++v)
      std::copy_n(sinograms.data() + (v * n + k) * columns, columns, out + (k * rows + v) * columns);
}

// Some of a stack's frames, by number, read in runs of neighbours.
Frames frames_of(const Stack& stack, std::vector<std::int64_t> numbers, const std::string& what) {
  Frames frames;
  frames.count = static_cast<std::int64_t>(numbers.size());
  const auto list = std::make_shared<const std::vector<std::int64_t>>(std::move(numbers));
  frames.name = [stack, list, what](std::int64_t k) {
    return fmt::format("{}: {} {} (frame {})", stack.data->name, what, k,
                       (*list)[static_cast<std::size_t>(k)]);
  };
  frames.read = [stack, list](std::int64_t first, std::int64_t n, double* out) {
    const std::int64_t size = stack.rows * stack.columns;
    for (std::int64_t k = 0; k < n;) {
      const std::int64_t start = (*list)[static_cast<std::size_t>(first + k)];
      std::int64_t run = 1;
      while (k + run < n && (*list)[static_cast<std::size_t>(first + k + run)] == start + run) ++run;
      read_run(stack, start, run, out + k * size);
      k += run;
    }
  };
  return frames;
}

// All frames of a stack. No list is made: a damaged header may claim any number of them.
Frames all_frames(const Stack& stack, const std::string& what) {
  Frames frames;
  frames.count = stack.count;
  frames.name = [stack, what](std::int64_t k) { return fmt::format("{}: {} {}", stack.data->name, what, k); };
  frames.read = [stack](std::int64_t first, std::int64_t n, double* out) { read_run(stack, first, n, out); };
  return frames;
}

// How many numbers a list holds; looked at before it is read, since a damaged header may claim any.
std::int64_t count_of(const Dataset& data) {
  return static_cast<std::int64_t>(checked_bytes(data.extents(), 1, data.name));
}

// Angles in degrees by the dataset's units; degrees where it has none, as both formats prescribe.
std::vector<double> read_angles(const Reader& file, const std::string& object, const Stack& frames) {
  const Dataset data = file.numeric_dataset(object);
  if (count_of(data) != frames.count)
    throw FileError(
        fmt::format("{}: {} angles for {} frames of {}; one per frame is needed (data in sinogram order must "
                    "say so with an attribute axes = \"y:theta:x\")",
                    data.name, count_of(data), frames.count, frames.data->name));
  std::vector<double> angles = data.read_all();
  const std::string unit = file.find_text(object, "units").value_or("degrees");
  if (unit.rfind("rad", 0) == 0) {
    for (double& a : angles) a *= 180 / std::numbers::pi;
  } else if (unit.rfind("deg", 0) != 0 && unit != "\u00b0" && !unit.empty()) {
    throw FileError(fmt::format("{}: units '{}'; degrees or radians are needed", data.name, unit));
  }
  return angles;
}

void require_same_detector(const Stack& a, const Stack& b) {
  if (a.rows != b.rows || a.columns != b.columns)
    throw FileError(fmt::format("{}: frames of {} rows x {} columns, but {} has {} x {}", b.data->name,
                                b.rows, b.columns, a.data->name, a.rows, a.columns));
}

RawScan open_data_exchange(const Reader& file) {
  const std::string object = "/exchange/data";
  RawScan scan;
  scan.format = "data-exchange";
  const Stack data = open_stack(file, object, 0);
  if (data.data->shape.size() != 3)
    throw FileError(fmt::format("{}: shape {}; three axes are needed", data.data->name,
                                shape_text(data.data->extents())));
  scan.rows = data.rows;
  scan.columns = data.columns;
  scan.integer = data.data->is_integer();
  scan.projections = all_frames(data, "projection");
  scan.theta_deg = read_angles(file, "/exchange/theta", data);
  scan.center = file.find_real(object, "center");
  scan.pitch_u = file.find_real(object, "pitch_u").value_or(1);
  scan.pitch_v = file.find_real(object, "pitch_v").value_or(1);
  if (const auto unit = file.find_text(object, "unit")) scan.unit = *unit;
  scan.counts = file.find_text(object, "description") != "line integrals";
  if (!scan.counts) return scan;
  for (const char* name : {"/exchange/data_white", "/exchange/data_dark"})
    if (!file.is_dataset(name))
      throw FileError(fmt::format(
          "{}: {} is missing; counts need it (line integrals say so with the attribute description "
          "= \"line integrals\" on {})",
          file.path(), name, object));
  const Stack white = open_stack(file, "/exchange/data_white", data.axis);
  const Stack dark = open_stack(file, "/exchange/data_dark", data.axis);
  require_same_detector(data, white);
  require_same_detector(data, dark);
  scan.flats = all_frames(white, "flat");
  scan.darks = all_frames(dark, "dark");
  return scan;
}

// --- NXtomo ---

// A group's child by its usual name, else the first of the NeXus class.
std::string child_of(const Reader& file, const std::string& group, const std::string& nx_class,
                     const std::string& name) {
  if (file.is_group(group + "/" + name)) return group + "/" + name;
  for (const std::string& child : file.members(group))
    if (file.nexus_class(group + "/" + child) == nx_class) return group + "/" + child;
  return "";
}

struct TomoEntry {
  std::string entry, instrument, detector;
};

// The first group, in order of depth and name, with a detector that has data and image_key. NXtomo entries
// sit at the root or one or two groups below (NXsubentry); deeper is no entry.
std::optional<TomoEntry> find_tomo_entry(const Reader& file) {
  constexpr int deepest = 3;
  std::vector<std::string> level{""};
  for (int depth = 0; depth <= deepest; ++depth) {
    std::vector<std::string> next;
    for (const std::string& group : level) {
      const std::string instrument = child_of(file, group, "NXinstrument", "instrument");
      const std::string detector =
          instrument.empty() ? "" : child_of(file, instrument, "NXdetector", "detector");
      if (!detector.empty() && file.is_dataset(detector + "/data") &&
          file.is_dataset(detector + "/image_key"))
        return TomoEntry{group, instrument, detector};
      for (const std::string& child : file.members(group.empty() ? "/" : group))
        if (file.is_group(group + "/" + child)) next.push_back(group + "/" + child);
    }
    level = std::move(next);
  }
  return std::nullopt;
}

void read_pixel_size(const Reader& file, const std::string& detector, RawScan& scan) {
  const std::string x = detector + "/x_pixel_size", y = detector + "/y_pixel_size";
  if (!file.is_dataset(x) || !file.is_dataset(y)) return;
  const auto unit_of = [&](const std::string& object) {
    return file.find_text(object, "units").value_or("m");
  };
  const Dataset size_u = file.numeric_dataset(x), size_v = file.numeric_dataset(y);
  if (count_of(size_u) != 1 || count_of(size_v) != 1 || unit_of(x) != unit_of(y))
    throw FileError(
        fmt::format("{}: x_pixel_size and y_pixel_size must be one number each, in one unit", file.path()));
  scan.pitch_u = size_u.read_all()[0];
  scan.pitch_v = size_v.read_all()[0];
  scan.unit = unit_of(x);
}

RawScan open_nxtomo(const Reader& file, const TomoEntry& where, bool cone) {
  RawScan scan;
  scan.format = "nxtomo";
  const Stack data = open_stack(file, where.detector + "/data", 0);
  scan.rows = data.rows;
  scan.columns = data.columns;
  scan.integer = data.data->is_integer();
  const Dataset key_data = file.numeric_dataset(where.detector + "/image_key");
  if (count_of(key_data) != data.count)
    throw FileError(fmt::format("{}: {} keys for {} frames of {}", key_data.name, count_of(key_data),
                                data.count, data.data->name));
  const std::vector<double> keys = key_data.read_all();
  std::string sample = child_of(file, where.entry, "NXsample", "sample");
  if (sample.empty()) sample = where.entry + "/sample";
  const std::vector<double> angles = read_angles(file, sample + "/rotation_angle", data);
  std::array<std::vector<std::int64_t>, 4> numbers;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (!(keys[k] == 0 || keys[k] == 1 || keys[k] == 2 || keys[k] == 3))
      throw FileError(fmt::format("{}: key {} of frame {}; 0 to 3 are defined", key_data.name, keys[k], k));
    numbers[static_cast<std::size_t>(keys[k])].push_back(static_cast<std::int64_t>(k));
    if (keys[k] == 0) scan.theta_deg.push_back(angles[k]);
  }
  constexpr std::array<const char*, 3> kinds{"projections", "flats", "darks"};
  for (std::size_t kind = 0; kind < kinds.size(); ++kind)
    if (numbers[kind].empty())
      throw FileError(fmt::format("{}: marks no {} (key {})", key_data.name, kinds[kind], kind));
  if (!numbers[3].empty())
    scan.notes.push_back(fmt::format("{} frames marked invalid were left out", numbers[3].size()));
  scan.projections = frames_of(data, numbers[0], "projection");
  scan.flats = frames_of(data, numbers[1], "flat");
  scan.darks = frames_of(data, numbers[2], "dark");
  read_pixel_size(file, where.detector, scan);
  if (cone)
    set_nxtomo_cone(file, {where.detector, child_of(file, where.instrument, "NXsource", "source"), sample},
                    numbers[0], data.count, scan);
  return scan;
}

}  // namespace

RawScan open_hdf5_scan(const std::filesystem::path& path, const std::filesystem::path& folder,
                       bool follow_links, bool cone) {
  const Reader file(path, follow_links ? hdf5::Links::anywhere : hdf5::Links::within_folder, folder);
  RawScan scan;
  if (cone && file.is_dataset("/exchange/data"))
    throw FileError(
        path.string() +
        ": Data Exchange states no distances, so cone beam (`beam`) cannot be read from it; describe "
        "the scan in scan.json by 'geometry'");
  if (file.is_dataset("/exchange/data")) scan = open_data_exchange(file);
  else if (const auto entry = find_tomo_entry(file)) scan = open_nxtomo(file, *entry, cone);
  else if (file.find_text("/", "format") == "vdvr")
    throw FileError(path.string() + ": is a certified volume, not a scan");
  else
    throw FileError(fmt::format(
        "{}: HDF5, but neither Data Exchange (/exchange/data) nor NXtomo (instrument/detector with data and "
        "image_key){}",
        path.string(),
        file.broken_link().empty() ? "" : "; a link could not be followed: " + file.broken_link()));
  scan.files = file.used();
  if (scan.files.size() > 1)
    scan.notes.push_back(
        fmt::format("its numbers lie in {} HDF5 files; the hash covers all", scan.files.size()));
  return scan;
}

}  // namespace vdvr::io
