#define BOOST_TEST_MODULE transfer_function
#include <boost/test/unit_test.hpp>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/raycast.hpp"

using namespace vdvr;

namespace {

// A file of this test, removed with it.
struct TemporaryFile {
  std::filesystem::path path;
  explicit TemporaryFile(const std::string& text) {
    path = std::filesystem::temp_directory_path() / ("vdvr_transfer_" + std::to_string(::getpid()) + ".json");
    std::ofstream(path) << text;
  }
  ~TemporaryFile() { std::filesystem::remove(path); }
};

bool is_refused(const std::string& text, const std::string& reason) {
  const TemporaryFile file(text);
  try {
    read_transfer_function(file.path);
  } catch (const FileError& e) {
    const std::string what = e.what();
    return what.find(reason) != std::string::npos && what.find(file.path.string()) != std::string::npos;
  }
  return false;
}

// What ParaView and Slicer show is known to six digits (computed with VTK 9.7), which is far below what a
// picture of 8 bits shows: half a step.
const double half_step = 0.5 / 255;

TransferPoint value_of(const TransferFunction& f, double x) {
  const auto& p = f.points;
  if (x <= p.front().value) return p.front();
  const auto b = std::find_if(p.begin(), p.end(), [&](const auto& q) { return q.value >= x; });
  if (b == p.end()) return p.back();
  const auto a = std::prev(b);
  const double t = (x - a->value) / (b->value - a->value);
  TransferPoint out{x, {}, (1 - t) * a->opacity + t * b->opacity};
  for (std::size_t c = 0; c < 3; ++c) out.rgb[c] = (1 - t) * a->rgb[c] + t * b->rgb[c];
  return out;
}

void check_colour(const TransferFunction& f, double x, const std::array<double, 3>& expected) {
  const TransferPoint p = value_of(f, x);
  for (std::size_t c = 0; c < 3; ++c)
    BOOST_TEST(!(std::abs(p.rgb[c] - expected[c]) > half_step),
               "at " << x << ": " << p.rgb[c] << " for " << expected[c]);
}

TransferFunction read(const std::string& text) { return read_transfer_function(TemporaryFile(text).path); }

std::string paraview(const std::string& space, const std::string& more = "") {
  return R"([{"Name": "p", "ColorSpace": ")" + space +
         R"(", "RGBPoints": [0, 0.2, 0.3, 0.8, 1, 0.8, 0.2, 0.1])" + more + "}]";
}

std::string slicer(const std::string& opacity, const std::string& more = "") {
  return R"({"@schema": "volume-property-schema-v1.0.0.json#", "volumeProperties": [{"components": [{)" +
         more + R"("scalarOpacity": {"type": "piecewiseLinearFunction", "points": [)" + opacity +
         R"(]}, "rgbTransferFunction": {"type": "colorTransferFunction", "points": [
         {"x": -10, "color": [0, 0, 0], "midpoint": 0.5, "sharpness": 0},
         {"x": 30, "color": [1, 0.5, 0], "midpoint": 0.5, "sharpness": 0}]}}]}]})";
}

}  // namespace

BOOST_AUTO_TEST_CASE(presets_span_the_range_and_leave_air_clear) {
  for (const auto& [name, purpose] : transfer_presets()) {
    if (name == "mip") continue;  // opaque throughout: only its colours are used
    BOOST_TEST(!purpose.empty());
    const auto f = transfer_preset(name, -2, 6);
    BOOST_TEST(f.points.front().value == -2);
    BOOST_TEST(f.points.back().value == 6);
    BOOST_TEST(f.points.front().opacity == 0);
    BOOST_TEST(std::any_of(f.points.begin(), f.points.end(), [](const auto& p) { return p.opacity > 0; }));
    for (std::size_t i = 1; i < f.points.size(); ++i) BOOST_TEST(f.points[i].value > f.points[i - 1].value);
  }
}

BOOST_AUTO_TEST_CASE(unknown_preset_is_refused_with_the_list) {
  try {
    transfer_preset("purple", 0, 1);
    BOOST_FAIL("accepted");
  } catch (const InputError& e) {
    BOOST_TEST(std::string(e.what()).find("bone") != std::string::npos);
  }
}

BOOST_AUTO_TEST_CASE(json_points_are_read) {
  const TemporaryFile file(
      R"({"points": [{"value": -1, "rgb": [0, 0.5, 1], "opacity": 0}, {"value": 2.5, "rgb": [1, 1, 1], "opacity": 0.25}]})");
  const auto f = read_transfer_function(file.path);
  BOOST_REQUIRE(f.points.size() == 2);
  BOOST_TEST(f.points[0].rgb[1] == 0.5);
  BOOST_TEST(f.points[1].value == 2.5);
  BOOST_TEST(f.points[1].opacity == 0.25);
}

