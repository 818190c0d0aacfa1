// CIL's parameters, against rays laid in its laboratory: source and detector stand, the object turns by
// initial_angle + angle about the axis, right-handed.
#define BOOST_TEST_MODULE cil_geometry
#include <boost/test/unit_test.hpp>

#include "tests/support/ball_scan.hpp"

using namespace vdvr;
using namespace vdvr::support;

namespace {

// Rodrigues' formula: about a unit vector.
Vec3 turned(const Vec3& a, const Vec3& about, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return sum(sum(scaled(a, c), scaled(cross(about, a), s)), scaled(about, dot(about, a) * (1 - c)));
}

Vec3 unit(const Vec3& a) { return scaled(a, 1 / length(a)); }

struct Cil {
  Vec3 source{0.1, -99, 0.2}, detector{0.3, 52, -0.1}, x{1, 0.02, -0.03}, y{0, 0, 0}, axis{0.05, 1, 0.25},
      axis_direction{0.02, -0.03, 2};
  double width = 0.4, height = 0.5, initial_deg = 12;
  std::string origin = "bottom-left";
  std::vector<double> angles = Setup{}.angles();

  Cil() { y = cross(x, Vec3{-0.01, 1, 0.04}); }  // at right angles to x

  [[nodiscard]] json text(int cols = columns, int row_count = rows) const {
    return {{"source_position", source},
            {"detector_position", detector},
            {"detector_direction_x", x},
            {"detector_direction_y", y},
            {"rotation_axis_position", axis},
            {"rotation_axis_direction", axis_direction},
            {"units", "mm"},
            {"num_pixels", {cols, row_count}},
            {"pixel_size", {width, height}},
            {"origin", origin},
            {"angles", angles},
            {"initial_angle", initial_deg},
            {"angle_unit", "degree"}};
  }
  // Of a point of the laboratory, when the object stands as it is measured: (column, row).
  [[nodiscard]] std::array<double, 2> hit(const Vec3& point, int cols, int row_count) const {
    const Vec3 normal = cross(unit(x), unit(y)), way = minus(point, source);
    const double part = dot(minus(detector, source), normal) / dot(way, normal);
    const Vec3 on = minus(sum(source, scaled(way, part)), detector);
    double a = dot(on, unit(x)) / width, b = dot(on, unit(y)) / height;
    if (origin.find("right") != std::string::npos) a = -a;
    if (origin.find("top") != std::string::npos) b = -b;
    return {0.5 * (cols - 1) + a, 0.5 * (row_count - 1) + b};
  }
  // A point that turns with the object, from where it is at no angle.
  [[nodiscard]] Vec3 at(const Vec3& point, std::size_t k) const {
    return sum(axis, turned(minus(point, axis), unit(axis_direction), (initial_deg + angles[k]) * radians));
  }
  // Our world in the laboratory: the axis is brought to +z by the shortest turn, then the way from the source
  // to the detector over +y.
  [[nodiscard]] Vec3 in_laboratory(const Vec3& world) const {
    const Vec3 a = unit(axis_direction), z{0, 0, 1}, side = cross(a, z);
    const double sine = length(side), angle = std::atan2(sine, dot(a, z));
    const auto upright = [&](const Vec3& p) {
      return sine > 0 ? turned(p, scaled(side, 1 / sine), angle) : p;
    };
    const Vec3 way = upright(minus(detector, source));
    const double about = std::atan2(way[0], way[1]);
    Vec3 p = turned(world, z, -about);
    if (sine > 0) p = turned(p, scaled(side, 1 / sine), -angle);
    return sum(axis, p);
  }
};

void check_views(const ProjectionSet& scan, const Cil& cil) {
  BOOST_REQUIRE(scan.cone->views.size() == cil.angles.size());
  for (std::size_t k = 0; k < cil.angles.size(); ++k)
    for (const Vec3& x : {Vec3{0, 0, 0}, {0.5, -0.25, 0.75}, {-3, 7, -2}, {11, 4, 5}}) {
      const Vec3 found = projected(scan.cone->views[k], x);
      const auto expected = cil.hit(cil.at(cil.in_laboratory(x), k), columns, rows);
      const double scale = 100 + std::abs(expected[0]) + std::abs(expected[1]);
      BOOST_TEST(std::abs(found[0] - expected[0]) <= same_geometry * scale);
      BOOST_TEST(std::abs(found[1] - expected[1]) <= same_geometry * scale);
    }
}

}  // namespace

