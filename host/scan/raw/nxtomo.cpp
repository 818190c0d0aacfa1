#include "host/scan/raw/nxtomo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/files/io/length_unit.hpp"
#include "host/files/io/text_encoding.hpp"
#include "host/scan/raw/nxtomo_beam.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

using hdf5::Dataset, hdf5::Reader;

// A group's child by its usual name, else the first of the NeXus class.
std::string child_of(const Reader& file, const std::string& group, const std::string& nx_class,
                     const std::string& name) {
  if (file.is_group(group + "/" + name)) return group + "/" + name;
  for (const std::string& child : file.members(group))
    if (file.nexus_class(group + "/" + child) == nx_class) return group + "/" + child;
  return "";
}

void read_pixel_size(const Reader& file, const std::string& detector, RawScan& scan) {
  const std::string x = detector + "/x_pixel_size", y = detector + "/y_pixel_size";
  if (!file.is_dataset(x) || !file.is_dataset(y)) return;
  const auto unit_of = [&](const std::string& object) {
    return utf8_of(file.find_text(object, "units").value_or("m"));
  };
  const Dataset size_u = file.numeric_dataset(x), size_v = file.numeric_dataset(y);
  const std::string unit = unit_of(x), other = unit_of(y);
  const auto exponent = metres_exponent(unit), of_other = metres_exponent(other);
  const bool one_unit = unit == other || (exponent && of_other);
  if (count_of(size_u) != 1 || count_of(size_v) != 1 || !one_unit)
    throw FileError(
        fmt::format("{}: x_pixel_size and y_pixel_size must be one number each, in units of length (they are "
                    "in '{}' and '{}')",
                    file.path(), unit, other));
  scan.pitch_u = size_u.read_all()[0];
  scan.pitch_v = size_v.read_all()[0];
  if (unit != other) scan.pitch_v *= std::pow(10.0, *of_other - *exponent);
  scan.unit = unit;
  scan.pitch_stated = true;
}

// --- which frames are what ---

struct KeyedFrames {
  std::array<std::vector<std::int64_t>, 4> of_key;
  std::int64_t alignment = 0;
};

std::vector<double> keys_of(const Reader& file, const std::string& object, const FrameStack& data) {
  const Dataset keys = file.numeric_dataset(object);
  if (count_of(keys) != data.count)
    throw FileError(fmt::format("{}: {} keys for {} frames of {}", keys.name, count_of(keys), data.count,
                                data.data->name));
  return keys.read_all();
}

// Frames taken again after the scan, to see whether the sample moved, are of key 0; image_key_control tells
// them by -1.
KeyedFrames keyed_frames(const Reader& file, const std::string& detector, const FrameStack& data) {
  const std::string object = detector + "/image_key", control = detector + "/image_key_control";
  const std::vector<double> keys = keys_of(file, object, data);
  std::vector<double> controls = keys;
  if (file.is_dataset(control)) controls = keys_of(file, control, data);
  KeyedFrames frames;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (!(keys[k] == -1 || keys[k] == 0 || keys[k] == 1 || keys[k] == 2 || keys[k] == 3))
      file.refuse(object, fmt::format("key {} of frame {}; 0 to 3 are defined", keys[k], k));
    if (keys[k] == -1 || (keys[k] == 0 && controls[k] == -1)) {
      ++frames.alignment;
      continue;
    }
    if (keys[k] == 0 && controls[k] != 0)
      file.refuse(control, fmt::format("is {} for frame {}, which image_key calls a projection (0); mark it "
                                       "in both alike",
                                       controls[k], k));
    frames.of_key[static_cast<std::size_t>(keys[k])].push_back(static_cast<std::int64_t>(k));
  }
  if (frames.of_key[0].empty()) file.refuse(object, "marks no projections (key 0)");
  return frames;
}

void note_left_out(const KeyedFrames& frames, RawScan& scan) {
  if (!frames.of_key[3].empty())
    scan.notes.push_back(fmt::format("{} frames marked invalid were left out", frames.of_key[3].size()));
  if (frames.alignment > 0)
    scan.notes.push_back(
        fmt::format("{} alignment frames (image_key_control -1), taken again after the scan, were left out",
                    frames.alignment));
}

// One angle a frame; or a projection, where the file has no others for it.
std::vector<double> angles_of(const Reader& file, const std::string& object, const KeyedFrames& frames,
                              const FrameStack& data, std::optional<AngleUnit> unit,
                              std::vector<std::string>& notes) {
  const std::vector<std::int64_t>& projections = frames.of_key[0];
  const auto own = static_cast<std::int64_t>(projections.size());
  std::vector<std::int64_t> counts{data.count};
  if (frames.alignment == 0) counts.push_back(own);
  const std::vector<double> all = read_angles(file, object, counts, data, unit);
  if (static_cast<std::int64_t>(all.size()) != data.count) {
    notes.push_back(
        fmt::format("{} has one angle for each of the {} projections, not for each of the {} frames", object,
                    own, data.count));
    return all;
  }
  std::vector<double> angles;
  angles.reserve(projections.size());
  for (const std::int64_t k : projections) angles.push_back(all[static_cast<std::size_t>(k)]);
  return angles;
}

// --- the beam ---