BOOST_AUTO_TEST_CASE(defective_files_are_refused_by_name_and_reason) {
  BOOST_TEST(is_refused("{\"points\": [", "JSON"));
  BOOST_TEST(is_refused("{}", "points"));
  BOOST_TEST(is_refused(R"({"points": []})", "points"));
  BOOST_TEST(is_refused(R"({"points": [{"value": 0, "rgb": [0, 0], "opacity": 0}]})", "rgb"));
  BOOST_TEST(is_refused(R"({"points": [{"value": 0, "rgb": [0, 0, 0], "opacity": 1.5}]})", "opacity"));
  BOOST_TEST(is_refused(R"({"points": [{"value": "x", "rgb": [0, 0, 0], "opacity": 1}]})", "value"));
  BOOST_TEST(is_refused(R"({"points": [{"value": 0, "rgb": [0, 0, 0]}]})", "opacity"));
  BOOST_TEST(is_refused(
      R"({"points": [{"value": 1, "rgb": [0,0,0], "opacity": 1}, {"value": 0, "rgb": [0,0,0], "opacity": 1}]})",
      "order"));
  BOOST_CHECK_THROW(read_transfer_function("no such file.json"), FileError);
}

BOOST_AUTO_TEST_CASE(files_of_no_known_kind_are_refused) {
  BOOST_TEST(is_refused("[]", "RGBPoints"));
  BOOST_TEST(is_refused("3", "no transfer function"));
  BOOST_TEST(is_refused("", "JSON"));
  BOOST_TEST(is_refused(R"({"points": [{"value": NaN, "rgb": [0,0,0], "opacity": 1}]})", "JSON"));
  BOOST_TEST(is_refused(R"({"points": [{"value": 1e40, "rgb": [0,0,0], "opacity": 1}]})", "value"));
  BOOST_TEST(is_refused("[" + std::string((16 << 20) + 1, ' ') + "]", "bytes"));
  std::string many = R"({"points": [)";
  for (int i = 0; i < 20000; ++i)
    many += std::string(i ? "," : "") + R"({"value": )" + std::to_string(i) +
            R"(, "rgb": [0,0,0], "opacity": 0})";
  BOOST_TEST(is_refused(many + "]}", "at most"));
  BOOST_CHECK_THROW(read_transfer_function(std::filesystem::temp_directory_path()), FileError);
}

BOOST_AUTO_TEST_CASE(paraview_colour_spaces_give_the_colours_that_paraview_shows) {
  check_colour(read(paraview("RGB")), 0.25, {0.35, 0.275, 0.625});
  const auto hsv = read(paraview("HSV"));
  check_colour(hsv, 0.25, {0.175, 0.8, 0.744196});
  check_colour(hsv, 0.75, {0.755804, 0.8, 0.125});
  check_colour(read(paraview("HSV", R"(, "HSVWrap": 1)")), 0.5, {0.792262, 0.15, 0.8});
  const auto lab = read(paraview("Lab"));
  check_colour(lab, 0.25, {0.501216, 0.273019, 0.625161});
  check_colour(lab, 0.75, {0.730517, 0.224385, 0.288422});
  const auto diverging = read(paraview("Diverging"));
  check_colour(diverging, 0.25, {0.600225, 0.677952, 1.0});
  check_colour(diverging, 0.5, {0.882859, 0.882874, 0.882859});
  check_colour(diverging, 0.75, {1.0, 0.629492, 0.5314});
  const auto step = read(paraview("Step"));
  check_colour(step, 0, {0.2, 0.3, 0.8});
  check_colour(step, 0.25, {0.8, 0.2, 0.1});
  const auto grey = read(R"({"ColorSpace": "Diverging",
    "RGBPoints": [0, 0.865, 0.865, 0.865, 1, 0.705882, 0.0156863, 0.14902]})");
  check_colour(grey, 0.25, {0.958908, 0.769631, 0.677996});
  check_colour(grey, 0.75, {0.869507, 0.378497, 0.299759});
  BOOST_TEST(is_refused(paraview("CMYK"), "CMYK"));
}

BOOST_AUTO_TEST_CASE(opacities_follow_midpoint_and_sharpness) {
  const auto at = [](const std::string& points, double x) {
    return value_of(read(paraview("RGB", R"(, "Points": [)" + points + "]")), x).opacity;
  };
  const auto is = [](double found, double expected) { return !(std::abs(found - expected) > half_step); };
  BOOST_TEST(is(at("0, 0.2, 0.3, 0, 1, 0.8, 0.5, 0", 0.25), 0.45));
  BOOST_TEST(is(at("0, 0.2, 0.3, 0, 1, 0.8, 0.5, 0", 0.5), 0.585714));
  BOOST_TEST(is(at("0, 0.2, 0.3, 0.6, 1, 0.8, 0.5, 0", 0.375), 0.698801));
  BOOST_TEST(is(at("0, 0.2, 0.7, 1, 1, 0.8, 0.5, 0", 0.625), 0.233625));
  BOOST_TEST(is(at("0, 0.2, 0.5, 0.3, 1, 0.8, 0.5, 0", 0.375), 0.278535));
  // Triples: value, opacity, midpoint.
  BOOST_TEST(is(at("0, 0.2, 0.3, 1, 0.8, 0.5", 0.25), 0.45));
  // Four nodes and three: twelve numbers make sense one way only.
  BOOST_TEST(is(at("0, 0, 0.5, 0.2, 1, 0.5, 0.5, 0, 0.5, 1, 0, 0.5", 0.35), 0.5));
}

