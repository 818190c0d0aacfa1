// Runs the commands that plan, build, check and probe a certified volume: what they write, and what they
// refuse.
#define BOOST_TEST_MODULE cli_build
#include <boost/test/unit_test.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"

using namespace vdvr::support;
namespace fs = std::filesystem;

BOOST_AUTO_TEST_CASE(settings_that_exclude_each_other_are_refused) {
  const std::vector<std::string> build{"build", "x.h5", "--epsilon", "3%", "-o", at("excluded.vdvr")};
  const auto with = [&](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  check_refused(with(build, {"--closing", "paper"}), "--coefficients sampled");
  check_refused(with(build, {"--paper", "--coefficients", "midrange"}), "--coefficients sampled");
  check_refused({"run", "x.h5", "--epsilon", "3%", "-o", at("run"), "--paper"}, "use vdvr build");
}

BOOST_AUTO_TEST_CASE(a_volume_for_comparison_carries_no_certificate) {
  const std::string file = at("comparison.vdvr");
  const Ended built = run({"build", small_scan(), "--epsilon", "20%", "--paper", "-o", file});
  BOOST_TEST(built.code == 1);
  BOOST_TEST(last_line(built.err) == "vdvr build: a volume for comparison: nothing is certified\n");
  const auto json = nlohmann::json::parse(run({"info", file, "--json"}).out, nullptr, false);
  BOOST_REQUIRE(json.is_object());
  BOOST_TEST(!json.contains("certificate"));
  BOOST_TEST(!json.at("comparison").contains("holds"));
  BOOST_TEST(json.at("content_sha256") == json.at("comparison").at("content_sha256"));
  const Ended verified = run({"verify", file, "--projections", small_scan()});
  BOOST_TEST(verified.code == 1);
  BOOST_TEST(verified.err.find("carries no promise to verify") != std::string::npos);
  BOOST_TEST(run({"render", file, "-o", at("comparison.png"), "--size", "32x32"}).code == 0);
}

// The paper's closing and coefficients alone leave all that a certificate needs.
BOOST_AUTO_TEST_CASE(the_paper_s_closing_and_coefficients_are_certified) {
  const std::string file = at("closed.vdvr");
  const Ended built = run({"build", small_scan(), "--epsilon", "20%", "--closing", "paper", "--coefficients",
                           "sampled", "--epsilon-of", "max", "-o", file});
  BOOST_TEST(built.code == 0, built.err);
  const auto json = nlohmann::json::parse(run({"info", file, "--json"}).out, nullptr, false);
  BOOST_REQUIRE(json.is_object());
  BOOST_TEST(json.at("certificate").at("holds").at("buffer").get<bool>());
  BOOST_TEST(json.at("certificate").at("options").at("epsilon_of") == "max");
}

BOOST_AUTO_TEST_CASE(info_shows_storage_beside_the_certificate) {
  const std::string volume = small_volume();
  const auto json = nlohmann::json::parse(run({"info", volume, "--json"}).out, nullptr, false);
  BOOST_REQUIRE(json.is_object());
  BOOST_TEST(json["certificate"]["holds"]["buffer"].get<bool>());
  for (const std::string key : {"samples_ratio", "bytes_ratio", "file_bytes"}) {
    BOOST_TEST(json["storage"].contains(key));
    BOOST_TEST(json["storage"]["interior"].contains(key));
  }
  BOOST_TEST(json["storage"]["file_bytes"].get<std::uintmax_t>() == fs::file_size(volume));
}

BOOST_AUTO_TEST_CASE(verify_rejects_other_projections_with_code_1) {
  const std::string other = at("other.h5");
  BOOST_REQUIRE(
      run({"simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "47", "-o", other}).code ==
      0);
  const Ended r = run({"verify", small_volume(), "--projections", other});
  BOOST_TEST(r.code == 1);
  BOOST_TEST(last_line(r.err).find("sha256") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(probe_answers_every_point_in_order) {
  write(at("p.csv"), "x,y,z\n0,0,0\n1000,0,0\n-2.5,1.25,0.5\n");
  const std::string volume = small_volume(), scan = small_scan();
  BOOST_REQUIRE(run({"probe", volume, "--points", at("p.csv"), "-o", at("v.csv")}).code == 0);
  BOOST_REQUIRE(
      run({"probe", scan, "--exact", "--like", volume, "--points", at("p.csv"), "-o", at("f.csv")}).code ==
      0);
  std::ifstream certified(at("v.csv")), exact(at("f.csv"));
  std::string v, f;
  std::getline(certified, v);
  std::getline(exact, f);
  BOOST_TEST(v == "x,y,z,value,bound,level,covered");
  BOOST_TEST(f == v);
  for (int point = 0; point < 3; ++point) {
    BOOST_REQUIRE(std::getline(certified, v));
    BOOST_REQUIRE(std::getline(exact, f));
    if (point == 1) {
      BOOST_TEST(v == "1000,0,0,,,,0");
      BOOST_TEST(f == v);
      continue;
    }
    double x = 0, y = 0, z = 0, value = 0, bound = 0, truth = 0;
    BOOST_REQUIRE(std::sscanf(v.c_str(), "%lf,%lf,%lf,%lf,%lf", &x, &y, &z, &value, &bound) == 5);
    BOOST_REQUIRE(std::sscanf(f.c_str(), "%lf,%lf,%lf,%lf", &x, &y, &z, &truth) == 4);
    BOOST_TEST(std::abs(value - truth) <= bound);
  }
  write(at("bad.csv"), "x,y,z\n1,2\n");
  check_refused({"probe", volume, "--points", at("bad.csv"), "-o", at("bad-out.csv")}, "line 2");
  check_refused({"probe", scan, "--points", at("p.csv"), "-o", at("bad-out.csv")}, "--exact");
}

// plan, build, verify and probe of a part of the default grid.
BOOST_AUTO_TEST_CASE(a_region_of_interest_without_a_size_is_all_that_is_planned_and_built) {
  const std::string file = at("region.vdvr"), box = "--roi=-3,-2,-1,2,3,1";
  const auto json_of = [](const std::vector<std::string>& words) {
    const Ended r = run(words);
    BOOST_TEST_CONTEXT(r.err) { BOOST_REQUIRE(r.code == 0); }
    return nlohmann::json::parse(r.out);
  };
  const auto whole = json_of({"plan", small_scan(), "--epsilon", "20%", "--json"}),
             part = json_of({"plan", small_scan(), "--epsilon", "20%", box, "--json"});
  const auto start = std::chrono::steady_clock::now();
  const auto built = json_of({"build", small_scan(), "--epsilon", "20%", box, "-o", file, "--json"});
  const double seconds_of_build =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  BOOST_TEST(part["grid"]["cells"][0].get<int>() < whole["grid"]["cells"][0].get<int>());
  BOOST_TEST(part["grid"] == built["grid"]);
  BOOST_TEST(part["notes"].dump().find("`roi`") != std::string::npos);
  BOOST_TEST(built["certificate"]["roi"].size() == 6u);
  // Of all that the command did, not of its stages after the plan alone.
  double sum = 0;
  for (const auto& [stage, seconds] : built["seconds"].items()) sum += seconds.get<double>();
  BOOST_TEST(built["seconds"]["plan"].get<double>() > 0);
  BOOST_TEST(sum <= seconds_of_build);
  BOOST_TEST(run({"verify", file, "--projections", small_scan(), "--exhaustive"}).code == 0);
  check_refused({"plan", small_scan(), "--epsilon", "20%", box, "--size", "8x8x8"}, "--size");
  check_refused({"plan", small_scan(), "--epsilon", "20%", "--roi=90,0,0,91,1,1"}, "meets no brick");
}

BOOST_AUTO_TEST_CASE(run_writes_the_certificate_and_the_pictures) {
  const std::string output = at("run");
  const Ended r = run({"run", small_scan(), "--epsilon", "20%", "-o", output, "--json"});
  BOOST_TEST_CONTEXT(r.err) { BOOST_REQUIRE(r.code == 0); }
  const auto json = nlohmann::json::parse(r.out, nullptr, false);
  BOOST_REQUIRE(json.is_object());
  for (const auto& [name, what] : json["files"].items())
    BOOST_TEST(fs::exists(fs::path(output) / name), name);
  const auto certificate =
      nlohmann::json::parse(bytes_of(fs::path(output) / "certificate.json"), nullptr, false);
  BOOST_REQUIRE(certificate.is_object());
  BOOST_TEST(certificate["holds"]["buffer"].get<bool>());
  BOOST_TEST(json["error_slice"]["max_error"].get<double>() <= certificate["epsilon_abs"].get<double>());
}

// Nodes around what is covered are tested too: of this scan the one that errs most lies beside it.
BOOST_AUTO_TEST_CASE(run_draws_the_error_where_the_scan_covers) {
  const std::string scan = at("few-rows"), output = at("run-few-rows");
  const Ended made = run({"simulate", "--phantom", "shepp-logan", "--pitch", ".05", "--cone", "20,30",
                          "--detector", "49x7", "--angles", "30", "--tilt", "2,-1", "-o", scan});
  BOOST_TEST_CONTEXT(made.err) { BOOST_REQUIRE(made.code == 0); }
  const Ended r = run({"run", scan, "--epsilon", "15%", "-o", output, "--json"});
  BOOST_TEST_CONTEXT(r.err) { BOOST_REQUIRE(r.code == 0); }
  const auto certificate = nlohmann::json::parse(bytes_of(fs::path(output) / "certificate.json"));
  const auto z = certificate["covered"]["z"];
  const double worst = certificate["worst_at"][2].get<double>();
  BOOST_TEST((worst < z[0].get<double>() || worst > z[1].get<double>()));
  BOOST_TEST(nlohmann::json::parse(r.out)["error_slice"]["max_error"].get<double>() > 0);
}
