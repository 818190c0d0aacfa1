// RTK's geometry: nine parameters a view, in degrees and one unit of length, and the matrix they make. RTK's
// axis of rotation is y: its (x, y, z) is our (x, z, -y).
#include "host/scan/open/rtk_geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <pugixml.hpp>
#include <string_view>

#include "host/base/system/casts.hpp"
#include "host/files/io/number_text.hpp"
#include "host/files/io/text_encoding.hpp"
#include "host/scan/geometry/vectors.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// Of circular_parameters: what rounding leaves of a matrix that has parameters.
constexpr double same_matrix = 1e-9;

double dot_rows(const ViewMatrix& m, std::size_t a, std::size_t b) {
  return m[a][0] * m[b][0] + m[a][1] * m[b][1] + m[a][2] * m[b][2];
}

// The largest difference of the matrices, each row relative to its largest entries: those that multiply
// lengths, and the last.
double difference(const ViewMatrix& a, const ViewMatrix& b) {
  double largest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    double scale = 0;
    for (std::size_t j = 0; j < 3; ++j) scale = std::max(scale, std::abs(a[i][j]));
    for (std::size_t j = 0; j < 3; ++j) largest = std::max(largest, std::abs(a[i][j] - b[i][j]) / scale);
    largest = std::max(largest, std::abs(a[i][3] - b[i][3]) / std::max(1.0, std::abs(a[i][3])));
  }
  return largest;
}

// RTK's own matrix, in its world and in lengths on the detector: ours times minus the distance to the axis.
ViewMatrix rtk_matrix(CircularView v) {
  v.pitch_u = v.pitch_v = 1;
  v.center = v.row = 0;
  const ViewMatrix ours = circular_view(v);
  ViewMatrix out{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& row = ours[i];
    out[i] = {-v.source_to_axis * row[0], -v.source_to_axis * row[2], v.source_to_axis * row[1],
              -v.source_to_axis * row[3]};
  }
  return out;
}

}  // namespace

// circular_view backwards. Its rotated axes are the columns' and rows' directions and the normal towards the
// source; their components give the angles, and the source's components along them its place.
CircularView circular_parameters(const ViewMatrix& matrix, double pitch_u, double pitch_v, double center,
                                 double row) {
  const ConeView view = cone_view(matrix);
  const Vec3 back{-view.normal[0], -view.normal[1], -view.normal[2]};
  CircularView out;
  out.theta_rad = std::atan2(back[0], -back[1]);
  out.out_of_plane_rad = std::asin(std::clamp(-back[2], -1.0, 1.0));
  out.in_plane_rad = std::atan2(view.along_u[2], view.along_v[2]);
  out.source_to_axis = view.source_to_axis;
  out.source_to_detector = view.source_to_axis * pitch_u / view.pitch_u;
  out.pitch_u = pitch_u;
  out.pitch_v = pitch_v;
  out.center = center;
  out.row = row;
  out.source_offset_u = dot(view.source, view.along_u);
  out.source_offset_v = dot(view.source, view.along_v);
  // The pixel that the normal through the source hits.
  const double depth2 = dot_rows(matrix, 2, 2), foot_u = dot_rows(matrix, 0, 2) / depth2,
               foot_v = dot_rows(matrix, 1, 2) / depth2;
  out.detector_offset_u = out.source_offset_u - (foot_u - center) * pitch_u;
  out.detector_offset_v = out.source_offset_v - (foot_v - row) * pitch_v;
  if (const double d = difference(circular_view(out), matrix); !(d <= same_matrix))
    throw InputError(fmt::format(
        "no circular parameters give its matrix: off by {:.2g}, {:.0g} is allowed; its rows and columns are "
        "skew or mirrored, or its pixels have other sides than {} x {}",
        d, same_matrix, pitch_u, pitch_v));
  return out;
}

StackPlace centred_stack(std::int64_t columns, std::int64_t rows, double pitch_u, double pitch_v) {
  StackPlace stack;
  stack.spacing = {pitch_u, pitch_v};
  stack.origin = {-0.5 * static_cast<double>(columns - 1) * pitch_u,
                  -0.5 * static_cast<double>(rows - 1) * pitch_v};
  return stack;
}

