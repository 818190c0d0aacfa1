// Cone-beam geometry on the command line: what info says of it, and convert-geometry.
#define BOOST_TEST_MODULE cli_geometry
#include <boost/test/unit_test.hpp>

#include <filesystem>
#include <fmt/format.h>
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

// A simulated cone-beam scan as counts in an NXtomo file, with its distances; its path.
std::string nxtomo_scan() {
  const Ended made = run({"simulate", "--phantom", "sphere", "--cone", "60,90", "--pitch", "1.5",
                          "--detector", "20x12", "--angles", "24", "--force", "-o", at("simulated")});
  BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
  const vdvr::ProjectionSet scan = vdvr::read_scan(at("simulated"));
  const auto views = static_cast<hsize_t>(scan.geometry.views()),
             rows = static_cast<hsize_t>(scan.geometry.rows),
             columns = static_cast<hsize_t>(scan.geometry.columns), size = rows * columns;
  std::vector<double> frames(2 * size, 60000), keys(views + 2), angles(views + 2);
  std::fill_n(frames.begin(), size, 0);
  keys[0] = 2;
  keys[1] = 1;
  for (const float p : scan.data) frames.push_back(60000 * std::exp(-static_cast<double>(p)));
  for (hsize_t k = 0; k < views; ++k)
    angles[k + 2] = 360.0 * static_cast<double>(k) / static_cast<double>(views);
  Hdf5Writer file(at("scan.nxs"));
  const std::string detector = "/entry/instrument/detector/";
  for (const char* group : {"/entry", "/entry/instrument", "/entry/instrument/detector",
                            "/entry/instrument/source", "/entry/sample"})
    file.group(group);
  file.dataset(detector + "data", {views + 2, rows, columns}, frames);
  file.dataset(detector + "image_key", {views + 2}, keys, H5T_STD_I32LE);
  file.dataset("/entry/sample/rotation_angle", {views + 2}, angles, H5T_IEEE_F64LE);
  for (const auto& [name, value] : {std::pair<std::string, double>{detector + "x_pixel_size", 1.5},
                                    {detector + "y_pixel_size", 1.5},
                                    {detector + "distance", 30},
                                    {"/entry/instrument/source/distance", -60}}) {
    file.dataset(name, {1}, {value}, H5T_IEEE_F64LE);
    file.attribute(name, "units", "mm");
  }
  return at("scan.nxs");
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

// Of cone beam `build` takes what all views see, `reconstruct` a box around it.
BOOST_AUTO_TEST_CASE(info_shows_the_grid_of_build_and_that_of_reconstruct) {
  const std::string folder = circular_scan();
  const Ended r = run({"info", folder}), planned = run({"plan", folder, "--epsilon", "50%", "--json"});
  BOOST_REQUIRE_MESSAGE(r.code == 0 && planned.code == 0, r.err << planned.err);
  const json said = json::parse(run({"info", folder, "--json"}).out), plan = json::parse(planned.out);
  BOOST_TEST(said["certified_grid"] == plan["grid"]);
  BOOST_TEST(said["certified_grid"] != said["default_grid"]);
  const auto cells = [](const json& grid) {
    const json& n = grid["cells"];
    return fmt::format("{} x {} x {} cells", n[0].get<int>(), n[1].get<int>(), n[2].get<int>());
  };
  BOOST_TEST(has(r.out, "grid           " + cells(said["certified_grid"])));
  BOOST_TEST(has(r.out, "reconstruct  " + cells(said["default_grid"])));
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

BOOST_AUTO_TEST_CASE(nxtomo_is_cone_beam_where_it_is_asked_for_and_gives_the_field_of_scan_json) {
  const std::string nxs = nxtomo_scan(), folder = at("by_geometry");
  fs::create_directories(folder);
  fs::copy(nxs, folder + "/scan.nxs", fs::copy_options::overwrite_existing);
  write(folder + "/scan.json",
        json{{"hdf5", "scan.nxs"},
             {"geometry", {{"source_to_axis", 60}, {"source_to_detector", 90}, {"pitch", 1.5}}}}
            .dump());
  const Ended said = run({"info", nxs, "--beam", "cone"});
  BOOST_TEST(said.code == 0, said.err);
  for (const char* part : {"source to axis 60 mm, to detector 90 mm", "whatever its sign",
                           "sense of rotation assumed", "middle row", "sides of a pixel on the detector"})
    BOOST_TEST(has(said.out, part));
  BOOST_TEST(!has(run({"info", nxs}).out, "source to axis"));
  BOOST_TEST(run({"convert-geometry", nxs, "--beam", "cone", "-o", at("nxs.xml")}).code == 0);
  check_refused({"convert-geometry", nxs, "-o", at("parallel.xml")}, "parallel beam");

  // The same field to the bit: on the device, and by definition.
  const auto volume = [&](const std::vector<std::string>& in, const std::string& name) {
    std::vector<std::string> words{"reconstruct"};
    words.insert(words.end(), in.begin(), in.end());
    words.insert(words.end(), {"-o", at(name), "--force"});
    const Ended r = run(words);
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    return bytes_of(at(name));
  };
  BOOST_TEST((volume({nxs, "--beam", "cone"}, "a.mha") == volume({folder}, "b.mha")));
  BOOST_TEST((volume({nxs, "--beam", "cone"}, "a.mha") != volume({nxs, "--center", "9.5"}, "c.mha")));
  write(at("p.csv"), "x,y,z\n0,0,0\n2,-1,1\n-3,2,-1\n");
  const auto probed = [&](const std::vector<std::string>& in) {
    std::vector<std::string> words{"probe"};
    words.insert(words.end(), in.begin(), in.end());
    words.insert(words.end(), {"--exact", "--points", at("p.csv"), "-o", at("v.csv"), "--force"});
    const Ended r = run(words);
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    return bytes_of(at("v.csv"));
  };
  BOOST_TEST(probed({nxs, "--beam", "cone"}) == probed({folder}));
}

BOOST_AUTO_TEST_CASE(certificate_of_an_nxtomo_cone_is_verified_with_and_without_the_option) {
  const std::string nxs = nxtomo_scan(), file = at("cone.vdvr");
  const Ended planned = run({"plan", nxs, "--beam", "cone", "--epsilon", "30%"});
  BOOST_TEST(planned.code == 0, planned.err);
  const Ended built = run({"build", nxs, "--beam", "cone", "--epsilon", "30%", "-o", file});
  BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
  for (const std::vector<std::string>& option : {std::vector<std::string>{}, {"--beam", "cone"}}) {
    std::vector<std::string> words{"verify", file, "--projections", nxs, "--exhaustive"};
    words.insert(words.end(), option.begin(), option.end());
    const Ended r = run(words);
    BOOST_TEST(r.code == 0, r.err);
  }
  BOOST_TEST(run({"verify", file, "--projections", nxs, "--beam", "parallel"}).code == 1);
}

BOOST_AUTO_TEST_CASE(cone_beam_that_no_distance_tells_of_is_refused_by_its_option) {
  check_refused({"info", small_scan(), "--beam", "cone"}, "--beam");
  check_refused({"reconstruct", small_scan(), "--beam", "cone", "-o", at("never.mha")}, "--beam");
  check_refused({"info", circular_scan(), "--beam", "cone"}, "leave --beam out");
  check_refused({"info", small_scan(), "--beam", "fan"}, "--beam");
  BOOST_TEST(!fs::exists(at("never.mha")));
}