void read_beam_in_time(const Reader& file, const std::string& entry, const KeyedFrames& frames,
                       const FrameStack& data, const std::string& wanted, RawScan& scan) {
  BeamInTime& beam = scan.beam_in_time;
  for (const std::int64_t k : frames.of_key[0]) beam.projections_at.push_back(static_cast<double>(k));
  for (const std::int64_t k : frames.of_key[1]) beam.flats_at.push_back(static_cast<double>(k));
  std::string monitor = child_of(file, entry, "NXmonitor", "control");
  if (monitor.empty()) monitor = entry + "/control";
  const std::vector<double> currents =
      read_currents(file, wanted, monitor + "/data", data.count, "in the order of image_key", beam.currents);
  if (currents.empty()) return;
  for (const std::int64_t k : frames.of_key[0])
    beam.projection_currents.push_back(currents[static_cast<std::size_t>(k)]);
  for (const std::int64_t k : frames.of_key[1])
    beam.flat_currents.push_back(currents[static_cast<std::size_t>(k)]);
}

// --- where the sample was ---

void read_positions(const Reader& file, const std::string& sample, const std::vector<std::int64_t>& frames,
                    const FrameStack& data, RawScan& scan) {
  for (const char* axis : {"x_translation", "y_translation", "z_translation"}) {
    const std::string object = sample + "/" + axis;
    if (!file.is_dataset(object)) continue;
    const Dataset stored = file.numeric_dataset(object);
    const std::int64_t count = count_of(stored), own = scan.projections.count;
    if (count == 1 || count > std::max(data.count, own)) continue;
    std::vector<double> all = stored.read_all();
    const auto [low, high] = std::minmax_element(all.begin(), all.end());
    const bool known = std::all_of(all.begin(), all.end(), [](double x) { return std::isfinite(x); });
    if (known && *low == *high) continue;
    if (!known || (count != data.count && count != own)) {
      scan.warnings.push_back(fmt::format(
          "{} does not say where the sample was in each of the {} projections ({}): it is taken to stand "
          "still",
          object, own, known ? fmt::format("{} values", count) : std::string("a value is not finite")));
      continue;
    }
    SamplePositions positions{object, utf8_of(file.find_text(object, "units").value_or("m")), {}};
    for (std::int64_t k = 0; k < own; ++k)
      positions.at.push_back(
          all[static_cast<std::size_t>(count == data.count ? frames[static_cast<std::size_t>(k)] : k)]);
    scan.positions.push_back(std::move(positions));
  }
}

void note_flips(const Reader& file, const std::string& detector, RawScan& scan) {
  if (file.is_group(detector + "/transformations"))
    scan.notes.push_back(
        detector + "/transformations is not read: where it flips the detector, the volume is a mirror image");
}

}  // namespace

std::vector<TomoEntry> tomo_entries(const Reader& file) {
  constexpr int deepest = 3;
  std::vector<TomoEntry> found;
  std::vector<std::string> level{""};
  for (int depth = 0; depth <= deepest; ++depth) {
    std::vector<std::string> next;
    for (const std::string& group : level) {
      const std::string instrument = child_of(file, group, "NXinstrument", "instrument");
      const std::string detector =
          instrument.empty() ? "" : child_of(file, instrument, "NXdetector", "detector");
      if (!detector.empty() && file.is_dataset(detector + "/data") &&
          file.is_dataset(detector + "/image_key")) {
        found.push_back({group, instrument, detector, depth});
        continue;
      }
      for (const std::string& child : file.members(group.empty() ? "/" : group))
        if (file.is_group(group + "/" + child)) next.push_back(group + "/" + child);
    }
    level = std::move(next);
  }
  return found;
}

RawScan open_nxtomo(const Reader& file, const TomoEntry& where, const Hdf5Wanted& wanted) {
  RawScan scan;
  scan.format = "nxtomo";
  const FrameStack data = open_frames(file, where.detector + "/data", 0);
  scan.rows = data.rows;
  scan.columns = data.columns;
  scan.integer = data.data->is_integer();
  const KeyedFrames frames = keyed_frames(file, where.detector, data);
  std::string sample = child_of(file, where.entry, "NXsample", "sample");
  if (sample.empty()) sample = where.entry + "/sample";
  scan.theta_deg = wanted.own_angles ? angles_of(file, sample + "/rotation_angle", frames, data,
                                                 wanted.angle_unit, scan.notes)
                                     : wanted.angles_deg;
  note_left_out(frames, scan);
  scan.projections = frames_of(data, frames.of_key[0], "projection");
  scan.flats = frames_of(data, frames.of_key[1], "flat");
  scan.darks = frames_of(data, frames.of_key[2], "dark");
  const std::string key = fmt::format("{}: {}/image_key", file.path(), where.detector);
  if (scan.flats.count == 0) scan.no_flats = key + ": marks no flats (key 1)";
  if (scan.darks.count == 0) scan.no_darks = key + ": marks no darks (key 2)";
  read_beam_in_time(file, where.entry, frames, data, wanted.beam_current, scan);
  read_pixel_size(file, where.detector, scan);
  read_positions(file, sample, frames.of_key[0], data, scan);
  const NxtomoGroups groups{where.detector, child_of(file, where.instrument, "NXsource", "source"), sample};
  if (wanted.beam == Beam::cone) {
    set_nxtomo_cone(file, groups, scan);
  } else {
    if (is_half_acquisition(file, where.detector)) scan.half_acquisition = true;
    note_flips(file, where.detector, scan);
    if (!wanted.beam) warn_of_magnification(file, groups, scan);
  }
  return scan;
}

}  // namespace vdvr::io
