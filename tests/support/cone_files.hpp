// One cone-beam scan in every form that its geometry is read from. Used by the tests of those forms.
#pragma once

#include <fmt/format.h>

#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "tests/support/scan_files.hpp"

namespace vdvr::support {

using nlohmann::json;

inline constexpr double radians = pi / 180;
inline constexpr int columns = 8, rows = 6, views = 12;

// What forms of one geometry may differ by: some tens of roundings of numbers near the row's largest.
inline constexpr double same_geometry = 1e-12;

// The scan that every form describes: tilted, off centre, pixels of two sides.
struct Setup {
  double sid = 100, sdd = 150, pitch_u = 0.4, pitch_v = 0.5, center = 3.25, row = 2.75, in_deg = 2,
         out_deg = 3;
  double step_deg = 30;

  [[nodiscard]] std::vector<double> angles() const {
    std::vector<double> all;
    for (int k = 0; k < views; ++k) all.push_back(5 + step_deg * k);
    return all;
  }
  [[nodiscard]] json geometry() const {
    return {{"source_to_axis", sid},
            {"source_to_detector", sdd},
            {"pitch", {pitch_u, pitch_v}},
            {"center", center},
            {"row", row},
            {"angles", angles()},
            {"tilt", {in_deg, out_deg}},
            {"sense", 1}};
  }
  // MetaImage fields by which the source's axis hits (center, row).
  [[nodiscard]] std::string place() const {
    return fmt::format("Offset = {:.17g} {:.17g} 0\nElementSpacing = {:.17g} {:.17g} 1\n", -center * pitch_u,
                       -row * pitch_v, pitch_u, pitch_v);
  }
};

using Axes = std::array<Vec3, 3>;  // columns, rows, towards the source; in our world

// RTK's M_R = Rz(-in) Rx(-out) Ry(-gantry) as its documentation multiplies it, its rows turned into our
// world.
inline Axes rotated_axes(double gantry_deg, double in_deg, double out_deg) {
  const double g = -gantry_deg * radians, i = -in_deg * radians, o = -out_deg * radians;
  const double z[3][3] = {{std::cos(i), -std::sin(i), 0}, {std::sin(i), std::cos(i), 0}, {0, 0, 1}};
  const double x[3][3] = {{1, 0, 0}, {0, std::cos(o), -std::sin(o)}, {0, std::sin(o), std::cos(o)}};
  const double y[3][3] = {{std::cos(g), 0, std::sin(g)}, {0, 1, 0}, {-std::sin(g), 0, std::cos(g)}};
  Axes out{};
  for (std::size_t a = 0; a < 3; ++a) {
    double r[3] = {0, 0, 0};
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t d = 0; d < 3; ++d) r[d] += z[a][b] * x[b][c] * y[c][d];
    out[a] = {r[0], -r[2], r[1]};
  }
  return out;
}

inline std::string rtk_text(const Setup& s, const std::string& extra = "", const std::string& in_view = "") {
  std::string text =
      "<?xml version=\"1.0\"?>\n<!DOCTYPE RTKGEOMETRY>\n<RTKThreeDCircularGeometry version=\"3\">\n";
  text += fmt::format(
      "<SourceToIsocenterDistance>{}</SourceToIsocenterDistance>\n"
      "<SourceToDetectorDistance>{}</SourceToDetectorDistance>\n<InPlaneAngle>{}</InPlaneAngle>\n"
      "<OutOfPlaneAngle>{}</OutOfPlaneAngle>\n",
      s.sid, s.sdd, s.in_deg, s.out_deg);
  text += extra;
  for (const double angle : s.angles())
    text += fmt::format("<Projection><GantryAngle>{}</GantryAngle>{}</Projection>\n", angle, in_view);
  return text + "</RTKThreeDCircularGeometry>\n";
}

// ASTRA's vectors: source, middle of the detector, steps of a column and of a row.
inline json astra_vectors(const Setup& s) {
  json all = json::array();
  for (const double angle : s.angles()) {
    const Axes a = rotated_axes(angle, s.in_deg, s.out_deg);
    std::array<Vec3, 4> v{};
    for (std::size_t i = 0; i < 3; ++i) {
      v[0][i] = s.sid * a[2][i];
      v[1][i] = (s.sid - s.sdd) * a[2][i] + (0.5 * (columns - 1) - s.center) * s.pitch_u * a[0][i] +
                (0.5 * (rows - 1) - s.row) * s.pitch_v * a[1][i];
      v[2][i] = s.pitch_u * a[0][i];
      v[3][i] = s.pitch_v * a[1][i];
    }
    json line;
    for (const Vec3& vector : v)
      for (const double value : vector) line.push_back(value);
    all.push_back(line);
  }
  return {{"type", "cone_vec"}, {"DetectorRowCount", rows}, {"DetectorColCount", columns}, {"Vectors", all}};
}

// A folder with a stack; each form's own file beside it.
class Scan {
 public:
  explicit Scan(const Setup& s = {}) : setup(s) {
    static_cast<void>(folder.file("stack.mha", stack_bytes(columns, rows, views, s.place())));
    base = {{"projections", "stack.mha"}, {"description", "line integrals"}};
  }
  Path describe(const json& members) const {
    json whole = base;
    whole.update(members);
    static_cast<void>(folder.file("scan.json", whole.dump()));
    return folder.path();
  }
  ProjectionSet read(const json& members, const ScanOptions& options = {}) const {
    return read_scan(describe(members), options);
  }
  std::string refused(const json& members) const { return refusal(describe(members)); }
  // `geometry` with some members changed; null takes one away.
  json geometry(const json& change = json::object()) const {
    json out = setup.geometry();
    for (const auto& [key, value] : change.items()) {
      if (value.is_null()) out.erase(key);
      else out[key] = value;
    }
    return {{"geometry", out}};
  }

  TemporaryFolder folder;
  Setup setup;
  json base;
};

inline double largest_difference(const ProjectionSet& a, const ProjectionSet& b) {
  BOOST_REQUIRE(a.cone.has_value());
  BOOST_REQUIRE(b.cone.has_value());
  BOOST_REQUIRE(a.cone->views.size() == b.cone->views.size());
  double largest = 0;
  for (std::size_t k = 0; k < a.cone->views.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      double scale = 0;
      for (std::size_t j = 0; j < 4; ++j) scale = std::max(scale, std::abs(a.cone->views[k][i][j]));
      for (std::size_t j = 0; j < 4; ++j)
        largest = std::max(largest, std::abs(a.cone->views[k][i][j] - b.cone->views[k][i][j]) / scale);
    }
  return largest;
}

inline std::vector<double> matrices_of(const ProjectionSet& scan, double scale = 1) {
  std::vector<double> all;
  for (const ViewMatrix& m : scan.cone->views)
    for (const auto& row : m)
      for (const double value : row) all.push_back(scale * value);
  return all;
}

inline bool noted(const ProjectionSet& scan, const std::string& part) {
  const auto& notes = scan.report.notes;
  return std::any_of(notes.begin(), notes.end(),
                     [&](const std::string& n) { return n.find(part) != std::string::npos; });
}

}  // namespace vdvr::support
