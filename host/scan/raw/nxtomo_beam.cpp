// Distances of NXtomo as NeXus defines them: from the sample, along the beam, so that the source's is
// negative; some writers give its amount. See nxtomo_beam.hpp.
#include "host/scan/raw/nxtomo_beam.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "host/base/system/limits.hpp"
#include "host/files/io/length_unit.hpp"
#include "host/files/io/text_encoding.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

using hdf5::Dataset, hdf5::Reader;

constexpr double radians = std::numbers::pi / 180;

// One number of a dataset, which may be a list of equal ones; nothing where the dataset is absent.
std::optional<double> find_number(const Reader& file, const std::string& object) {
  if (!file.is_dataset(object)) return {};
  const Dataset data = file.numeric_dataset(object);
  constexpr std::uint64_t most = 1u << 20;  // a number for each frame, not an image
  const std::uint64_t count = checked_bytes(data.extents(), 1, data.name);
  if (count < 1 || count > most)
    file.refuse(object, fmt::format("shape {}; one number is needed", shape_text(data.extents())));
  const std::vector<double> all = data.read_all();
  for (const double value : all)
    if (!std::isfinite(value)) file.refuse(object, fmt::format("is {}; a finite number is needed", value));
  const auto [low, high] = std::minmax_element(all.begin(), all.end());
  if (*low != *high)
    file.refuse(object,
                fmt::format("varies from {} to {}; one number is needed. Scans whose distances vary are "
                            "described in scan.json by 'matrices'",
                            *low, *high));
  return all.front();
}

// The factor that brings a dataset's lengths to the unit of the pixel sizes: 1 where they are the same.
double to_unit_of(const Reader& file, const std::string& object, const std::string& unit) {
  const std::string own = utf8_of(file.find_text(object, "units").value_or("m"));
  const auto from = metres_exponent(own), to = metres_exponent(unit);
  if (!from) file.refuse(object, fmt::format("units '{}'; m, cm, mm, um or nm are needed", own));
  if (!to)
    file.refuse(object, fmt::format("the pixel sizes have units '{}'; m, cm, mm, um or nm are needed", unit));
  return std::pow(10.0, *from - *to);
}

double needed_length(const Reader& file, const std::string& object, const std::string& what,
                     const std::string& unit) {
  const auto value = find_number(file, object);
  if (!value)
    file.refuse(object,
                fmt::format("is missing; it is {}, which cone beam needs. Where the file does not say it, "
                            "describe the scan in scan.json by 'geometry'",
                            what));
  if (*value == 0) file.refuse(object, fmt::format("is 0; it is {}, which cone beam needs", what));
  return *value * to_unit_of(file, object, unit);
}

// The axis' column or row. nxtomo defines the field as a place on the detector; nabu and tomoscan read what
// ESRF writes as an offset from its middle. The reading is taken that puts the axis where a full or a half
// field of view has it.
std::optional<double> axis_position(const Reader& file, const std::string& object, std::int64_t count,
                                    bool half, const char* what, std::vector<std::string>& notes) {
  const auto value = find_number(file, object);
  if (!value) return {};
  const double middle = 0.5 * static_cast<double>(count - 1), place = *value, offset = middle + *value;
  const auto on_detector = [&](double at) { return at >= -0.5 && at <= static_cast<double>(count) - 0.5; };
  if (!on_detector(place) && !on_detector(offset))
    file.refuse(object,
                fmt::format("is {}, which is neither one of the {} {}s nor an offset from their middle",
                            *value, count, what));
  const bool nearer = std::abs(place - middle) <= std::abs(offset - middle);
  const bool as_place = !on_detector(offset) || (on_detector(place) && nearer != half);
  const double at = as_place ? place : offset;
  notes.push_back(fmt::format(
      "the axis is taken at {} {:g}: {} is {:g}, read as {}; readers differ on that", what, at, object,
      *value, as_place ? std::string("a ") + what : std::string("an offset from the middle")));
  return at;
}

void note_sample_pixels(const Reader& file, const NxtomoGroups& groups, const CircularView& view,
                        const std::string& unit, std::vector<std::string>& notes) {
  const double at_axis = view.pitch_u * view.source_to_axis / view.source_to_detector;
  std::string note = fmt::format(
      "x_pixel_size and y_pixel_size are taken as the sides of a pixel on the detector, {:g} x {:g} {}; at "
      "the axis "
      "{:g} {}",
      view.pitch_u, view.pitch_v, unit, at_axis, unit);
  const std::string object = groups.sample + "/x_pixel_size";
  if (file.is_dataset(object))
    if (const auto value = find_number(file, object))
      note += fmt::format(" ({} says {:g} {})", object, *value * to_unit_of(file, object, unit), unit);
  notes.push_back(note);
}

