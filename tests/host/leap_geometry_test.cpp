// LEAP's parameters, against the equations of its documentation: with phi = phis - 90 degrees, theta =
// (cos phi, sin phi, 0) and its perpendicular (-sin phi, cos phi, 0), a point is seen at
// u = (x . perpendicular + tau) / (sod - x . theta) and v = z / (sod - x . theta), turned by the tilt.
#define BOOST_TEST_MODULE leap_geometry
#include <boost/test/unit_test.hpp>

#include "tests/support/ball_scan.hpp"

using namespace vdvr;
using namespace vdvr::support;

namespace {

struct Leap {
  double sod = 100, sdd = 150, tau = 0.75, width = 0.4, height = 0.5, center_col = 3.25, center_row = 2.75,
         tilt_deg = 2;
  std::vector<double> phis = Setup{}.angles();

  [[nodiscard]] json text(int cols = columns, int row_count = rows) const {
    return {{"numAngles", phis.size()},
            {"numRows", row_count},
            {"numCols", cols},
            {"pixelHeight", height},
            {"pixelWidth", width},
            {"centerRow", center_row},
            {"centerCol", center_col},
            {"phis", phis},
            {"sod", sod},
            {"sdd", sdd},
            {"tau", tau},
            {"helicalPitch", 0},
            {"tiltAngle", tilt_deg}};
  }
  // (column, row) of a point.
  [[nodiscard]] std::array<double, 2> seen(std::size_t k, const Vec3& x) const {
    const double phi = (phis[k] - 90) * radians, c = std::cos(phi), s = std::sin(phi);
    const double depth = sod - (x[0] * c + x[1] * s);
    const double u = (x[1] * c - x[0] * s + tau) / depth, v = x[2] / depth;
    const double ct = std::cos(tilt_deg * radians), st = std::sin(tilt_deg * radians);
    return {center_col + sdd * (u * ct + v * st) / width, center_row + sdd * (v * ct - u * st) / height};
  }
};

// Against `seen`, whose own numbers are below the columns' count times the magnification.
void check_views(const ProjectionSet& scan, const Leap& leap) {
  BOOST_REQUIRE(scan.cone->views.size() == leap.phis.size());
  for (std::size_t k = 0; k < leap.phis.size(); ++k)
    for (const Vec3& x : {Vec3{0, 0, 0}, {0.5, -0.25, 0.75}, {-3, 7, -2}, {11, 4, 5}}) {
      const Vec3 found = projected(scan.cone->views[k], x);
      const auto expected = leap.seen(k, x);
      const double scale = 100 + std::abs(expected[0]) + std::abs(expected[1]);
      BOOST_TEST(std::abs(found[0] - expected[0]) <= same_geometry * scale);
      BOOST_TEST(std::abs(found[1] - expected[1]) <= same_geometry * scale);
    }
}

}  // namespace

BOOST_AUTO_TEST_CASE(leap_conebeam_sees_points_where_leaps_equations_say) {
  const Scan scan;
  const Leap leap;
  static_cast<void>(scan.folder.file("l.json", leap.text().dump()));
  const ProjectionSet read = scan.read({{"leap", "l.json"}});
  check_views(read, leap);
  BOOST_TEST(read.geometry.unit == "mm");
  BOOST_TEST(read.report.source_to_detector == 150);
  BOOST_TEST(read.report.center_source == "file");
  BOOST_TEST(noted(read, "phis are assumed to be degrees"));
}

BOOST_AUTO_TEST_CASE(leap_without_shift_and_tilt_is_a_plain_circular_scan) {
  Setup s;
  s.in_deg = s.out_deg = 0;
  const Scan scan(s);
  Leap leap;
  leap.tau = leap.tilt_deg = 0;
  static_cast<void>(scan.folder.file("l.json", leap.text().dump()));
  const ProjectionSet read = scan.read({{"leap", "l.json"}});
  BOOST_TEST(largest_difference(read, scan.read(scan.geometry())) <= same_geometry);
  // Equal steps of a range, as setAngleArray makes them.
  json ranged = leap.text();
  ranged["phis"] = 360;
  static_cast<void>(scan.folder.file("l.json", ranged.dump()));
  const ProjectionSet by_number = scan.read({{"leap", "l.json"}});
  ranged.erase("phis");
  ranged["angularRange"] = 360;
  static_cast<void>(scan.folder.file("l.json", ranged.dump()));
  BOOST_TEST(largest_difference(by_number, scan.read({{"leap", "l.json"}})) == 0);
  for (std::size_t k = 0; k < leap.phis.size(); ++k) leap.phis[k] = 30.0 * static_cast<double>(k);
  check_views(by_number, leap);
}

