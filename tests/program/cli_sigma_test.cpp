// Tolerances in sigma as a user types them: what is written, printed and refused.
#define BOOST_TEST_MODULE cli_sigma
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/charged.hpp"
#include "tests/support/command_line.hpp"

using namespace vdvr::support;
namespace fs = std::filesystem;

namespace {

// Counts with flats and darks, as a detector gives them.
const std::string& noisy() {
  static const std::string scan = [] {
    const std::string path = at("noisy.h5");
    const Ended made = run({"simulate", "--phantom", "sphere", "--detector", "65x9", "--angles", "90",
                            "--photons", "300", "-o", path});
    BOOST_TEST_REQUIRE(made.code == 0, made.err);
    return path;
  }();
  return scan;
}

nlohmann::json json_of(const std::vector<std::string>& words) {
  const Ended ended = run(words);
  BOOST_TEST_CONTEXT(ended.err) { BOOST_TEST_REQUIRE(ended.code == 0); }
  auto json = nlohmann::json::parse(ended.out, nullptr, false);
  BOOST_TEST_REQUIRE(json.is_object());
  return json;
}

const std::string& one_sigma() {
  static const std::string file = at("one.vdvr");
  return file;
}

// What `build` said of it.
const nlohmann::json& built() {
  static const auto json = json_of({"build", noisy(), "--epsilon", "1sigma", "-o", one_sigma(), "--json"});
  return json;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_volume_of_one_sigma_says_so_and_is_verified) {
  const auto& noise = built().at("certificate").at("noise");
  const std::string& file = one_sigma();
  BOOST_TEST(noise.at("tolerance_sigmas") == 1);
  BOOST_TEST(noise.at("source") == "flats");
  BOOST_TEST(noise.at("worst").at("buffer").get<double>() <= 1);
  BOOST_TEST(noise.at("worst").at("buffer").get<double>() > 0);
  BOOST_TEST(noise.at("rms").at("sigmas").get<double>() < noise.at("worst").at("buffer").get<double>());
  BOOST_TEST(run({"verify", file, "--projections", noisy()}).code == 0);
  BOOST_TEST(run({"info", file}).out.find("sigma of its brick") != std::string::npos);
  std::ofstream(at("p.csv")) << "x,y,z\n0,0,0\n1000,0,0\n";
  BOOST_TEST(run({"probe", file, "--points", at("p.csv"), "-o", at("v.csv")}).code == 0);
  std::ifstream values(at("v.csv"));
  std::string line;
  std::getline(values, line);
  BOOST_TEST(line == "x,y,z,value,bound,level,covered,sigma");
  std::getline(values, line);
  BOOST_TEST(std::stod(line.substr(line.rfind(',') + 1)) > 0);
  std::getline(values, line);
  BOOST_TEST(line == "1000,0,0,,,,0,");
}

BOOST_AUTO_TEST_CASE(a_tolerance_of_another_kind_is_told_in_sigma_too) {
  const std::string file = at("percent.vdvr");
  const auto percent = json_of({"build", noisy(), "--epsilon", "20%", "-o", file, "--json"});
  const auto& noise = percent.at("certificate").at("noise");
  BOOST_TEST(!noise.contains("tolerance_sigmas"));
  BOOST_TEST(noise.at("worst").at("buffer").get<double>() > 0);
}

// Bricks that are raised for a coarse texture unit are not foreseen.
BOOST_AUTO_TEST_CASE(plan_foresees_what_one_sigma_stores, *boost::unit_test::precondition(on_fp32_weights)) {
  const auto plan = json_of({"plan", noisy(), "--epsilon", "1sigma", "--json"});
  BOOST_TEST(plan.at("noise").at("field").at("epsilon_in_sigma") == 1);
  const double foreseen = plan.at("foreseen").at("samples_ratio").get<double>(),
               stored = built().at("storage").at("samples_ratio").get<double>();
  BOOST_TEST(std::abs(foreseen - stored) < 0.2 * stored);
}

BOOST_AUTO_TEST_CASE(plan_tells_of_rings) {
  const std::string small = at("small.h5");
  const Ended made = run({"simulate", "--phantom", "sphere", "--detector", "25x5", "--angles", "30",
                          "--photons", "300", "-o", small});
  BOOST_TEST_REQUIRE(made.code == 0, made.err);
  const auto field = json_of({"plan", small, "--epsilon", "4sigma", "--json"}).at("noise").at("field");
  BOOST_TEST(field.at("rings").at("flats") == 10);
  BOOST_TEST(field.at("rings").at("radius").get<double>() > 0);
}

BOOST_AUTO_TEST_CASE(sigma_is_drawn_and_exported) {
  built();
  const std::string& file = one_sigma();
  const auto of_slice = [&](const char* show) {
    return json_of(
        {"render", file, "--mode", "error", "--show", show, "-o", at("s.png"), "--force", "--json"});
  };
  const double sigma = of_slice("sigma").at("sigma").get<double>(),
               share = of_slice("error-in-sigma").at("bound_in_sigma").get<double>();
  const auto& noise = built().at("certificate").at("noise");
  BOOST_TEST(sigma <= noise.at("sigma").at("largest").get<double>() * (1 + 1e-6));
  BOOST_TEST(sigma >= noise.at("sigma").at("least").get<double>() * (1 - 1e-6));
  BOOST_TEST(share <= noise.at("worst").at("buffer").get<double>() * (1 + 1e-6));
  BOOST_TEST(share > 0);
  for (const char* mode : {"dvr", "iso", "mip"})
    for (const char* show : {"sigma", "error-in-sigma"})
      BOOST_TEST(run({"render", file, "--mode", mode, "--show", show, "-o", at("r.png"), "--size", "200x160",
                      "--force"})
                     .code == 0);
  BOOST_TEST(run({"export", file, "--sigma", "-o", at("v.npy")}).code == 0);
  BOOST_TEST(fs::file_size(at("v-sigma.npy")) == fs::file_size(at("v.npy")));
  const std::string clean = at("clean.vdvr");
  BOOST_TEST_REQUIRE(run({"build", small_scan(), "--epsilon", "5%", "-o", clean, "--force"}).code == 0);
  check_refused({"render", clean, "--mode", "error", "--show", "sigma", "-o", at("n.png")}, "noise");
  check_refused({"export", clean, "--sigma", "-o", at("n.mha")}, "noise");
  check_refused({"export", file, "--sigma", "-o", at("n.vtm")}, "--sigma");
  check_refused({"render", file, "--mode", "slice", "--show", "sigma", "-o", at("n.png")}, "--show");
  check_refused(
      {"render", file, "--mode", "error", "--show", "sigma", "--projections", noisy(), "-o", at("n.png")},
      "--projections");
}

BOOST_AUTO_TEST_CASE(run_goes_by_the_noise_where_nothing_is_asked) {
  const fs::path folder = at("result");
  const auto result = json_of({"run", noisy(), "-o", folder.string(), "--json"});
  BOOST_TEST(result.at("certificate").at("noise").at("tolerance_sigmas") == 1);
  BOOST_TEST(fs::exists(folder / "noise.png"));
  const Ended clean = run({"run", small_scan(), "-o", at("clean"), "--json"});
  BOOST_TEST_REQUIRE(clean.code == 0, clean.err);
  const auto json = nlohmann::json::parse(clean.out, nullptr, false);
  BOOST_TEST(std::abs(json.at("certificate").at("epsilon").get<double>() - 0.03) < 1e-12);
}

BOOST_AUTO_TEST_CASE(noise_goes_through_the_preparation) {
  const auto plain = json_of({"info", noisy(), "--json"}).at("noise");
  BOOST_TEST(plain.at("passed") == 1);
  const auto blurred =
      json_of({"plan", noisy(), "--epsilon", "3%", "--gaussian", "1,0", "--json"}).at("noise");
  BOOST_TEST(blurred.at("source") == "flats");
  BOOST_TEST(blurred.at("photons") == plain.at("photons"));
  // Of a Gaussian the integral of w^2 exp(-w^2) over that of w^2 to pi, of which 200,000 samples are good to
  // 2 %.
  constexpr double share = 0.0429;
  BOOST_TEST(std::abs(blurred.at("passed").get<double>() - share) <= 0.02 * share);
  // What is stated is of the unprepared ones.
  const auto stated =
      json_of({"plan", noisy(), "--epsilon", "3%", "--median", "3", "--photons", "300", "--json"});
  // At least what a median of 3 x 3 leaves in flat parts.
  BOOST_TEST(stated.at("noise").at("passed").get<double>() > 0.063);
  BOOST_TEST(stated.at("noise").at("passed").get<double>() < 0.5);
  const std::string file = at("blurred.vdvr");
  const auto result =
      json_of({"build", noisy(), "--epsilon", "2sigma", "--gaussian", "1,0", "-o", file, "--json"});
  BOOST_TEST(result.at("certificate").at("noise").at("sigma").at("median").get<double>() <
             0.5 * built().at("certificate").at("noise").at("sigma").at("median").get<double>());
  BOOST_TEST(run({"verify", file, "--projections", noisy()}).code == 0);
}

BOOST_AUTO_TEST_CASE(counts_of_single_photons_have_no_variance_to_go_by) {
  const std::string scan = at("dark.h5");
  BOOST_TEST_REQUIRE(run({"simulate", "--phantom", "sphere", "--detector", "65x9", "--angles", "90",
                          "--photons", "5", "-o", scan})
                         .code == 0);
  check_refused({"build", scan, "--epsilon", "1sigma", "-o", at("none.vdvr")}, "sigma-p");
}

BOOST_AUTO_TEST_CASE(what_sigma_cannot_mean_is_refused) {
  check_refused({"build", small_scan(), "--epsilon", "1sigma", "-o", at("none.vdvr")}, "--photons");
  check_refused({"build", noisy(), "--epsilon", "0sigma", "-o", at("none.vdvr")}, "above 0");
  check_refused({"build", noisy(), "--epsilon", "manysigma", "-o", at("none.vdvr")}, "not a finite number");
  check_refused({"build", noisy(), "--epsilon", "1sigma", "--epsilon-abs", "1", "-o", at("none.vdvr")},
                "--epsilon-abs");
  check_refused({"build", noisy(), "--epsilon", "1sigma", "--window", "0,1", "-o", at("none.vdvr")},
                "--window");
  check_refused({"build", noisy(), "-o", at("none.vdvr")}, "--epsilon 1sigma");
}
