// Runs `vdvr render` itself: views and settings that are refused, every form of picture, projections and
// error pictures.
#define BOOST_TEST_MODULE cli_render
#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr::support;
namespace fs = std::filesystem;

namespace {

// Of an .npy picture of float32, which end the file: those of pixels that show something.
std::vector<float> shown_in(const std::string& picture, std::size_t pixels) {
  const std::string bytes = bytes_of(picture);
  std::vector<float> all(pixels), out;
  BOOST_REQUIRE(bytes.size() > 4 * pixels);
  BOOST_TEST((bytes.size() - 4 * pixels) % 64 == 0);  // its header
  std::memcpy(all.data(), bytes.data() + bytes.size() - 4 * pixels, 4 * pixels);
  std::copy_if(all.begin(), all.end(), std::back_inserter(out), [](float v) { return !std::isnan(v); });
  return out;
}

}  // namespace

BOOST_AUTO_TEST_CASE(projections_are_drawn_only_as_d2vr_can) {
  const auto d2vr = [&](const std::vector<std::string>& more, const std::string& named) {
    std::vector<std::string> words{"render", "x.h5", "-o", at("d2vr.png"), "--method", "d2vr"};
    words.insert(words.end(), more.begin(), more.end());
    check_refused(words, named);
  };
  for (const char* mode : {"iso", "mip", "integral", "slice"}) d2vr({"--mode", mode}, "--mode dvr");
  d2vr({"--classification", "preintegrated"}, "--classification");
  d2vr({"--step-mode", "level"}, "--step-mode");
  d2vr({"--step-mode", "adaptive"}, "--step-mode");
  d2vr({"--gradient", "stored"}, "--gradient");
  d2vr({"--sampler", "image3d"}, "--sampler");
  check_refused({"render", "x.vdvr", "-o", at("d2vr.png"), "--cells", "4x4x4"}, "--method d2vr");
  check_refused({"bench", "render", "x.vdvr", "--no-skip"}, "--method d2vr");
}

BOOST_AUTO_TEST_CASE(views_that_contradict_themselves_are_refused) {
  const auto render = [&](const std::string& output, const std::vector<std::string>& more,
                          const std::string& named) {
    std::vector<std::string> words{"render", "x.mha", "-o", at(output)};
    words.insert(words.end(), more.begin(), more.end());
    check_refused(words, named);
  };
  render("x.png", {"--camera-position", "1,2,3", "--azimuth", "3"}, "--azimuth");
  render("x.png", {"--camera-view-angle", "20", "--zoom", "2"}, "--zoom");
  render("x.png", {"--camera-position", "1,2,3", "--turntable", "4"}, "--turntable");
  render("x.png", {"--turntable", "4"}, ".apng");
  render("x.gif", {}, "--turntable");
  render("x.jpg", {}, ".png");
  render("x.npy", {"--axes"}, "--axes");
  render("x.png", {"--mode", "slice", "--box"}, "--box");
  render("x.png", {"--mode", "slice", "--azimuth", "3"}, "--azimuth");
  render("x.png", {"--mode", "slice", "--frame", "grid"}, "--frame");
  render("x.png", {"--frame", "all"}, "--frame");
  render("x.png", {"--mode", "iso", "--colorbar"}, "--colorbar");
  render("x.png", {"--mode", "iso", "--tf", "bone"}, "--tf");
  render("x.png", {"--mode", "mip", "--no-shading"}, "--no-shading");
  render("x.png", {"--mode", "mip", "--show", "normal"}, "--show");
  render("x.png", {"--mode", "slice", "--show", "depth"}, "--show");
  render("x.png", {"--mode", "iso", "--show", "depth", "--box"}, "--box");
  render("x.png", {"--iso-opacity", "0.5"}, "--iso-opacity");
  render("x.png", {"--background", "1,2,3"}, "--background");
  render("x.png", {"--light", "left"}, "--light");
  render("x.png", {"--light", "1,2"}, "--light");
  render("x.png", {"--light", "head", "--no-shading"}, "--light");
  render("x.png", {"--mode", "mip", "--gradient", "central"}, "--gradient");
  render("x.png", {"--mode", "iso", "--step-mode", "level"}, "--step-mode");
  for (const char* option : {"--no-shading", "--tf=bone", "--step=2", "--background=0,0,0", "--light=head",
                             "--show=depth", "--show=normal", "--show=error", "--iso=1", "--plain"})
    render("x.png", {"--mode", "integral", option},
           std::string(option).substr(0, std::string(option).find('=')));
  render("x.png", {"--mode", "slice", "--classification", "post"}, "--classification");
  render("x.png", {"--classification", "preintegrated", "--step-mode", "level"}, "--step-mode");
  render("x.png", {"--classification", "preintegrated", "--step-mode", "adaptive"}, "--step-mode");
  render("x.png", {"--background", "0.5,0.5"}, "--background");
}

