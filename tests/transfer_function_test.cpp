#define BOOST_TEST_MODULE transfer_function
#include <boost/test/unit_test.hpp>

#include <unistd.h>

#include <fstream>

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

}  // namespace

BOOST_AUTO_TEST_CASE(presets_span_the_range_and_leave_air_clear) {
  for (const char* name : {"default", "grey", "bone", "soft"}) {
    const auto f = transfer_preset(name, -2, 6);
    BOOST_TEST(f.points.front().value == -2);
    BOOST_TEST(f.points.back().value == 6);
    BOOST_TEST(f.points.front().opacity == 0);
    BOOST_TEST(f.points.back().opacity > 0);
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