BOOST_AUTO_TEST_CASE(cil_cone3d_sees_points_where_rays_of_its_laboratory_hit) {
  const Scan scan;
  Cil cil;
  for (const char* origin : {"bottom-left", "bottom-right", "top-left", "top-right"}) {
    cil.origin = origin;
    static_cast<void>(scan.folder.file("c.json", cil.text().dump()));
    check_views(scan.read({{"cil", "c.json"}}), cil);
  }
}

BOOST_AUTO_TEST_CASE(cil_axes_of_other_directions_are_brought_upright) {
  const Scan scan;
  for (const Vec3& direction : {Vec3{0, 0, 1}, {0, 0, 3}, {1e-9, 0, 1}, {0.2, 0.1, -3}, {1e-9, 0, -1}}) {
    Cil cil;
    cil.axis_direction = direction;
    static_cast<void>(scan.folder.file("c.json", cil.text().dump()));
    check_views(scan.read({{"cil", "c.json"}}), cil);
  }
  // Straight down: CIL takes half a turn about x, the limit of no other.
  Cil cil;
  cil.axis = {0, 0, 0};
  cil.axis_direction = {0, 0, -1};
  static_cast<void>(scan.folder.file("c.json", cil.text().dump()));
  const Vec3 found = projected(scan.read({{"cil", "c.json"}}).cone->views[0], {0, 0, 1});
  const auto expected = cil.hit({0, 0, -1}, columns, rows);
  BOOST_TEST(std::abs(found[0] - expected[0]) <= same_geometry * 100);
  BOOST_TEST(std::abs(found[1] - expected[1]) <= same_geometry * 100);
}

BOOST_AUTO_TEST_CASE(cil_default_directions_are_a_plain_circular_scan_that_turns_the_other_way) {
  Setup s;
  s.center = 3.5;
  s.row = 2.5;
  s.in_deg = s.out_deg = 0;
  const Scan scan(s);
  json text{{"source_position", {0, -s.sid, 0}},
            {"detector_position", {0, s.sdd - s.sid, 0}},
            {"num_pixels", {columns, rows}},
            {"pixel_size", {s.pitch_u, s.pitch_v}},
            {"angles", s.angles()}};
  static_cast<void>(scan.folder.file("c.json", text.dump()));
  const ProjectionSet degrees = scan.read({{"cil", "c.json"}});
  BOOST_TEST(largest_difference(degrees, scan.read(scan.geometry({{"sense", -1}}))) <= same_geometry);
  BOOST_TEST(noted(degrees, "turn from x to y"));
  BOOST_TEST(degrees.geometry.unit == "mm");
  std::vector<double> angles = s.angles();
  for (double& a : angles) a = (a - 5) * radians;
  text.update(
      {{"angles", angles}, {"initial_angle", 5 * radians}, {"angle_unit", "radian"}, {"units", "um"}});
  static_cast<void>(scan.folder.file("c.json", text.dump()));
  const ProjectionSet by_radians = scan.read({{"cil", "c.json"}});
  BOOST_TEST(largest_difference(degrees, by_radians) <= same_geometry);
  BOOST_TEST(by_radians.geometry.unit == "um");
}

