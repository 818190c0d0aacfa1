// Cone-beam geometry from files: the same scan written in every form, refusals one by one, RTK's own numbers.
#define BOOST_TEST_MODULE cone_files
#include <fmt/format.h>

#include <boost/test/unit_test.hpp>
#include <optional>
#include <sstream>

#include "host/geometry/nikon_geometry.hpp"
#include "host/io/npy_file.hpp"
#include "host/io/xml_file.hpp"
#include "tests/support/scan_files.hpp"
#include "vdvr/hash.hpp"
#include "vdvr/rtk_geometry.hpp"

using namespace vdvr;
using namespace vdvr::support;
using nlohmann::json;

extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "allocator_may_return_null=1"; }

namespace {

constexpr double radians = pi / 180;
constexpr int columns = 8, rows = 6, views = 12;

// What forms of one geometry may differ by: some tens of roundings of numbers near the row's largest.
constexpr double same_geometry = 1e-12;

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
Axes rotated_axes(double gantry_deg, double in_deg, double out_deg) {
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

std::string rtk_text(const Setup& s, const std::string& extra = "", const std::string& in_view = "") {
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
json astra_vectors(const Setup& s) {
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

double largest_difference(const ProjectionSet& a, const ProjectionSet& b) {
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

std::vector<double> matrices_of(const ProjectionSet& scan, double scale = 1) {
  std::vector<double> all;
  for (const ViewMatrix& m : scan.cone->views)
    for (const auto& row : m)
      for (const double value : row) all.push_back(scale * value);
  return all;
}

bool noted(const ProjectionSet& scan, const std::string& part) {
  const auto& notes = scan.report.notes;
  return std::any_of(notes.begin(), notes.end(),
                     [&](const std::string& n) { return n.find(part) != std::string::npos; });
}

}  // namespace

// --- one scan in every form ---

BOOST_AUTO_TEST_CASE(every_form_of_one_geometry_gives_the_same_matrices) {
  const Scan scan;
  const ProjectionSet plain = scan.read(scan.geometry());
  BOOST_TEST(plain.geometry.views() == views);
  BOOST_TEST(plain.data[0] == 1);
  BOOST_TEST(plain.report.center_source == "file");
  BOOST_TEST(plain.report.source_to_detector == 150);

  static_cast<void>(scan.folder.file("P.npy", npy_bytes(matrices_of(plain, -7), "12, 3, 4")));
  BOOST_TEST(largest_difference(plain, scan.read({{"matrices", "P.npy"}})) <= same_geometry);
  static_cast<void>(scan.folder.file("g.xml", rtk_text(scan.setup)));
  const ProjectionSet rtk = scan.read({{"rtk_geometry", "g.xml"}});
  BOOST_TEST(largest_difference(plain, rtk) <= same_geometry);
  BOOST_TEST(rtk.geometry.unit == "mm");
  BOOST_TEST(rtk.report.source_to_detector == 150);
  static_cast<void>(scan.folder.file("a.json", astra_vectors(scan.setup).dump()));
  BOOST_TEST(largest_difference(plain, scan.read({{"astra", "a.json"}})) <= same_geometry);
}

BOOST_AUTO_TEST_CASE(rows_of_the_matrices_see_points_where_rays_hit_the_detector) {
  const Scan scan;
  const Setup& s = scan.setup;
  const ProjectionSet plain = scan.read(scan.geometry());
  const Axes a = rotated_axes(s.angles()[5], s.in_deg, s.out_deg);
  // A pixel's place in space, and a point on the way to it from the source.
  const double column = 6, row = 1, part = 0.625;
  Vec3 point{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double source = s.sid * a[2][i];
    const double pixel = (s.sid - s.sdd) * a[2][i] + (column - s.center) * s.pitch_u * a[0][i] +
                         (row - s.row) * s.pitch_v * a[1][i];
    point[i] = source + part * (pixel - source);
  }
  const ViewMatrix& m = plain.cone->views[5];
  double n[3];
  for (std::size_t i = 0; i < 3; ++i)
    n[i] = m[i][0] * point[0] + m[i][1] * point[1] + m[i][2] * point[2] + m[i][3];
  BOOST_TEST(std::abs(n[0] / n[2] - column) <= tolerance::fp64_sum(100, columns * s.sdd));
  BOOST_TEST(std::abs(n[1] / n[2] - row) <= tolerance::fp64_sum(100, columns * s.sdd));
  BOOST_TEST(std::abs(n[2] - part * s.sdd / s.sid) <= tolerance::fp64_sum(100, 2));
}

BOOST_AUTO_TEST_CASE(astra_cone_is_a_plain_circle_of_the_detectors_middle) {
  Setup s;
  s.center = 3.5;
  s.row = 2.5;
  s.in_deg = s.out_deg = 0;
  const Scan scan(s);
  std::vector<double> angles = s.angles();
  for (double& angle : angles) angle *= radians;
  const json astra{{"type", "cone"},
                   {"DetectorSpacingX", s.pitch_u},
                   {"DetectorSpacingY", s.pitch_v},
                   {"DetectorRowCount", rows},
                   {"DetectorColCount", columns},
                   {"ProjectionAngles", angles},
                   {"DistanceOriginSource", s.sid},
                   {"DistanceOriginDetector", s.sdd - s.sid}};
  static_cast<void>(scan.folder.file("a.json", astra.dump()));
  const ProjectionSet plain = scan.read({{"astra", "a.json"}});
  BOOST_TEST(largest_difference(plain, scan.read(scan.geometry())) <= same_geometry);
  static_cast<void>(scan.folder.file("v.json", astra_vectors(s).dump()));
  BOOST_TEST(largest_difference(plain, scan.read({{"astra", "v.json"}})) <= same_geometry);
}

BOOST_AUTO_TEST_CASE(matrices_are_read_in_both_orders_and_both_widths) {
  const Scan scan;
  const ProjectionSet plain = scan.read(scan.geometry());
  const std::vector<double> c = matrices_of(plain);
  std::vector<double> f;
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < views; ++k) f.push_back(c[12 * k + 4 * i + j]);
  static_cast<void>(scan.folder.file("P.npy", npy_bytes(f, "12, 3, 4", true)));
  BOOST_TEST(largest_difference(plain, scan.read({{"matrices", "P.npy"}})) <= same_geometry);
  const std::vector<float> narrow(c.begin(), c.end());
  static_cast<void>(scan.folder.file("P.npy", npy_bytes(narrow, "12, 3, 4")));
  BOOST_TEST(largest_difference(plain, scan.read({{"matrices", "P.npy"}})) <= tolerance::unit_roundoff * 4);
}

BOOST_AUTO_TEST_CASE(rtk_documentations_example_is_read_as_its_matrices_say) {
  const TemporaryFolder folder;
  static_cast<void>(
      folder.file("stack.mha", stack_bytes(4, 3, 2, "Offset = -300 -200 0\nElementSpacing = 200 150 1\n")));
  const std::string text = R"(<?xml version="1.0"?>
<!DOCTYPE RTKGEOMETRY>
<RTKThreeDCircularGeometry version="3">
  <SourceToIsocenterDistance>1000</SourceToIsocenterDistance>
  <SourceToDetectorDistance>1536</SourceToDetectorDistance>
  <Projection>
    <GantryAngle>271.847274780273</GantryAngle>
    <ProjectionOffsetX>-117.056503295898</ProjectionOffsetX>
    <ProjectionOffsetY>-1.01195001602173</ProjectionOffsetY>
    <Matrix>
          -166.5093078829                   0   -1531.42837748039   -117056.503295898
        -1.01142410874151               -1536  0.0326206557691505   -1011.95001602173
       -0.999480303105996                   0  0.0322354417240802               -1000
    </Matrix>
  </Projection>
  <Projection>
    <GantryAngle>271.852905273438</GantryAngle>
    <ProjectionOffsetX>-117.056831359863</ProjectionOffsetX>
    <ProjectionOffsetY>-1.01187002658844</ProjectionOffsetY>
    <Matrix>
        -166.660129424325                   0   -1531.41199650136   -117056.831359863
        -1.01134095059569               -1536  0.0327174625589984   -1011.87002658844
       -0.999477130482326                   0  0.0323336611415466               -1000
    </Matrix>
  </Projection>
</RTKThreeDCircularGeometry>
)";
  const double first[3][4] = {{-166.5093078829, 0, -1531.42837748039, -117056.503295898},
                              {-1.01142410874151, -1536, 0.0326206557691505, -1011.95001602173},
                              {-0.999480303105996, 0, 0.0322354417240802, -1000}};
  static_cast<void>(folder.file("g.xml", text));
  static_cast<void>(folder.file(
      "scan.json", R"({"projections": "stack.mha", "description": "line integrals", "rtk_geometry": "g.xml",
                       "redundancy": "full-turn"})"));
  const ProjectionSet scan = read_scan(folder.path());
  const ViewMatrix& m = scan.cone->views[0];
  // RTK's x, y, z is our x, z, -y; a length on its detector is origin + pixel * spacing of the stack.
  const double origin[2] = {-300, -200}, spacing[2] = {200, 150};
  for (std::size_t i = 0; i < 3; ++i)
    for (const auto& [ours, theirs, sign] :
         {std::tuple<std::size_t, std::size_t, double>{0, 0, 1}, {1, 2, -1}, {2, 1, 1}, {3, 3, 1}}) {
      const double length = i < 2 ? m[i][ours] * spacing[i] + origin[i] * m[2][ours] : m[2][ours];
      // Fifteen digits are in the file.
      BOOST_TEST(std::abs(-1000 * length - sign * first[i][theirs]) <= 1e-14 * 1.2e5, i << " " << ours);
    }
  for (const auto& [part, broken, says] : std::vector<std::array<std::string, 3>>{
           {"-166.5093078829", "-166.5113078829", "view 0: entry [0][0] of Matrix"},
           {"-1000\n    </Matrix>\n  </Projection>\n</RTK", "-1000 1\n    </Matrix>\n  </Projection>\n</RTK",
            "3 x 4"},
           {"<Projection>", "<RadiusCylindricalDetector>1536</RadiusCylindricalDetector><Projection>",
            "1536"},
           {"<Projection>", "<Projection><CollimationUInf>20</CollimationUInf>", "CollimationUInf is 20"},
           {"<SourceToDetectorDistance>1536", "<SourceToDetectorDistance>0", "parallel beam"},
           {"<SourceToIsocenterDistance>1000", "<SourceToIsocenterDistance>-1000", "isocentre"},
           {"<SourceToIsocenterDistance>1000", "<SourceToIsocenterDistance>1O00", "not a number"},
           {"version=\"3\"", "version=\"1\"", "version '1'"},
           {"<GantryAngle>271.85", "<HelixAngle>1</HelixAngle><GantryAngle>271.85", "HelixAngle"},
           {"RTKThreeDCircularGeometry version", "Geometry version", "ended by"}}) {
    std::string damaged = text;
    damaged.replace(damaged.find(part), part.size(), broken);
    static_cast<void>(folder.file("g.xml", damaged));
    BOOST_TEST(has(refusal(folder.path()), says));
  }
}

BOOST_AUTO_TEST_CASE(rtk_parameters_hold_until_they_are_given_again_as_in_rtk) {
  const Scan scan;
  static_cast<void>(scan.folder.file("g.xml", rtk_text(scan.setup)));
  const ProjectionSet once = scan.read({{"rtk_geometry", "g.xml"}});
  static_cast<void>(
      scan.folder.file("g.xml", rtk_text(scan.setup, "<CollimationUInf>1e308</CollimationUInf>\n",
                                         "<InPlaneAngle>2</InPlaneAngle><!-- again -->")));
  BOOST_TEST(largest_difference(once, scan.read({{"rtk_geometry", "g.xml"}})) == 0);
}

// Blocks of docs/inputs.md, "Cone beam", as a user copies them: what begins with '{"proj' or '{"nikon' is a
// scan.json, the others are the files that it names.
BOOST_AUTO_TEST_CASE(examples_of_the_documentation_are_read) {
  const std::string text = support::bytes_of(Path(VDVR_SOURCE_DIR) / "docs/inputs.md");
  std::istringstream lines(text.substr(text.find("## Cone beam\n")));
  std::vector<std::string> blocks;
  std::string line;
  for (bool within = false; std::getline(lines, line) && line.rfind("## From counts", 0) != 0;) {
    const bool code = line.rfind("    ", 0) == 0;
    if (code && !within) blocks.emplace_back();
    if (code) blocks.back() += line.substr(4) + "\n";
    within = code;
  }
  const TemporaryFolder folder;
  static_cast<void>(folder.file(
      "stack.mha", stack_bytes(256, 256, 4, "Offset = -25.5 -25.5 0\nElementSpacing = 0.2 0.2 1\n")));
  for (const char* name : {"view_0.tif", "view_1.tif", "view_2.tif", "view_3.tif", "flat.tif", "dark.tif"})
    write_tiff(folder / name, 256, 256,
               std::vector<std::uint16_t>(256 * 256, name[0] == 'f'   ? 60000
                                                     : name[0] == 'd' ? 10
                                                                      : 30000),
               SAMPLEFORMAT_UINT);
  static_cast<void>(folder.file("angles.txt", "0 90 180 270\n"));
  std::optional<ProjectionSet> first;
  std::size_t read = 0;
  const auto check = [&](const std::string& scan) {
    static_cast<void>(folder.file("scan.json", scan));
    const ProjectionSet one = read_scan(folder.path());
    BOOST_TEST(one.cone->views.size() == 4u);
    BOOST_TEST(one.report.source_to_detector ==
               (scan.find("matrices") == std::string::npos && scan.find("vectors.json") == std::string::npos
                    ? 1000
                    : 0));
    if (!first) first = one;
    static_cast<void>(folder.file("P.npy", npy_bytes(matrices_of(*first), "4, 3, 4")));
    ++read;
  };
  std::string scan;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::string& block = blocks[i];
    const bool described = block.rfind("{\"proj", 0) == 0 || block.rfind("{\"nikon", 0) == 0;
    if (described) scan = block;
    // The files that a description names follow it.
    const bool file_follows = i + 1 < blocks.size() && blocks[i + 1].rfind("{\"proj", 0) != 0 &&
                              blocks[i + 1].rfind("{\"nikon", 0) != 0;
    if (described && !file_follows) check(scan);
    if (described) continue;
    if (block.rfind("<RTK", 0) == 0) static_cast<void>(folder.file("geometry.xml", block));
    else if (block.rfind("[XTekCT]", 0) == 0) static_cast<void>(folder.file("scan.xtekct", block));
    else if (block.find("\"mode\"") != std::string::npos) static_cast<void>(folder.file("tigre.json", block));
    else static_cast<void>(folder.file("astra.json", block));
    if (block.find("cone_vec") != std::string::npos) {
      static_cast<void>(folder.file("vectors.json", block));
      scan.replace(scan.find("astra.json"), 10, "vectors.json");
    }
    check(scan);
  }
  BOOST_TEST(read == 7u);
}

// --- what is assumed, and who wins ---

BOOST_AUTO_TEST_CASE(defaults_are_the_detectors_middle_and_are_noted) {
  const Scan scan;
  const ProjectionSet plain = scan.read(
      scan.geometry({{"center", nullptr}, {"row", nullptr}, {"sense", nullptr}, {"tilt", nullptr}}));
  BOOST_TEST(plain.report.center_source == "default");
  BOOST_TEST(std::abs(plain.geometry.center - 3.5) <= same_geometry);
  BOOST_TEST(noted(plain, "sense of rotation assumed"));
  BOOST_TEST(noted(plain, "middle column, 3.5"));
  BOOST_TEST(noted(plain, "middle row, 2.5"));
  BOOST_TEST(std::abs(plain.geometry.pitch_u - 0.4 * 100 / 150) <= same_geometry);
  // At angle theta the source is at R (sin, -cos).
  const double theta = 35 * radians;
  const ConeView view = cone_view(plain.cone->views[1]);
  BOOST_TEST(std::abs(view.source[0] - 100 * std::sin(theta)) <= same_geometry * 100);
  BOOST_TEST(std::abs(view.source[1] + 100 * std::cos(theta)) <= same_geometry * 100);
}

BOOST_AUTO_TEST_CASE(sense_minus_one_turns_the_other_way) {
  const Scan scan;
  std::vector<double> negative = scan.setup.angles();
  for (double& a : negative) a = -a;
  BOOST_TEST(largest_difference(scan.read(scan.geometry({{"sense", -1}})),
                                scan.read(scan.geometry({{"angles", negative}}))) == 0);
}

BOOST_AUTO_TEST_CASE(offset_of_the_detector_moves_the_axis_to_lower_columns) {
  const Scan scan;
  BOOST_TEST(largest_difference(scan.read(scan.geometry({{"offset_u", 0.4}, {"offset_v", -0.5}})),
                                scan.read(scan.geometry({{"center", 2.25}, {"row", 3.75}}))) <=
             same_geometry);
}

BOOST_AUTO_TEST_CASE(center_option_moves_all_views_alike) {
  const Scan scan;
  ScanOptions options;
  options.center = 4;
  const ProjectionSet plain = scan.read(scan.geometry()), moved = scan.read(scan.geometry(), options);
  BOOST_TEST(moved.report.center_source == "option");
  BOOST_TEST(std::abs(moved.geometry.center - 4) <= same_geometry);
  const double shift = cone_view(moved.cone->views[0]).center - cone_view(plain.cone->views[0]).center;
  for (std::size_t k = 0; k < views; ++k)
    BOOST_TEST(std::abs(cone_view(moved.cone->views[k]).center - cone_view(plain.cone->views[k]).center -
                        shift) <= same_geometry * columns);
  static_cast<void>(scan.folder.file("P.npy", npy_bytes(matrices_of(plain), "12, 3, 4")));
  const ProjectionSet stated = scan.read({{"matrices", "P.npy"}, {"center", 4}});
  BOOST_TEST(stated.report.center_source == "file");
  BOOST_TEST(largest_difference(stated, moved) <= same_geometry);
  BOOST_TEST(has(scan.refused({{"matrices", "P.npy"}, {"center", 9}}), "centre 9"));
}

BOOST_AUTO_TEST_CASE(use_selects_views_with_their_geometry) {
  const Scan scan;
  json members = scan.geometry();
  const ProjectionSet whole = scan.read(members);
  members["use"] = {3, 12};
  const ProjectionSet part = scan.read(members);
  BOOST_TEST(part.cone->views.size() == 9u);
  BOOST_TEST((part.cone->views[0] == whole.cone->views[3]));
  BOOST_TEST(part.geometry.views() == 9);
}

BOOST_AUTO_TEST_CASE(redundancy_is_what_views_tell_unless_it_is_stated) {
  Setup s;
  s.center = 3.5;
  const Scan scan(s);
  BOOST_TEST((scan.read(scan.geometry()).cone->redundancy == Redundancy::full_turn));
  BOOST_TEST((scan.read(scan.geometry({{"center", 2.5}})).cone->redundancy == Redundancy::displaced));
  std::vector<double> open;
  for (int k = 0; k < views; ++k) open.push_back(18.0 * k);
  const ProjectionSet part = scan.read(scan.geometry({{"angles", open}}));
  BOOST_TEST((part.cone->redundancy == Redundancy::short_scan));
  BOOST_TEST(noted(part, "short-scan"));
  json stated = scan.geometry({{"angles", open}});
  stated["redundancy"] = "full-turn";
  BOOST_TEST((scan.read(stated).cone->redundancy == Redundancy::full_turn));
  stated["redundancy"] = "half";
  BOOST_TEST(has(scan.refused(stated), "'redundancy' is \"half\""));
}

BOOST_AUTO_TEST_CASE(short_scan_with_a_displaced_detector_is_refused) {
  Setup s;
  s.step_deg = 18;
  s.center = 2.5;
  const Scan scan(s);
  BOOST_TEST(has(scan.refused(scan.geometry()), "do not exist"));
  json stated = scan.geometry();
  stated["redundancy"] = "displaced";
  BOOST_TEST(has(scan.refused(stated), "do not exist"));
}

BOOST_AUTO_TEST_CASE(hash_covers_the_geometry_file) {
  const Scan scan;
  static_cast<void>(scan.folder.file("g.xml", rtk_text(scan.setup)));
  const ProjectionSet read = scan.read({{"rtk_geometry", "g.xml"}});
  std::vector<std::string> lines;
  for (const char* name : {"g.xml", "scan.json", "stack.mha"})
    lines.push_back(sha256_of_file(scan.folder / name) + " " + name + "\n");
  std::sort(lines.begin(), lines.end());
  BOOST_TEST(read.report.sha256 == sha256_of_text(lines[0] + lines[1] + lines[2]));
}

BOOST_AUTO_TEST_CASE(hdf5_brings_the_angles_of_a_circular_geometry) {
  const TemporaryFolder folder;
  Exchange e;
  e.white = false;
  e.description = "line integrals";
  e.theta = {0, 90, 180, 270};
  write_exchange(folder / "p.h5", e);
  const auto describe = [&](const json& geometry) {
    static_cast<void>(folder.file("scan.json", json{{"hdf5", "p.h5"}, {"geometry", geometry}}.dump()));
    return folder.path();
  };
  const json geometry{{"source_to_axis", 50}, {"source_to_detector", 100}, {"pitch", 1}};
  const ProjectionSet scan = read_scan(describe(geometry));
  BOOST_TEST(scan.cone->views.size() == 4u);
  BOOST_TEST(scan.geometry.unit == "pixel");
  BOOST_TEST(std::abs(cone_view(scan.cone->views[1]).source[0] - 50) <= same_geometry * 50);
  json more = geometry;
  more["angles"] = {0, 90, 180};
  BOOST_TEST(has(refusal(describe(more)), "3 angles for 4 projections"));
}

BOOST_AUTO_TEST_CASE(tiff_frames_take_any_geometry_but_rtks) {
  const TemporaryFolder folder;
  json description = write_folder(folder);
  description.erase("angles");
  description.erase("angle_range");
  description["geometry"] = {
      {"source_to_axis", 50}, {"source_to_detector", 100}, {"pitch", {1, 1}}, {"angles", {0, 90, 180, 270}}};
  static_cast<void>(folder.file("scan.json", description.dump()));
  const ProjectionSet scan = read_scan(folder.path());
  check_samples(scan);
  BOOST_TEST(scan.geometry.unit == "mm");
  BOOST_TEST(noted(scan, "assumed to be mm"));
  description.erase("geometry");
  description["rtk_geometry"] = "g.xml";
  BOOST_TEST(has(folder_refusal(folder, description), "one MetaImage stack"));
}

// --- refusals ---

BOOST_AUTO_TEST_CASE(contradictions_and_bad_values_are_refused_by_member) {
  const Scan scan;
  const json good = scan.geometry();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> matrices = matrices_of(scan.read(good));
  static_cast<void>(scan.folder.file("P.npy", npy_bytes(matrices, "12, 3, 4")));
  for (const auto& [change, says] : std::vector<std::pair<json, std::string>>{
           {{{"matrices", "P.npy"}}, "'geometry' and 'matrices'"},
           {{{"pitch", 1}}, "'pitch'"},
           {{{"center", 3}}, "'geometry.center'"},
           {{{"angles", {0, 1, 2}}}, "'angles' gives 3 angles, 'geometry.angles' 12"},
           {{{"angle_range", {0, 3}}}, "'angle_range' needs 'angles'"}}) {
    json members = good;
    members.update(change);
    BOOST_TEST(has(scan.refused(members), says));
  }
  for (const auto& [change, says] : std::vector<std::pair<json, std::string>>{
           {{{"source_to_axis", 0}}, "'geometry.source_to_axis' is 0"},
           {{{"source_to_axis", nullptr}}, "'geometry.source_to_axis' is missing"},
           {{{"source_to_detector", -150}}, "'geometry.source_to_detector' is -150"},
           {{{"pitch", {0.4, 0}}}, "pitch of rows is 0"},
           {{{"pitch", "wide"}}, "'geometry.pitch'"},
           {{{"angles", {0, 90}}}, "2 angles for 12 projections"},
           {{{"angles", nullptr}}, "'geometry.angles' is missing"},
           {{{"sense", 2}}, "'geometry.sense' is 2"},
           {{{"tilt", 3}}, "'geometry.tilt'"},
           {{{"center", 20}}, "centre 20"},
           {{{"helix", 1}}, "'geometry.helix' is unknown"}})
    BOOST_TEST(has(scan.refused(scan.geometry(change)), says));
  BOOST_TEST(has(scan.refused({{"geometry", 3}}), "'geometry' must be an object"));
  BOOST_TEST(
      has(scan.refused({{"matrices", "P.npy"}, {"angles", {0, 1}}}), "'angles' contradicts 'matrices'"));
  BOOST_TEST(has(scan.refused({{"matrices", "../P.npy"}}), "stay within"));
  BOOST_TEST(
      has(scan.refused({{"angles", scan.setup.angles()}, {"redundancy", "displaced"}}), "'redundancy'"));

  const auto with = [&](const std::vector<double>& values, const std::string& shape) {
    static_cast<void>(scan.folder.file("P.npy", npy_bytes(values, shape)));
    return scan.refused({{"matrices", "P.npy"}});
  };
  std::vector<double> broken = matrices;
  broken[30] = nan;
  BOOST_TEST(has(with(broken, "12, 3, 4"), "view 2: the matrix holds a number that is not finite"));
  broken = matrices;
  broken[12 + 11] = 0;
  BOOST_TEST(has(with(broken, "12, 3, 4"), "view 1: the isocentre lies in the plane"));
  broken = matrices;
  for (std::size_t j = 0; j < 4; ++j) broken[4 + j] = broken[j];
  BOOST_TEST(has(with(broken, "12, 3, 4"), "view 0: a view's matrix is singular"));
  broken = matrices;
  for (std::size_t j = 0; j < 4; ++j) broken[4 + j] += 0.1 * broken[j];
  BOOST_TEST(has(with(broken, "12, 3, 4"), "degrees"));
  BOOST_TEST(has(with(matrices, "12, 4, 3"), "12 x 4 x 3"));
  matrices.resize(11 * 12);
  BOOST_TEST(has(with(matrices, "11, 3, 4"), "11 matrices for 12 projections"));
}

BOOST_AUTO_TEST_CASE(stacks_that_are_turned_or_of_another_kind_are_refused_for_rtk) {
  const Scan scan;
  static_cast<void>(scan.folder.file("g.xml", rtk_text(scan.setup)));
  const auto with = [&](const std::string& place) {
    static_cast<void>(scan.folder.file("stack.mha", stack_bytes(columns, rows, views, place)));
    return scan.refused({{"rtk_geometry", "g.xml"}});
  };
  BOOST_TEST(has(with("TransformMatrix = 1 0 0 0 -1 0 0 0 1\n"), "TransformMatrix"));
  BOOST_TEST(has(with("ElementSpacing = 0.4 -0.5 1\n"), "spacing -0.5"));
  BOOST_TEST(with(scan.setup.place()) == "accepted");
  static_cast<void>(scan.folder.file("stack.mha", stack_bytes(columns, rows, views - 1, scan.setup.place())));
  BOOST_TEST(has(scan.refused({{"rtk_geometry", "g.xml"}}), "12 projections described for 11 projections"));
}

BOOST_AUTO_TEST_CASE(astra_files_of_another_detector_or_type_are_refused) {
  const Scan scan;
  const auto with = [&](const json& change) {
    json astra = astra_vectors(scan.setup);
    astra.update(change);
    static_cast<void>(scan.folder.file("a.json", astra.dump()));
    return scan.refused({{"astra", "a.json"}});
  };
  BOOST_TEST(has(with({{"type", "parallel3d"}}), "'type' is 'parallel3d'"));
  BOOST_TEST(has(with({{"DetectorColCount", 9}}), "9 columns x 6 rows"));
  BOOST_TEST(has(with({{"Vectors", {{1, 2, 3}}}}), "entry 0 must hold 12 numbers"));
  json behind = astra_vectors(scan.setup)["Vectors"];
  // The detector between the source and the axis' far side: the source looks away from the axis.
  for (std::size_t i = 0; i < 3; ++i) behind[4][3 + i] = 2 * behind[4][i].get<double>();
  BOOST_TEST(has(with({{"Vectors", behind}}), "view 4: the isocentre lies on or behind"));
  for (std::size_t i = 0; i < 3; ++i) behind[4][9 + i] = behind[4][6 + i];
  BOOST_TEST(has(with({{"Vectors", behind}}), "view 4"));
}

// TIGRE's own lines: source and detector turned by the angle, then moved by COR along the turned y.
BOOST_AUTO_TEST_CASE(tigre_geometry_sees_points_where_tigres_rays_hit) {
  const Scan scan;
  std::vector<double> angles = scan.setup.angles();
  for (double& angle : angles) angle *= radians;
  const double sid = 100, sdd = 150, side_u = 0.4, side_v = 0.5, off_u = 0.3, off_v = -0.2, shift = 0.15;
  const json good{{"mode", "cone"},
                  {"DSD", sdd},
                  {"DSO", sid},
                  {"nDetector", {rows, columns}},
                  {"dDetector", {side_v, side_u}},
                  {"offDetector", {off_v, off_u}},
                  {"COR", shift},
                  {"angles", angles}};
  const auto with = [&](const json& change) {
    json tigre = good;
    tigre.update(change);
    static_cast<void>(scan.folder.file("t.json", tigre.dump()));
    return scan.refused({{"tigre", "t.json"}});
  };
  BOOST_TEST(with(json::object()) == "accepted");
  const ProjectionSet plain = read_scan(scan.folder.path());
  const double c = std::cos(angles[7]), s = std::sin(angles[7]), column = 6, row = 1, part = 0.6;
  const auto turned = [&](double x, double y, double z) {
    return Vec3{c * x - s * y - shift * s, s * x + c * y + shift * c, z};
  };
  // The row that is stored first is the one of the lowest z.
  const Vec3 source = turned(sid, 0, 0),
             pixel = turned(sid - sdd, side_u * (column - 0.5 * (columns - 1)) + off_u,
                            side_v * (row - 0.5 * (rows - 1)) + off_v);
  double n[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& m = plain.cone->views[7][i];
    n[i] = m[3];
    for (std::size_t a = 0; a < 3; ++a) n[i] += m[a] * (source[a] + part * (pixel[a] - source[a]));
  }
  BOOST_TEST(std::abs(n[0] / n[2] - column) <= tolerance::fp64_sum(100, columns * sdd));
  BOOST_TEST(std::abs(n[1] / n[2] - row) <= tolerance::fp64_sum(100, columns * sdd));

  json table = json::array();
  for (const double angle : angles) table.push_back({angle, 0, 0});
  BOOST_TEST(with({{"angles", table}, {"DSD", std::vector<double>(views, sdd)}}) == "accepted");
  BOOST_TEST(largest_difference(plain, read_scan(scan.folder.path())) == 0);
  table[3][1] = 0.1;
  BOOST_TEST(has(with({{"angles", table}}), "entry 3 turns about more"));
  BOOST_TEST(has(with({{"rotDetector", {0, 0.1, 0}}}), "'rotDetector' holds 0.1"));
  BOOST_TEST(has(with({{"mode", "parallel"}}), "'mode' is 'parallel'"));
  BOOST_TEST(has(with({{"nDetector", {columns, rows}}}), "'nDetector' is [8, 6]"));
  BOOST_TEST(has(with({{"DSO", {1, 2}}}), "'DSO' has 2 values"));
  BOOST_TEST(has(with({{"DSO", 0}}), "distance from source to axis is 0"));
}

BOOST_AUTO_TEST_CASE(truncated_files_of_geometry_are_refused_at_every_length) {
  const Scan scan;
  const std::string xml = rtk_text(scan.setup),
                    npy = npy_bytes(matrices_of(scan.read(scan.geometry())), "12, 3, 4");
  const auto root_end = xml.rfind('>');
  for (std::size_t n = 0; n <= root_end; ++n)
    BOOST_REQUIRE_THROW(static_cast<void>(io::read_xml(scan.folder.file("cut", xml.substr(0, n)))),
                        FileError);
  for (std::size_t n = 0; n < npy.size(); ++n)
    BOOST_REQUIRE_THROW(static_cast<void>(io::read_npy(scan.folder.file("cut", npy.substr(0, n)))),
                        FileError);
}

BOOST_AUTO_TEST_CASE(xml_beyond_the_dialect_is_refused_with_its_line) {
  const TemporaryFolder folder;
  const auto with = [&](const std::string& text) {
    try {
      static_cast<void>(io::read_xml(folder.file("g.xml", text)));
    } catch (const FileError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  BOOST_TEST(with("<a x='1 &lt; 2'>\n<b/><!-- c -->&amp;t</a>\n") == "accepted");
  BOOST_TEST(has(with("<!DOCTYPE a [<!ENTITY x \"y\">]>\n<a/>"), "DOCTYPE"));
  BOOST_TEST(has(with("<!DOCTYPE a SYSTEM \"b.dtd\"><a/>"), "DOCTYPE"));
  BOOST_TEST(has(with("<a>\n&x;</a>"), "line 2: an entity"));
  BOOST_TEST(has(with("<a>&#65;</a>"), "an entity"));
  BOOST_TEST(has(with("<a><![CDATA[x]]></a>"), "CDATA"));
  BOOST_TEST(has(with("<a/><b/>"), "follows the root"));
  BOOST_TEST(has(with("<a x='1' x='2'/>"), "given twice"));
  std::string deep;
  for (int i = 0; i < 20; ++i) deep += "<a>";
  BOOST_TEST(has(with(deep), "deeper than"));
}

BOOST_AUTO_TEST_CASE(npy_files_of_other_kinds_are_refused) {
  const TemporaryFolder folder;
  const std::string good = npy_bytes(std::vector<double>(12, 1), "1, 3, 4");
  const auto with = [&](const std::string& part, const std::string& instead) {
    std::string bytes = good;
    bytes.replace(bytes.find(part), part.size(), instead);
    try {
      static_cast<void>(io::read_npy(folder.file("a.npy", bytes)));
    } catch (const FileError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  BOOST_TEST(with("<f8", "<f8") == "accepted");
  BOOST_TEST(has(with("<f8", ">f8"), "'>f8'"));
  BOOST_TEST(has(with("<f8", "|O8"), "'|O8'"));
  BOOST_TEST(has(with("1, 3, 4", "1, 3, 5"), "take 120 bytes"));
  BOOST_TEST(has(with("1, 3, 4", "-1, 3, 4"), "lengths"));
  BOOST_TEST(has(with("1, 3, 4", "99999999999999999999, 3, 4"), "too long"));
  BOOST_TEST(has(with("False", "maybe"), "fortran_order"));
  BOOST_TEST(has(with("'shape'", "'shade'"), "'shade'"));
}

// --- Nikon ---

namespace {

// The scan of write_folder() as a Nikon scanner writes it, but for the level of its darks: 0.
std::string xtekct(const std::string& more = "") {
  return "[XTekCT]\r\nName=view\r\nInputFolderName=p\r\nSrcToObject=50\r\nSrcToDetector=100\r\n"
         "DetectorPixelsX=3\r\nDetectorPixelsY=2\r\nDetectorPixelSizeX=0.5\r\nDetectorPixelSizeY=0.25\r\n"
         "Projections=4\r\nInitialAngle=10\r\nAngularStep=90\r\nWhiteLevel=60000\r\n" +
         more + "[Xrays]\r\nXraykV=120\r\n";
}

}  // namespace

BOOST_AUTO_TEST_CASE(nikon_scan_is_read_with_its_white_level_and_clockwise_angles) {
  const TemporaryFolder folder;
  write_folder(folder);
  static_cast<void>(folder.file("s.xtekct", xtekct()));
  static_cast<void>(folder.file("scan.json", R"({"nikon": "s.xtekct"})"));
  const ProjectionSet scan = read_scan(folder.path());
  BOOST_TEST(scan.cone->views.size() == 4u);
  BOOST_TEST(scan.geometry.unit == "mm");
  BOOST_TEST(std::abs(scan.geometry.center - 1) <= same_geometry);
  BOOST_TEST(std::abs(scan.geometry.pitch_u - 0.25) <= same_geometry);
  BOOST_TEST(scan.report.source_to_detector == 100);
  const double expected = -std::log(static_cast<double>(static_cast<float>(raw_count(2, 1, 1))) / 60000);
  BOOST_TEST(std::abs(static_cast<double>(scan.data[2 * V * U + U + 1]) - expected) <=
             tolerance::fp32_sum(2, expected));
  const double theta = -100 * radians;
  BOOST_TEST(std::abs(cone_view(scan.cone->views[1]).source[0] - 50 * std::sin(theta)) <= same_geometry * 50);
  BOOST_TEST(noted(scan, "clockwise"));
  BOOST_TEST(noted(scan, "sign is assumed"));
  // The files' places in the hash: the .xtekct file and the frames.
  std::vector<std::string> lines;
  for (const char* name :
       {"s.xtekct", "scan.json", "p/view_8.tif", "p/view_9.tif", "p/view_10.tif", "p/view_11.tif"})
    lines.push_back(sha256_of_file(folder / name) + " " + name + "\n");
  std::sort(lines.begin(), lines.end());
  std::string text;
  for (const auto& line : lines) text += line;
  BOOST_TEST(scan.report.sha256 == sha256_of_text(text));
}

BOOST_AUTO_TEST_CASE(nikon_axis_lies_where_the_file_puts_it) {
  const TemporaryFolder folder;
  write_folder(folder);
  static_cast<void>(folder.file("scan.json", R"({"nikon": "s.xtekct"})"));
  const auto with = [&](const std::string& more) {
    static_cast<void>(folder.file("s.xtekct", xtekct(more)));
    return read_scan(folder.path());
  };
  // 0.125 mm at the object is 0.25 mm, half a column, on the detector.
  BOOST_TEST(std::abs(with("ObjectOffsetX=0.125\r\n").geometry.center - 1.5) <= same_geometry);
  BOOST_TEST(std::abs(with("CentreOfRotationTop=0.25\r\nCentreOfRotationBottom=0.25\r\n").geometry.center -
                      1.5) <= same_geometry);
  // A tilted axis: points of it are seen where top and bottom say, half a row beyond the outer rows' centres.
  const ProjectionSet tilted = with("CentreOfRotationTop=0.25\r\nCentreOfRotationBottom=-0.25\r\n");
  const ViewMatrix& m = tilted.cone->views[0];
  for (const double z : {-0.1, 0.1}) {
    const double u = (m[0][2] * z + m[0][3]) / (m[2][2] * z + m[2][3]),
                 v = (m[1][2] * z + m[1][3]) / (m[2][2] * z + m[2][3]);
    // From 0.25 mm at row -1/2 to -0.25 mm at row 3/2: a column of 0.5 mm over two rows.
    BOOST_TEST(std::abs(u - (1.5 - (v + 0.5) / 2)) <= same_geometry * 10);
  }
}

BOOST_AUTO_TEST_CASE(nikon_files_that_lack_or_contradict_something_are_refused) {
  const TemporaryFolder folder;
  write_folder(folder);
  static_cast<void>(folder.file("scan.json", R"({"nikon": "s.xtekct"})"));
  for (const auto& [part, broken, says] : std::vector<std::array<std::string, 3>>{
           {"SrcToObject=50", "SrcToObject=-50", "SrcToObject is -50"},
           {"SrcToObject=50\r\n", "", "SrcToObject is missing"},
           {"AngularStep=90", "AngularStep=9O", "AngularStep is '9O'"},
           {"Projections=4", "Projections=5", "4 TIFF files begin with 'view'"},
           {"DetectorPixelsX=3", "DetectorPixelsX=4", "4 columns x 2 rows"},
           {"Projections=4", "Projections=4\r\nProjections=3", "given twice"},
           {"Name=view", "Name=other", "'projections'"}}) {
    std::string text = xtekct();
    text.replace(text.find(part), part.size(), broken);
    static_cast<void>(folder.file("s.xtekct", text));
    BOOST_TEST(has(refusal(folder.path()), says));
  }
  const std::string whole = xtekct();
  for (std::size_t n = 0; n < whole.size(); ++n) {
    try {
      static_cast<void>(io::read_nikon(folder.file("cut", whole.substr(0, n))));
    } catch (const FileError&) {
    }
  }
}

// --- back to parameters ---

BOOST_AUTO_TEST_CASE(parameters_of_a_matrix_give_it_back) {
  CircularView v;
  v.source_to_axis = 500;
  v.source_to_detector = 900;
  v.pitch_u = 0.2;
  v.pitch_v = 0.3;
  v.center = 255.5;
  v.row = 127.5;
  v.in_plane_rad = 0.03;
  v.out_of_plane_rad = -0.05;
  v.source_offset_u = 3;
  v.source_offset_v = -2;
  v.detector_offset_u = 11;
  v.detector_offset_v = 7;
  for (const double theta : {-3.0, 0.0, 0.5, 2.0, 3.1}) {
    v.theta_rad = theta;
    const CircularView back = circular_parameters(circular_view(v), 0.2, 0.3, 255.5, 127.5);
    for (const auto& [a, b] :
         std::vector<std::pair<double, double>>{{back.theta_rad, v.theta_rad},
                                                {back.in_plane_rad, v.in_plane_rad},
                                                {back.out_of_plane_rad, v.out_of_plane_rad},
                                                {back.source_to_axis, v.source_to_axis},
                                                {back.source_to_detector, v.source_to_detector},
                                                {back.source_offset_u, v.source_offset_u},
                                                {back.source_offset_v, v.source_offset_v},
                                                {back.detector_offset_u, v.detector_offset_u},
                                                {back.detector_offset_v, v.detector_offset_v}})
      // Some hundred roundings of numbers up to the source's distance.
      BOOST_TEST(std::abs(a - b) <= tolerance::fp64_sum(200, 900));
  }
  BOOST_CHECK_THROW(static_cast<void>(circular_parameters(circular_view(v), 0.2, 0.2, 255.5, 127.5)),
                    InputError);
  ViewMatrix mirrored = circular_view(v);
  for (double& value : mirrored[0]) value = -value;
  BOOST_CHECK_THROW(static_cast<void>(circular_parameters(mirrored, 0.2, 0.3, 255.5, 127.5)), InputError);
}

BOOST_AUTO_TEST_CASE(geometry_written_for_rtk_is_read_back_the_same) {
  const Scan scan;
  const ProjectionSet plain = scan.read(scan.geometry({{"offset_u", 0.1}}));
  const StackPlace stack = centred_stack(columns, rows, plain.geometry.pitch_u, plain.geometry.pitch_v);
  static_cast<void>(scan.folder.file("g.xml", rtk_geometry_text(*plain.cone, stack)));
  static_cast<void>(scan.folder.file(
      "stack.mha",
      stack_bytes(columns, rows, views,
                  fmt::format("Offset = {:.17g} {:.17g} 0\nElementSpacing = {:.17g} {:.17g} 1\n",
                              stack.origin[0], stack.origin[1], stack.spacing[0], stack.spacing[1]))));
  BOOST_TEST(largest_difference(plain, scan.read({{"rtk_geometry", "g.xml"}})) <= same_geometry);
}