std::string rtk_geometry_text(const ConeGeometry& cone, const StackPlace& stack) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<!DOCTYPE RTKGEOMETRY>\n<RTKThreeDCircularGeometry version=\"3\">\n";
  for (std::size_t k = 0; k < cone.views.size(); ++k) {
    CircularView v;
    try {
      v = circular_parameters(cone.views[k], stack.spacing[0], stack.spacing[1],
                              -stack.origin[0] / stack.spacing[0], -stack.origin[1] / stack.spacing[1]);
    } catch (InputError& e) {
      e.add_context(fmt::format("view {}", k));
      throw;
    }
    const double gantry = v.theta_rad < 0 ? v.theta_rad + 2 * std::numbers::pi : v.theta_rad;
    text += "  <Projection>\n";
    for (const auto& [name, value] :
         {std::pair<const char*, double>{"SourceToIsocenterDistance", v.source_to_axis},
          {"SourceToDetectorDistance", v.source_to_detector},
          {"GantryAngle", gantry * degrees_per_radian},
          {"OutOfPlaneAngle", v.out_of_plane_rad * degrees_per_radian},
          {"InPlaneAngle", v.in_plane_rad * degrees_per_radian},
          {"SourceOffsetX", v.source_offset_u},
          {"SourceOffsetY", v.source_offset_v},
          {"ProjectionOffsetX", v.detector_offset_u},
          {"ProjectionOffsetY", v.detector_offset_v}})
      text += fmt::format("    <{0}>{1:.17g}</{0}>\n", name, value);
    text += "    <Matrix>\n";
    for (const auto& row : rtk_matrix(v))
      text += fmt::format("      {:.17g} {:.17g} {:.17g} {:.17g}\n", row[0], row[1], row[2], row[3]);
    text += "    </Matrix>\n  </Projection>\n";
  }
  return text + "</RTKThreeDCircularGeometry>\n";
}

namespace io {
namespace {

constexpr std::uintmax_t largest_file = 64u << 20;
constexpr std::ptrdiff_t most_tags = 1 << 20;  // some 40,000 views of RTK's

// RTK's own tolerance, absolute: what fewer digits in a file leave.
constexpr double same_rtk_matrix = 1e-3;

// The parameters as RTK's reader keeps them: what a projection does not give is that of the one before it,
// and 0 at first.
struct Parameters {
  double sid = 0, sdd = 0, gantry = 0, out_of_plane = 0, in_plane = 0, source_x = 0, source_y = 0,
         projection_x = 0, projection_y = 0;
};

double* place_of(Parameters& p, const std::string& name) {
  static const std::map<std::string, double Parameters::*> known{
      {"SourceToIsocenterDistance", &Parameters::sid},
      {"SourceToDetectorDistance", &Parameters::sdd},
      {"GantryAngle", &Parameters::gantry},
      {"Angle", &Parameters::gantry},  // of old files, which RTK reads still
      {"OutOfPlaneAngle", &Parameters::out_of_plane},
      {"InPlaneAngle", &Parameters::in_plane},
      {"SourceOffsetX", &Parameters::source_x},
      {"SourceOffsetY", &Parameters::source_y},
      {"ProjectionOffsetX", &Parameters::projection_x},
      {"ProjectionOffsetY", &Parameters::projection_y}};
  const auto it = known.find(name);
  return it == known.end() ? nullptr : &(p.*(it->second));
}

class RtkReader {
 public:
  RtkReader(std::filesystem::path path, const RasterHeader& header, StackShape stack)
      : path_(std::move(path)), header_(header), stack_(stack) {}

  ConeViews read() {
    const pugi::xml_node root = document();
    if (name_of(root) != "RTKThreeDCircularGeometry")
      fail(root, fmt::format("the root is '{}'; RTKThreeDCircularGeometry is needed", root.name()));
    const std::string_view version = root.attribute("version").value();
    if (version != "2" && version != "3")
      fail(root, fmt::format("version '{}'; 2 and 3 can be read, so write the file again with a newer RTK",
                             version));
    for (const pugi::xml_node& element : root.children()) {
      if (name_of(element) == "Projection") projection(element);
      else parameter(element);
    }
    require_views(path_.string(), "projections described", static_cast<std::int64_t>(out_.views.size()),
                  stack_);
    finish();
    return std::move(out_);
  }

 private:
  [[noreturn]] void fail_at(std::ptrdiff_t offset, const std::string& what) const {
    throw FileError(fmt::format("{}: line {}: {}", path_.string(),
                                1 + std::count(text_.begin(), text_.begin() + offset, '\n'), what));
  }
  [[noreturn]] void fail(const pugi::xml_node& at, const std::string& what) const {
    fail_at(std::max<std::ptrdiff_t>(at.offset_debug(), 0), what);
  }
  // The root. No document type is looked into, and no entity known but the five of the language.
  pugi::xml_node document() {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path_, error))
      throw FileError(path_.string() + ": no such file, or not readable");
    text_ = read_text(path_, "a geometry file", largest_file);
    // RTK writes neither, and a number would end at the first.
    for (const std::string_view odd : {std::string_view("\0", 1), std::string_view("&#")})
      if (const auto at = text_.find(odd); at != std::string::npos)
        fail_at(static_cast<std::ptrdiff_t>(at), "holds a character that is no part of a geometry");
    if (std::count(text_.begin(), text_.end(), '<') > most_tags)
      throw FileError(fmt::format("{}: more than {} tags", path_.string(), most_tags));
    const auto parsed = document_.load_buffer(
        text_.data(), text_.size(), pugi::parse_default | pugi::parse_fragment, pugi::encoding_utf8);
    if (!parsed) fail_at(parsed.offset, fmt::format("{}: not XML, or truncated", parsed.description()));
    const pugi::xml_node root = document_.document_element();
    if (!root) throw FileError(path_.string() + ": not XML, or truncated");
    if (const auto next = root.next_sibling()) fail(next, "something follows the root element");
    if (const auto before = root.previous_sibling()) fail(before, "something stands before the root element");
    return root;
  }
  static std::string name_of(const pugi::xml_node& node) { return node.name(); }
  // What an element holds beside comments; nothing where that is more than one piece of text.
  static std::string text_of(const pugi::xml_node& element) {
    const pugi::xml_node only = element.first_child();
    return only.type() == pugi::node_pcdata && !only.next_sibling() ? only.value() : "";
  }
  double number(const pugi::xml_node& element) const {
    const std::string text = text_of(element);
    const auto value = number_of(text);
    if (!value)
      fail(element,
           fmt::format("{} is '{}', not a number{}", element.name(), text.substr(0, 40), comma_hint(text)));
    return *value;
  }