CircularView view_of(const Reader& file, const NxtomoGroups& groups, const RawScan& scan,
                     std::vector<std::string>& notes) {
  const std::string of_source =
                        groups.source.empty() ? "instrument/source/distance" : groups.source + "/distance",
                    of_detector = groups.detector + "/distance";
  for (const char* name : {"/x_pixel_size", "/y_pixel_size"}) {
    const std::string object = groups.detector + name;
    if (!file.is_dataset(object))
      file.refuse(object, "is missing; cone beam needs the size of the detector's pixels");
  }
  CircularView view;
  const double source =
                   needed_length(file, of_source, "the distance from the source to the sample", scan.unit),
               behind = needed_length(file, of_detector, "the distance from the sample to the detector",
                                      scan.unit);
  if (!(behind > 0))
    file.refuse(of_detector,
                fmt::format("is {:g} {}: the detector would lie before the sample", behind, scan.unit));
  view.source_to_axis = std::abs(source);
  view.source_to_detector = view.source_to_axis + behind;
  view.pitch_u = scan.pitch_u;
  view.pitch_v = scan.pitch_v;
  notes.push_back(
      fmt::format("cone beam by the distances of the file: source to axis {:g} {}, taken from {} = {:g} {} "
                  "whatever its sign; axis to detector {:g} {}",
                  view.source_to_axis, scan.unit, of_source, source, scan.unit, behind, scan.unit));
  return view;
}

void place_axis(const Reader& file, const NxtomoGroups& groups, const RawScan& scan, CircularView& view,
                ConeViews& out) {
  const StackShape stack{scan.projections.count, scan.rows, scan.columns};
  const std::string column = groups.detector + "/x_rotation_axis_pixel_position",
                    older = groups.detector + "/estimated_cor_from_motor",
                    row = groups.detector + "/y_rotation_axis_pixel_position";
  const std::string stated = file.is_dataset(column) ? column : older;
  const bool half = file.is_dataset(stated) && is_half_acquisition(file, groups.detector);
  const auto center = axis_position(file, stated, scan.columns, half, "column", out.notes);
  out.center_source = center ? "file" : "default";
  view.center = center.value_or(stack.middle_column());
  if (!center)
    out.notes.push_back(fmt::format(
        "the axis is assumed at the detector's middle column, {}; `center` moves it", view.center));
  const auto height = axis_position(file, row, scan.rows, false, "row", out.notes);
  view.row = height.value_or(stack.middle_row());
  if (!height)
    out.notes.push_back(
        fmt::format("the source's plane is assumed at the detector's middle row, {}", view.row));
}

}  // namespace

bool is_half_acquisition(const Reader& file, const std::string& detector) {
  const std::string flag = detector + "/half_acquisition", text = detector + "/field_of_view";
  if (file.is_dataset(flag)) return file.flag(flag);
  return file.is_dataset(text) && file.text(text, 64) == "Half";
}

void set_nxtomo_cone(const Reader& file, const NxtomoGroups& groups, RawScan& scan) {
  RawCone cone;
  cone.member = "beam";
  ConeViews& out = cone.geometry;
  CircularView view = view_of(file, groups, scan, out.notes);
  note_sample_pixels(file, groups, view, scan.unit, out.notes);
  place_axis(file, groups, scan, view, out);
  for (std::size_t k = 0; k < scan.theta_deg.size(); ++k) {
    view.theta_rad = scan.theta_deg[k] * radians;
    out.views.push_back(checked_view(view, file.path(), static_cast<std::int64_t>(k)));
  }
  out.unit = scan.unit;
  out.source_to_detector = view.source_to_detector;
  out.notes.emplace_back(
      "sense of rotation assumed: angles grow from x to y (scan.json's 'geometry' with 'sense': -1 turns the "
      "other "
      "way)");
  if (file.is_group(groups.detector + "/transformations"))
    out.notes.push_back(
        groups.detector +
        "/transformations is not read: where it flips the detector, the volume is a mirror image");
  scan.cone = std::move(cone);
  scan.theta_deg.clear();
}

namespace {

// One finite number, in metres; nothing where there is none.
std::optional<double> find_metres(const Reader& file, const std::string& object) {
  if (!file.is_dataset(object)) return {};
  const Dataset data = file.numeric_dataset(object);
  if (checked_bytes(data.extents(), 1, data.name) != 1) return {};
  const auto exponent = metres_exponent(utf8_of(file.find_text(object, "units").value_or("m")));
  const double value = data.read_all()[0];
  if (!exponent || !std::isfinite(value)) return {};
  return std::abs(value) * std::pow(10.0, *exponent);
}

}  // namespace

// A ray that leaves the axis by the fan angle gamma is displaced, at the rim of the object, by R tan(gamma)
// from the parallel ray that it is taken for: R is what the detector sees at the axis, on either side.
void warn_of_magnification(const Reader& file, const NxtomoGroups& groups, RawScan& scan) {
  const auto exponent = metres_exponent(scan.unit);
  if (groups.source.empty() || !scan.pitch_stated || !exponent) return;
  const auto source = find_metres(file, groups.source + "/distance"),
             behind = find_metres(file, groups.detector + "/distance");
  if (!source || !behind || !(*source > 0) || !(*behind > 0)) return;
  const double reach = 0.5 * static_cast<double>(scan.columns) * scan.pitch_u * std::pow(10.0, *exponent),
               magnification = (*source + *behind) / *source;
  const double pixels = reach / magnification * (reach / (*source + *behind)) /
                        (scan.pitch_u * std::pow(10.0, *exponent) / magnification);
  if (!(pixels > 0.25)) return;
  scan.warnings.push_back(fmt::format(
      "read as PARALLEL BEAM, but the file states distances of cone beam: source to sample {:g} m, sample to "
      "detector {:g} m, magnification {:.4g}, which moves rays by up to {:.2g} pixels within the object: is "
      "it a "
      "laboratory scanner? `beam` cone reads it so; `beam` parallel says that this is right",
      *source, *behind, magnification, pixels));
}

}  // namespace vdvr::io