BOOST_AUTO_TEST_CASE(preset_without_opacities_gets_a_ramp_and_says_so) {
  const auto f = read(paraview("RGB"));
  BOOST_TEST(f.name == "p");
  BOOST_TEST(f.note.find("ramp") != std::string::npos);
  BOOST_TEST(f.points.front().opacity == 0);
  BOOST_TEST(f.points.back().opacity == 1);
  BOOST_TEST(read(paraview("RGB", R"(, "Points": [0, 0, 0.5, 0, 1, 0.3, 0.5, 0])")).note.empty());
}

BOOST_AUTO_TEST_CASE(defective_presets_are_refused_by_name_and_reason) {
  BOOST_TEST(is_refused(R"([{"ColorSpace": "RGB"}])", "RGBPoints"));
  BOOST_TEST(is_refused(R"([{"RGBPoints": [0, 1, 1]}])", "four a point"));
  BOOST_TEST(is_refused(R"([{"RGBPoints": [0, 1, 1, 1, -1, 0, 0, 0]}])", "order"));
  BOOST_TEST(is_refused(R"([{"RGBPoints": [0, 1, 1, 7]}])", "[0, 1]"));
  BOOST_TEST(is_refused(R"([{"IndexedColors": [0, 1, 1]}])", "categories"));
  BOOST_TEST(is_refused(paraview("RGB", R"(, "Points": [1, 0, 0.5, 0, 0, 1, 0.5, 0])"), "Points"));
  BOOST_TEST(is_refused(paraview("RGB", R"(, "Points": [1, "a", 0.5, 0])"), "numbers"));
  BOOST_TEST(is_refused(paraview("RGB", R"(, "UseLogScale": 1)"), "UseLogScale"));
}

BOOST_AUTO_TEST_CASE(slicer_volume_properties_are_read_with_their_unit_distance) {
  const std::string opacity = R"({"x": -10, "y": 0, "midpoint": 0.5, "sharpness": 0},
    {"x": 10, "y": 0.2, "midpoint": 0.5, "sharpness": 0}, {"x": 50, "y": 0.6, "midpoint": 0.5, "sharpness": 0})";
  const auto f = read(slicer(opacity));
  BOOST_REQUIRE(f.points.size() == 4);
  check_colour(f, 10, {0.5, 0.25, 0});
  BOOST_TEST(!(std::abs(value_of(f, 30).opacity - 0.4) > tolerance::fp64_sum(8, 1)));
  BOOST_TEST(f.opacity_length == 1);

  const auto per_length = read(slicer(opacity, R"("scalarOpacityUnitDistance": 2, )"));
  BOOST_TEST(per_length.opacity_length == 2);
  Grid grid;
  grid.spacing = {4, 0.5, 1};
  const auto cell = per_base_cell(per_length, grid);
  // Four base cells pass what one unit distance passes.
  BOOST_TEST(!(std::abs(std::pow(1 - cell.points.back().opacity, 4) - 0.4) > tolerance::fp64_sum(16, 1)));
  BOOST_TEST(cell.opacity_length == 0);
}

BOOST_AUTO_TEST_CASE(defective_volume_properties_are_refused_by_name_and_reason) {
  BOOST_TEST(is_refused(R"({"volumeProperties": []})", "volumeProperties"));
  BOOST_TEST(is_refused(R"({"volumeProperties": [{}]})", "components"));
  BOOST_TEST(is_refused(slicer(""), "points"));
  BOOST_TEST(is_refused(slicer(R"({"x": 0})"), "'y' is missing"));
  BOOST_TEST(is_refused(slicer(R"({"x": 0, "y": 2})"), "[0, 1]"));
  BOOST_TEST(is_refused(slicer(R"({"x": 0, "y": 0}, {"x": -1, "y": 0})"), "order"));
  BOOST_TEST(is_refused(slicer(R"({"x": 0, "y": 0})", R"("scalarOpacityUnitDistance": 0, )"),
                        "scalarOpacityUnitDistance"));
}

BOOST_AUTO_TEST_CASE(stretching_maps_the_first_value_to_lo_and_the_last_to_hi) {
  const auto f = stretched(read(slicer(R"({"x": 0, "y": 0}, {"x": 10, "y": 1})")), 1, 5);
  BOOST_TEST(f.points.front().value == 1);
  BOOST_TEST(f.points.back().value == 5);
  BOOST_TEST(!(std::abs(f.points[1].value - 2) > tolerance::fp64_sum(8, 5)));
  BOOST_CHECK_THROW(stretched(f, 1, 0), InputError);
  BOOST_CHECK_THROW(stretched(f, NAN, 0), InputError);
}
