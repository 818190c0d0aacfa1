// vdvr residual: what it writes, what it prints, what it refuses.
#define BOOST_TEST_MODULE cli_residual
#include <boost/test/unit_test.hpp>

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"

using namespace vdvr::support;

BOOST_AUTO_TEST_CASE(the_values_lie_in_the_file_and_their_summary_on_the_output) {
  const std::string npy = at("residual.npy"), png = at("residual.png");
  const Ended r =
      run({"residual", small_scan(), small_volume(), "-o", npy, "--picture", png, "--rows", "3,5", "--json"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const auto json = nlohmann::json::parse(r.out);
  BOOST_TEST(json.at("rows") == nlohmann::json::array({3, 5}));
  BOOST_TEST(json.at("rays").get<int>() == 48 * 3 * 33);
  BOOST_TEST(json.at("view_rms").size() == 48u);
  BOOST_TEST(json.at("column_rms").size() == 33u);
  // A simulated scan without noise, certified to 20 %.
  BOOST_TEST(json.at("unexplained").get<double>() < 0.01);
  BOOST_TEST(json.at("rms").get<double>() < 0.05 * json.at("measured_rms").get<double>());

  const std::string bytes = bytes_of(npy);
  BOOST_TEST(bytes.find("'shape': (48, 3, 33, 3)") != std::string::npos);
  const std::size_t values = std::size_t{48} * 3 * 33 * 3 * 4;
  BOOST_REQUIRE(bytes.size() > values);
  for (std::size_t i = bytes.size() - values; i < bytes.size(); i += 12) {
    std::array<float, 3> ray{};
    std::memcpy(ray.data(), bytes.data() + i, sizeof ray);
    BOOST_REQUIRE(!(ray[0] > ray[1]));
    BOOST_REQUIRE(!(ray[2] < 0));
  }
  BOOST_TEST(bytes_of(png).substr(1, 3) == "PNG");
}

BOOST_AUTO_TEST_CASE(every_form_is_written_and_read_back) {
  for (const char* name : {"one.h5", "one.mha", "one.nrrd", "one.png"}) {
    const Ended r = run({"residual", small_scan(), small_volume(), "-o", at(name), "--rows", "4,5"});
    BOOST_TEST(r.code == 0, r.err);
    BOOST_TEST(r.out.find("unexplained") != std::string::npos);
  }
  const Ended mha = run({"info", at("one.mha"), "--json"});
  BOOST_TEST(mha.code == 0, mha.err);
  check_no_temporary_file_is_left();
}

BOOST_AUTO_TEST_CASE(what_has_no_residual_is_refused_by_name) {
  const std::string out = at("refused.npy");
  check_refused({"residual", small_scan(), small_volume(), "-o", at("refused.tif")}, "refused.tif");
  check_refused({"residual", small_scan(), small_volume(), "-o", out, "--rows", "4,9"}, "0 to 8");
  check_refused({"residual", small_scan(), small_volume(), "-o", out, "--rows", "5,4"}, "--rows");
  check_refused({"residual", small_scan(), small_volume(), "-o", out, "--picture-row", "5"}, "--picture-row");
  check_refused({"residual", small_scan(), small_scan(), "-o", out}, "not a certified volume");
  check_refused({"residual", small_volume(), small_volume(), "-o", out}, "sphere.vdvr");
  const std::string other = at("other.h5");
  BOOST_REQUIRE(
      run({"simulate", "--phantom", "sphere", "--detector", "33x9", "--angles", "47", "-o", other}).code ==
      0);
  const Ended mismatch = run({"residual", other, small_volume(), "-o", out});
  BOOST_TEST(mismatch.code == 1);
  const Ended memory = run({"residual", small_scan(), small_volume(), "-o", out, "--max-memory", "100K"});
  BOOST_TEST(memory.code == 3);
  BOOST_TEST(!std::filesystem::exists(out));
}
