#include "host/scan/raw/data_exchange.hpp"

#include <fmt/format.h>

#include "host/base/system/limits.hpp"
#include "host/files/io/text_encoding.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

using hdf5::Reader;

// Flats or darks, or why there are none.
void open_reference(const Reader& file, const std::string& object, const char* what, const FrameStack& data,
                    Frames& frames, std::string& none) {
  if (!file.is_dataset(object)) {
    none = fmt::format("{}: {} is missing", file.path(), object);
    return;
  }
  const FrameStack stack = open_frames(file, object, data.axis);
  require_same_detector(data, stack);
  frames = all_frames(stack, what);
}

// When flats were taken, by how many projections came before each, and the current in every frame.
void read_beam_in_time(const Reader& file, const std::string& group, const Hdf5Wanted& wanted,
                       RawScan& scan) {
  BeamInTime& beam = scan.beam_in_time;
  const std::int64_t projections = scan.projections.count, flats = scan.flats.count;
  const std::vector<double> currents =
      read_currents(file, wanted.beam_current, group + "/beam_current", projections + flats,
                    "projections first, then flats", beam.currents);
  if (!currents.empty()) {
    beam.projection_currents = {currents.begin(), currents.begin() + projections};
    beam.flat_currents = {currents.begin() + projections, currents.end()};
  }
  const std::string object = group + "/data_white_at";
  if (!file.is_dataset(object)) return;
  const hdf5::Dataset data = file.numeric_dataset(object);
  if (count_of(data) != flats)
    throw FileError(
        fmt::format("{}: {} places for {} flats; one for each is needed", data.name, count_of(data), flats));
  place_flats(scan, data.read_all(), data.name);
}

}  // namespace

bool is_data_exchange(const Reader& file, const std::string& group) {
  return file.is_dataset(group + "/data") && !file.is_group(group + "/instrument");
}

RawScan open_data_exchange(const Reader& file, const std::string& group, const Hdf5Wanted& wanted) {
  const std::string object = group + "/data";
  RawScan scan;
  scan.format = "data-exchange";
  const FrameStack data = open_frames(file, object, 0);
  if (data.data->shape.size() != 3)
    throw FileError(fmt::format("{}: shape {}; three axes are needed, [angle][v][u]", data.data->name,
                                shape_text(data.data->extents())));
  scan.rows = data.rows;
  scan.columns = data.columns;
  scan.integer = data.data->is_integer();
  scan.projections = all_frames(data, "projection");
  scan.theta_deg = wanted.own_angles
                       ? read_angles(file, group + "/theta", {data.count}, data, wanted.angle_unit)
                       : wanted.angles_deg;
  scan.center = file.find_real(object, "center");
  const auto pitch_u = file.find_real(object, "pitch_u"), pitch_v = file.find_real(object, "pitch_v");
  scan.pitch_u = pitch_u.value_or(1);
  scan.pitch_v = pitch_v.value_or(1);
  scan.pitch_stated = pitch_u && pitch_v;
  if (const auto unit = file.find_text(object, "unit")) scan.unit = utf8_of(*unit);
  // Counts as beamlines write them are described as "transmission": that says nothing of normalisation.
  if (file.find_text(object, "description") == "line integrals") {
    scan.stated = SampleValues::line_integrals;
    scan.values_source = "the attribute description of " + object;
  }
  open_reference(file, group + "/data_white", "flat", data, scan.flats, scan.no_flats);
  open_reference(file, group + "/data_dark", "dark", data, scan.darks, scan.no_darks);
  read_beam_in_time(file, group, wanted, scan);
  if (const std::string shifts = group + "/shifts"; file.is_dataset(shifts)) {
    const hdf5::Dataset list = file.numeric_dataset(shifts);
    if (count_of(list) > 2 * data.count)
      throw FileError(fmt::format("{}: {} numbers for {} projections; one for each is needed, or two",
                                  list.name, count_of(list), data.count));
    state_shifts(scan, list.read_all(), list.name);
  }
  if (const auto roll = file.find_real(object, "axis_roll"))
    state_axis_roll(scan, *roll, fmt::format("{}: {}, axis_roll", file.path(), object));
  return scan;
}

}  // namespace vdvr::io