BOOST_AUTO_TEST_CASE(presets_are_listed_without_a_volume) {
  const Ended r = run({"render", "--tf", "list"});
  BOOST_TEST(r.code == 0);
  BOOST_TEST(r.out.find("marschner-lobb") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_volume_is_rendered_as_picture_values_and_turntable) {
  const std::string volume = at("ramp.mha");
  {
    std::string bytes =
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 8 8 8\nElementType = MET_UCHAR\n"
        "ElementDataFile = LOCAL\n";
    for (int i = 0; i < 512; ++i) bytes.push_back(static_cast<char>(i % 64));
    write(volume, bytes);
  }
  const std::vector<std::string> render{"render", volume, "--size", "24x16", "--quiet", "--force"};
  const auto draw = [&](const std::string& output, const std::vector<std::string>& more) {
    std::vector<std::string> words = render;
    words.insert(words.end(), {"-o", at(output)});
    words.insert(words.end(), more.begin(), more.end());
    const Ended r = run(words);
    BOOST_TEST(r.code == 0, r.err);
    BOOST_TEST(r.out.empty());
  };
  draw("ramp.png", {"--tf", "bone", "--axes", "--box", "--colorbar", "--caption"});
  for (const char* mode : {"dvr", "iso", "mip", "integral", "slice"}) {
    draw("ramp.npy", {"--mode", mode});
    const std::string bytes = bytes_of(at("ramp.npy"));
    BOOST_TEST(bytes.find("(16, 24)") != std::string::npos);
    BOOST_TEST(bytes.size() % 64 == (16 * 24 * 4) % 64);
  }
  draw("ramp.png",
       {"--light", "head", "--light", "1,0,-1", "--gradient", "analytic", "--step-mode", "level"});
  draw("ramp.png", {"--classification", "preintegrated"});
  draw("ramp.png", {"--step-mode", "fixed", "--frame", "grid"});
  draw("integral.png", {"--mode", "integral", "--tf-range", "0,40", "--colorbar", "--box", "--axes"});
  draw("integral.gif", {"--mode", "integral", "--turntable", "2"});
  draw("ramp.apng", {"--turntable", "3", "--tf", "grey", "--tf-range", "0,63"});
  draw("ramp.gif", {"--turntable", "3"});
  BOOST_TEST(bytes_of(at("ramp.gif")).rfind("GIF89a", 0) == 0);
  draw("turn", {"--turntable", "3"});
  BOOST_TEST(fs::exists(at("turn/frame-0002.png")));
  // A shorter turn leaves nothing of the longer one behind.
  draw("turn", {"--turntable", "2"});
  BOOST_TEST(!fs::exists(at("turn/frame-0002.png")));
  // The window of a slice: all of the ramp lies below the first two and above the third.
  const auto slice = [&](const char* window) {
    draw("window.png", {"--mode", "slice", "--tf-range", window});
    return bytes_of(at("window.png"));
  };
  const std::string black = slice("1000,2000");
  BOOST_TEST((black == slice("3000,4000")));
  BOOST_TEST((black != slice("-2000,-1000")));
  BOOST_TEST((black != slice("auto")));
  check_refused({"render", volume, "-o", at("z.png"), "--mode", "slice", "--tf-range", "3,1"}, "--tf-range");
  check_refused({"render", volume, "-o", at("z.png"), "--mode", "error", "--tf-range", "1,3"}, "--tf-range");
  check_refused({"render", volume, "-o", at("z.png"), "--tf", "purple"}, "purple");
  check_refused({"render", volume, "-o", at("z.png"), "--tf-range", "3,1"}, "--tf-range");
  check_refused({"render", volume, "-o", at("z.png"), "--camera-position", "0,0,50", "--camera-focal-point",
                 "0,0,0", "--camera-view-up", "0,0,1"},
                "--camera-view-up");
  check_refused({"render", at("ramp.h5") + ":/volume", "-o", at("z.png")}, "ramp.h5: no such file");
}

BOOST_AUTO_TEST_CASE(an_error_picture_without_projections_is_what_the_certificate_says_of_each_brick) {
  const std::string volume = small_volume(), picture = at("bound.npy");
  const auto certificate =
      nlohmann::json::parse(run({"info", volume, "--json"}).out, nullptr, false)["certificate"];
  const Ended r =
      run({"render", volume, "-o", picture, "--mode", "error", "--size", "160x64", "--json", "--force"});
  BOOST_REQUIRE_EQUAL(r.code, 0);
  const auto json = nlohmann::json::parse(r.out, nullptr, false);
  const double total = certificate["total"]["buffer"].get<double>();
  const std::vector<float> bounds = vdvr::brick_bounds(vdvr::read_vdvr(volume).certificate, false);
  const std::set<float> known(bounds.begin(), bounds.end());
  BOOST_TEST(total <= certificate["epsilon_abs"].get<double>());
  // Beside the slice, whose pixels are square, there is nothing.
  const std::vector<float> bounded = shown_in(picture, 160 * 64);
  for (const float bound : bounded) BOOST_REQUIRE(known.contains(bound));
  BOOST_REQUIRE(!bounded.empty());
  const float largest = *std::max_element(bounded.begin(), bounded.end());
  BOOST_TEST(json["bound"].get<double>() == static_cast<double>(largest));
  // Two sums and a product in fp32 lie between the total of the whole and the largest of a brick.
  BOOST_TEST(static_cast<double>(largest) <= total * (1 + 0x1p-19));
  BOOST_TEST(bounded.size() == json["pixels"].get<std::size_t>());
  BOOST_TEST(run({"render", volume, "-o", at("bound.png"), "--mode", "error"}).code == 0);
  BOOST_TEST(fs::exists(at("bound.png")));
  // And along rays, of what is seen.
  const std::string seen = at("seen.npy");
  BOOST_REQUIRE_EQUAL(run({"render", volume, "-o", seen, "--show", "error", "--size", "64x64"}).code, 0);
  const std::vector<float> met = shown_in(seen, 64 * 64);
  BOOST_TEST(!met.empty());
  for (const float bound : met) BOOST_REQUIRE(known.contains(bound));
  BOOST_TEST(run({"render", volume, "-o", at("seen.png"), "--show", "error"}).code == 0);
  check_refused({"render", volume, "-o", at("no.png"), "--show", "error", "--method", "dvr"}, "--show error");
}

BOOST_AUTO_TEST_CASE(projections_are_drawn_and_probed_without_a_volume) {
  const std::string scan = small_scan(), picture = at("d2vr.npy"), without = at("d2vr-no-skip.npy");
  const Ended r = run({"render", scan, "--method", "d2vr", "--size", "24x24", "-o", picture, "--json"});
  BOOST_REQUIRE(r.code == 0);
  const auto json = nlohmann::json::parse(r.out);
  BOOST_TEST(json.at("method") == "d2vr");
  BOOST_TEST(json.at("verified") == false);
  BOOST_TEST(json.at("resident_bytes").get<double>() > 0);
  BOOST_REQUIRE(
      run({"render", scan, "--method", "d2vr", "--size", "24x24", "--no-skip", "-o", without}).code == 0);
  BOOST_TEST(bytes_of(picture) == bytes_of(without));

  write(at("q.csv"), "x,y,z\n0,0,0\n1000,0,0\n");
  BOOST_REQUIRE(run({"probe", scan, "--method", "d2vr", "--points", at("q.csv"), "-o", at("d.csv")}).code ==
                0);
  std::istringstream lines(bytes_of(at("d.csv")));
  std::string line;
  std::getline(lines, line);
  std::getline(lines, line);
  BOOST_TEST(line.rfind("0,0,0,", 0) == 0);
  BOOST_TEST(line.substr(line.size() - 4) == ",,,1");
  std::getline(lines, line);
  BOOST_TEST(line == "1000,0,0,,,,0");
  check_refused({"probe", scan, "--method", "d2vr", "--exact", "--points", at("q.csv"), "-o", at("e.csv")},
                "--exact");
}