BOOST_AUTO_TEST_CASE(cil_geometries_of_another_kind_are_refused) {
  const Scan scan;
  const auto with = [&](const json& change) {
    json text = Cil().text();
    for (const auto& [key, value] : change.items()) {
      if (value.is_null()) text.erase(key);
      else text[key] = value;
    }
    static_cast<void>(scan.folder.file("c.json", text.dump()));
    return scan.refused({{"cil", "c.json"}});
  };
  BOOST_TEST(with({{"geom_type", "cone"},
                   {"num_channels", 1},
                   {"dimension_labels", {"angle", "vertical", "horizontal"}}}) == "accepted");
  for (const auto& [change, says] : std::vector<std::pair<json, std::string>>{
           {{{"geom_type", "parallel"}}, "'geom_type' is 'parallel'"},
           {{{"geom_type", "cone_flex"}}, "give each view as ASTRA's 'cone_vec'"},
           {{{"num_channels", 4}}, "'num_channels' is 4"},
           {{{"dimension_labels", {"vertical", "angle", "horizontal"}}}, "the stack's order"},
           {{{"num_pixels", {rows, columns}}}, "'num_pixels' is [6, 8]"},
           {{{"num_pixels", {columns}}}, "[horizontal, vertical]"},
           {{{"pixel_size", {0.4, 0}}}, "'pixel_size' holds 0"},
           {{{"origin", "middle"}}, "'origin' is 'middle'"},
           {{{"origin", "top-"}}, "'origin' is 'top-'"},
           {{{"angles", {0, 1}}}, "'angles' has 2 values for 12"},
           {{{"angles", nullptr}}, "'angles' must be a list"},
           {{{"angle_unit", "grad"}}, "'angle_unit' is 'grad'"},
           {{{"source_position", nullptr}}, "'source_position' is missing"},
           {{{"source_position", {0, -1}}}, "'source_position' must hold three"},
           {{{"detector_direction_x", {0, 0, 0}}}, "'detector_direction_x' has no direction"},
           {{{"detector_direction_y", Cil().x}}, "view 0"},
           {{{"detector_direction_y", {0.3, 0, 1}}}, "view 0"},
           {{{"rotation_axis_position", {0, -500, 0}}}, "the isocentre lies on or behind"},
           {{{"source_position_set", json::array()}}, "'source_position_set' is unknown"}})
    BOOST_TEST(has(with(change), says));
  BOOST_TEST(has(scan.refused({{"cil", "c.json"}, {"angles", {0, 1}}}), "'angles' contradicts 'cil'"));
}

BOOST_AUTO_TEST_CASE(cil_scan_gives_a_ball_where_it_is) {
  Cil cil;
  cil.source = {3, -100, 1};
  cil.detector = {3, 50, 2};
  cil.x = {1, 0, 0};
  cil.y = {0, 0, 1};
  cil.axis = {2, 0, 1.5};
  cil.axis_direction = {0, 0, 1};
  cil.width = cil.height = 2;
  cil.angles.clear();
  for (int k = 0; k < BallScan::views; ++k) cil.angles.push_back(6.0 * k);
  for (const char* origin : {"bottom-left", "top-right"}) {
    cil.origin = origin;
    const double across = cil.origin == "top-right" ? -cil.width : cil.width,
                 along = cil.origin == "top-right" ? -cil.height : cil.height;
    const auto integral = [&](int k, int row, int column) {
      const Vec3 pixel = sum(cil.detector, {across * (column - 0.5 * (BallScan::columns - 1)), 0,
                                            along * (row - 0.5 * (BallScan::rows - 1))});
      return BallScan::chord(cil.source, pixel,
                             cil.at(sum(cil.axis, BallScan::center), static_cast<std::size_t>(k)));
    };
    const TemporaryFolder folder;
    static_cast<void>(folder.file("stack.mha", stack_bytes(BallScan::columns, BallScan::rows, BallScan::views,
                                                           "", BallScan::samples(integral))));
    static_cast<void>(folder.file("c.json", cil.text(BallScan::columns, BallScan::rows).dump()));
    static_cast<void>(folder.file(
        "scan.json", R"({"projections": "stack.mha", "description": "line integrals", "cil": "c.json"})"));
    check_ball(read_scan(folder.path()));
  }
}
