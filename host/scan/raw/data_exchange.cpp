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
  return scan;
}

}  // namespace vdvr::io