  void parameter(const pugi::xml_node& element) {
    const std::string name = name_of(element);
    if (double* place = place_of(parameters_, name)) {
      *place = number(element);
    } else if (name == "RadiusCylindricalDetector") {
      if (const double radius = number(element); radius != 0)
        fail(element, fmt::format("RadiusCylindricalDetector is {}; only flat detectors are supported: "
                                  "resample the projections to a plane",
                                  radius));
    } else if (name.starts_with("Collimation")) {
      // RTK writes the largest number of its type where there is no jaw.
      if (const double jaw = number(element); std::abs(jaw) < 1e300)
        fail(element,
             fmt::format("{} is {}; jaws within the detector are not supported: crop the projections", name,
                         jaw));
    } else {
      fail(element, fmt::format("element '{}' is unknown", name));
    }
  }

  void projection(const pugi::xml_node& element) {
    const auto k = static_cast<std::int64_t>(out_.views.size());
    pugi::xml_node matrix;
    for (const pugi::xml_node& child : element.children()) {
      if (name_of(child) == "Matrix") matrix = child;
      else parameter(child);
    }
    const Parameters& p = parameters_;
    if (p.sdd == 0)
      fail(element, fmt::format("view {}: SourceToDetectorDistance is 0, parallel beam: describe the scan by "
                                "'angles' instead of 'rtk_geometry'",
                                k));
    CircularView view;
    view.theta_rad = p.gantry / degrees_per_radian;
    view.source_to_axis = p.sid;
    view.source_to_detector = p.sdd;
    view.in_plane_rad = p.in_plane / degrees_per_radian;
    view.out_of_plane_rad = p.out_of_plane / degrees_per_radian;
    view.source_offset_u = p.source_x;
    view.source_offset_v = p.source_y;
    view.detector_offset_u = p.projection_x;
    view.detector_offset_v = p.projection_y;
    view.pitch_u = header_.spacing[0];
    view.pitch_v = header_.spacing[1];
    view.center = -header_.origin[0] / header_.spacing[0];
    view.row = -header_.origin[1] / header_.spacing[1];
    out_.views.push_back(checked_view(view, path_.string(), k));
    if (matrix) check(matrix, rtk_matrix(view), k);
    // Of all views or of none.
    out_.source_to_detector = k == 0 || out_.source_to_detector == p.sdd ? p.sdd : 0;
  }

  void check(const pugi::xml_node& element, const ViewMatrix& computed, std::int64_t k) const {
    const auto values = numbers_of(text_of(element), 12);
    if (!values || values->size() != 12)
      fail(element, fmt::format("view {}: Matrix must hold 3 x 4 numbers", k));
    for (std::size_t i = 0; i < 12; ++i)
      if (!(std::abs((*values)[i] - computed[i / 4][i % 4]) <= same_rtk_matrix))
        fail(element, fmt::format("view {}: entry [{}][{}] of Matrix is {}, the parameters make it {}: the "
                                  "file contradicts itself, write it again",
                                  k, i / 4, i % 4, (*values)[i], computed[i / 4][i % 4]));
  }

  void finish() {
    out_.center_source = "file";
    out_.unit = header_.unit.empty() ? "mm" : header_.unit;
    out_.notes.emplace_back(
        "RTK's axis of rotation is its y: its point (x, y, z) is (x, -z, y) here, and its gantry angle the "
        "angle of a view");
    if (header_.origin[0] != 0 || header_.origin[1] != 0) return;
    out_.if_at_edge = fmt::format(
        "{}: the stack's origin is 0, so the source's axis hits its first pixel; a centred detector "
        "has the Offset {:g} {:g}",
        header_.file.filename().string(), -stack_.middle_column() * header_.spacing[0],
        -stack_.middle_row() * header_.spacing[1]);
    out_.notes.push_back(out_.if_at_edge);
  }

  std::filesystem::path path_;
  std::string text_;
  pugi::xml_document document_;
  const RasterHeader& header_;
  StackShape stack_;
  Parameters parameters_;
  ConeViews out_;
};

}  // namespace

ConeViews rtk_geometry(const std::filesystem::path& path, const RasterHeader& header,
                       const StackShape& stack) {
  return RtkReader(path, header, stack).read();
}

}  // namespace io
}  // namespace vdvr
