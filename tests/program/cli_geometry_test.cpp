// Cone-beam geometry on the command line: what info says of it, and convert-geometry.
#define BOOST_TEST_MODULE cli_geometry
#include <boost/test/unit_test.hpp>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/command_line.hpp"
#include "tests/support/scan_files.hpp"

using namespace vdvr::support;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

// A scan of 12 views of 16 x 12 pixels with a detector that is tilted in its plane; its folder.
std::string cone_scan(const std::string& name, const json& members, const std::string& place) {
  fs::create_directories(at(name));
  write(at(name) + "/stack.mha", stack_bytes(16, 12, 12, place));
  json scan{{"projections", "stack.mha"}, {"description", "line integrals"}, {"unit", "cm"}};
  scan.update(members);
  write(at(name) + "/scan.json", scan.dump());
  return at(name);
}

std::string circular_scan() {
  json angles = json::array();
  for (int k = 0; k < 12; ++k) angles.push_back(30 * k);
  return cone_scan("circular",
                   {{"geometry",
                     {{"source_to_axis", 100},
                      {"source_to_detector", 150},
                      {"pitch", {0.4, 0.5}},
                      {"angles", angles},
                      {"tilt", {2, 0}}}}},
                   "");
}

json info_of(const std::string& folder) {
  const Ended r = run({"info", folder, "--json"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  return json::parse(r.out)["cone"];
}

// Numbers that went through text of seventeen digits and back through angles.
constexpr double same = 1e-12;

double largest_difference(const json& a, const json& b) {
  double largest = 0;
  const json x = a.flatten(), y = b.flatten();
  BOOST_REQUIRE(x.size() == y.size());
  for (const auto& [key, value] : x.items())
    largest = std::max(largest, std::abs(value.get<double>() - y.at(key).get<double>()));
  return largest;
}

}  // namespace

BOOST_AUTO_TEST_CASE(info_says_distances_angles_and_what_was_assumed) {
  const std::string folder = circular_scan();
  const Ended r = run({"info", folder});
  BOOST_TEST(r.code == 0, r.err);
  for (const char* part :
       {"source to axis 100 cm, to detector 150 cm, magnification 1.5", "isocentre at column 7.5 and row 5.5",
        "arc 330.00 degrees (full-turn)", "in plane 2, out of plane", "sense of rotation assumed"})
    BOOST_TEST(has(r.out, part));
  const json cone = info_of(folder);
  BOOST_TEST(cone["redundancy"] == "full-turn");
  BOOST_TEST(cone["matrices"].size() == 12u);
  // Half of 16 pixels of 0.4, at 150.
  const double half_fan = std::atan(8 * 0.4 / 150) * 180 / pi;
  BOOST_TEST(std::abs(cone["half_fan_deg"].get<double>() - half_fan) <= same * half_fan);
}

BOOST_AUTO_TEST_CASE(converted_geometry_is_read_back_with_the_stack_that_was_printed) {
  const std::string folder = circular_scan(), xml = at("geometry.xml");
  const Ended made = run({"convert-geometry", folder, "-o", xml, "--json"});
  BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
  const json place = json::parse(made.out);
  BOOST_TEST(std::abs(place["spacing"][0].get<double>() - 0.4) <= same);
  const std::string header = "Offset = " + place["origin"][0].dump() + " " + place["origin"][1].dump() +
                             " 0\nElementSpacing = " + place["spacing"][0].dump() + " " +
                             place["spacing"][1].dump() + " 1\n";
  const std::string again = cone_scan("again", {{"rtk_geometry", "geometry.xml"}}, header);
  fs::copy(xml, again + "/geometry.xml", fs::copy_options::overwrite_existing);
  BOOST_TEST(largest_difference(info_of(folder)["matrices"], info_of(again)["matrices"]) <= 100 * same);
  check_refused({"convert-geometry", folder, "-o", xml}, "--force");
}

BOOST_AUTO_TEST_CASE(geometry_that_cannot_be_converted_is_refused_and_nothing_is_written) {
  const std::string folder = circular_scan(), xml = at("refused.xml");
  check_refused({"convert-geometry", small_scan(), "-o", xml}, "parallel beam");
  check_refused({"convert-geometry", folder, "-o", xml, "--pitch", "0.4,0.4"},
                "view 0: no circular parameters");
  check_refused({"convert-geometry", folder, "-o", xml, "--pitch", "0"}, "--pitch");
  check_refused({"convert-geometry", folder, "-o", xml, "--center", "99"}, "centre 99");
  BOOST_TEST(!fs::exists(xml));
  check_no_temporary_file_is_left();
}