// The same scan as vectors: LEAP's own conversion puts source, middle, rows and columns there.
BOOST_AUTO_TEST_CASE(leap_modularbeam_is_the_same_scan_as_vectors) {
  const Scan scan;
  const Leap leap;
  json sources, middles, row_vectors, column_vectors;
  for (const double degrees : leap.phis) {
    const double phi = (degrees - 90) * radians, c = std::cos(phi), s = std::sin(phi),
                 ct = std::cos(leap.tilt_deg * radians), st = std::sin(leap.tilt_deg * radians);
    const Vec3 u{-s * ct, c * ct, st}, v{s * st, -c * st, ct};
    const double across = (0.5 * (columns - 1) - leap.center_col) * leap.width,
                 along = (0.5 * (rows - 1) - leap.center_row) * leap.height;
    const Vec3 middle =
        sum({(leap.sod - leap.sdd) * c + leap.tau * s, (leap.sod - leap.sdd) * s - leap.tau * c, 0},
            sum(scaled(u, across), scaled(v, along)));
    sources.push_back({leap.sod * c + leap.tau * s, leap.sod * s - leap.tau * c, 0});
    middles.push_back(middle);
    row_vectors.push_back(v);
    column_vectors.push_back(u);
  }
  const json good{{"geometry", "MODULAR"},       {"numAngles", views},         {"numRows", rows},
                  {"numCols", columns},          {"pixelHeight", leap.height}, {"pixelWidth", leap.width},
                  {"sourcePositions", sources},  {"moduleCenters", middles},   {"rowVectors", row_vectors},
                  {"colVectors", column_vectors}};
  const auto with = [&](const json& change) {
    json text = good;
    text.update(change);
    static_cast<void>(scan.folder.file("l.json", text.dump()));
    return scan.refused({{"leap", "l.json"}});
  };
  BOOST_REQUIRE_EQUAL(with(json::object()), "accepted");
  check_views(read_scan(scan.folder.path()), leap);
  BOOST_TEST(has(with({{"sod", 100}}), "'sod' has no place in modular beam"));
  json broken = row_vectors;
  broken[3] = {0, 0, 2};
  BOOST_TEST(has(with({{"rowVectors", broken}}), "'rowVectors': entry 3 has the length 2"));
  broken = sources;
  broken.erase(0);
  BOOST_TEST(has(with({{"sourcePositions", broken}}), "'sourcePositions' has 11 entries for 12"));
  BOOST_TEST(has(with({{"sourcePositions", json::array({1, 2, 3})}}), "must hold 3 numbers"));
}

BOOST_AUTO_TEST_CASE(leap_geometries_of_another_kind_are_refused) {
  const Scan scan;
  const auto with = [&](const json& change) {
    json text = Leap().text();
    for (const auto& [key, value] : change.items()) {
      if (value.is_null()) text.erase(key);
      else text[key] = value;
    }
    static_cast<void>(scan.folder.file("l.json", text.dump()));
    return scan.refused({{"leap", "l.json"}});
  };
  BOOST_TEST(with({{"geometry", "CONE"}, {"detectorType", "FLAT"}}) == "accepted");
  for (const auto& [change, says] : std::vector<std::pair<json, std::string>>{
           {{{"geometry", "PARALLEL"}}, "'geometry' is 'PARALLEL'"},
           {{{"geometry", "CONE_PARALLEL"}}, "'geometry' is 'CONE_PARALLEL'"},
           {{{"detectorType", "CURVED"}}, "only flat detectors"},
           {{{"helicalPitch", 2.5}}, "'helicalPitch' is 2.5; helical"},
           {{{"numCols", 9}}, "9 columns x 6 rows"},
           {{{"numAngles", 11}}, "11 angles ('numAngles') for 12 projections"},
           {{{"phis", {0, 1, 2}}}, "'phis' has 3 values for 12"},
           {{{"phis", nullptr}}, "one of 'phis' and 'angularRange'"},
           {{{"angularRange", 360}}, "one of 'phis' and 'angularRange'"},
           {{{"sod", 0}}, "'sod' is 0"},
           {{{"sdd", -150}}, "'sdd' is -150"},
           {{{"pixelWidth", nullptr}}, "'pixelWidth' is missing"},
           {{{"centerCol", nullptr}}, "'centerCol' is missing"},
           {{{"rowVectors", json::array()}}, "'rowVectors' has no place in cone beam"},
           {{{"pitch", 1}}, "'pitch' is unknown"}})
    BOOST_TEST(has(with(change), says));
  BOOST_TEST(has(scan.refused({{"leap", "l.json"}, {"astra", "a.json"}}), "'astra' and 'leap'"));
}

BOOST_AUTO_TEST_CASE(leap_scan_gives_a_ball_where_it_is) {
  Leap leap;
  leap.width = leap.height = 2;
  leap.center_col = 0.5 * (BallScan::columns - 1) + 0.6;
  leap.center_row = 0.5 * (BallScan::rows - 1) - 0.4;
  leap.phis.clear();
  for (int k = 0; k < BallScan::views; ++k) leap.phis.push_back(6.0 * k + 20);
  // A ray as the documentation writes it: from sod theta - tau perpendicular along -theta + u perpendicular +
  // v z.
  const auto integral = [&](int k, int row, int column) {
    const double phi = (leap.phis[static_cast<std::size_t>(k)] - 90) * radians, c = std::cos(phi),
                 s = std::sin(phi);
    const double a = leap.width * (column - leap.center_col), b = leap.height * (row - leap.center_row),
                 ct = std::cos(leap.tilt_deg * radians), st = std::sin(leap.tilt_deg * radians);
    const double u = (a * ct - b * st) / leap.sdd, v = (a * st + b * ct) / leap.sdd;
    const Vec3 source{leap.sod * c + leap.tau * s, leap.sod * s - leap.tau * c, 0};
    return BallScan::chord(source, sum(source, {-c - u * s, -s + u * c, v}), BallScan::center);
  };
  const TemporaryFolder folder;
  static_cast<void>(folder.file("stack.mha", stack_bytes(BallScan::columns, BallScan::rows, BallScan::views,
                                                         "", BallScan::samples(integral))));
  static_cast<void>(folder.file("l.json", leap.text(BallScan::columns, BallScan::rows).dump()));
  static_cast<void>(folder.file(
      "scan.json", R"({"projections": "stack.mha", "description": "line integrals", "leap": "l.json"})"));
  check_ball(read_scan(folder.path()));
}
