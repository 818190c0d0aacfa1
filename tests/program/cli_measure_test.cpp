// vdvr measure: what it prints and writes, what it refuses.
#define BOOST_TEST_MODULE cli_measure
#include <boost/test/unit_test.hpp>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"

using namespace vdvr::support;
using nlohmann::json;

namespace {

json measured(std::vector<std::string> words) {
  words.insert(words.begin(), {"measure", small_volume()});
  words.insert(words.end(), {"--json", "--quiet"});
  const Ended r = run(words);
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  return json::parse(r.out);
}
double lo(const json& j, const char* name) { return j.at(name).at("lo").get<double>(); }
double hi(const json& j, const char* name) { return j.at(name).at("hi").get<double>(); }

std::size_t lines_of(const std::string& path) {
  const std::string text = bytes_of(path);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

BOOST_AUTO_TEST_CASE(numbers_come_as_intervals_that_fit_together) {
  const json all = measured({"--above", "0.5", "--mean", "--mass", "--extremes"});
  for (const char* name : {"volume", "fraction", "mean", "mass", "least", "largest", "region"})
    BOOST_TEST(lo(all, name) <= hi(all, name), name);
  BOOST_TEST(all.at("at_least") == 0.5);
  BOOST_TEST(all.at("content_sha256").get<std::string>().size() == 64u);
  BOOST_TEST(lo(all, "least") <= lo(all, "mean"));
  BOOST_TEST(hi(all, "largest") >= hi(all, "mean"));
  // What lies above and what lies below make the region: the outer ends more, the inner ones less.
  const json below = measured({"--below", "0.5"});
  BOOST_TEST(hi(all, "volume") + hi(below, "volume") >= lo(all, "region"));
  BOOST_TEST(lo(all, "volume") + lo(below, "volume") <= hi(all, "region"));
  // A part of the region holds no more.
  const json ball = measured({"--above", "0.5", "--ball", "0,0,0,3"});
  BOOST_TEST(lo(ball, "volume") <= hi(all, "volume"));
  const double truth = 4.0 / 3 * std::acos(-1.0) * 27;
  BOOST_TEST((lo(ball, "region") <= truth && truth <= hi(ball, "region")));
  const json cylinder = measured({"--mean", "--cylinder", "0,0,-1,2,4"});
  const double upright = std::acos(-1.0) * 16 * 3;
  BOOST_TEST((lo(cylinder, "region") <= upright && upright <= hi(cylinder, "region")));
  const json box = measured({"--mean", "--roi", "-2,-1,-1,1,1,2"});
  BOOST_TEST((lo(box, "region") <= 18 && 18 <= hi(box, "region")));
}

BOOST_AUTO_TEST_CASE(people_get_one_line_each) {
  const Ended r = run({"measure", small_volume(), "--below", "0.5", "--mean", "--extremes"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  for (const char* word : {"volume", "fraction", "mean", "least", "largest", " to "})
    BOOST_TEST(r.out.find(word) != std::string::npos, word);
  // Of the mean one more: its sigma needs the projections.
  BOOST_TEST(r.out.find("needs --projections") != std::string::npos);
  BOOST_TEST(std::count(r.out.begin(), r.out.end(), '\n') == 6);
}

BOOST_AUTO_TEST_CASE(projections_tell_the_mean_itself_and_its_sigma) {
  for (const std::vector<std::string>& where : {std::vector<std::string>{"--ball", "1,-2,0,2.5"},
                                                {"--cylinder", "0,1,-2,2,6"},
                                                {"--roi", "-3,-3,-1,4,2,1"}}) {
    std::vector<std::string> words{"--mean", "--projections", small_scan(), "--sigma-p", "0.1"};
    words.insert(words.end(), where.begin(), where.end());
    const json j = measured(words);
    // F's own mean lies in V's interval, as for every field within the bound.
    const double mean = j.at("field_mean").get<double>();
    BOOST_TEST((lo(j, "mean") <= mean && mean <= hi(j, "mean")));
    // Sigma is in proportion to that of line integrals.
    words[4] = "0.2";
    const double once = j.at("sigma").get<double>(), twice = measured(words).at("sigma").get<double>();
    BOOST_TEST(once > 0);
    BOOST_TEST(std::abs(twice / once - 2) <= 4 * 0x1p-53);
  }
  const json alone = measured({"--mean"});
  BOOST_TEST(alone.at("sigma").is_null());
  BOOST_TEST(alone.at("field_mean").is_null());
}

BOOST_AUTO_TEST_CASE(pictures_are_of_what_was_asked_for) {
  const std::string png = at("measured.png");
  for (const std::vector<std::string>& words : {std::vector<std::string>{"--above", "0.5"},
                                                {"--between", "0.2,0.6", "--slice-axis", "x"},
                                                {"--above", "0.5", "--components", "--slice-position", "1"},
                                                {"--histogram", "9"}}) {
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--picture", png, "--size", "200x120", "--force"});
    BOOST_TEST(measured(all).at("picture") == png);
    BOOST_TEST(bytes_of(png).substr(1, 3) == "PNG");
  }
  const std::string before = bytes_of(png);
  check_refused({"measure", small_volume(), "--mean", "--picture", png, "--force"}, "--picture");
  check_refused({"measure", small_volume(), "--above", "1", "--picture", at("x.jpg")}, ".png");
  check_refused({"measure", small_volume(), "--above", "1", "--picture", png}, "--force");
  check_refused({"measure", small_volume(), "--above", "1", "--slice-axis", "x"}, "--picture");
  check_refused(
      {"measure", small_volume(), "--above", "1", "--picture", png, "--force", "--slice-position", "99"},
      "misses");
  BOOST_TEST(bytes_of(png) == before);
  check_no_temporary_file_is_left();
}

BOOST_AUTO_TEST_CASE(tables_are_written_whole) {
  const std::string csv = at("table.csv");
  const json histogram = measured({"--histogram", "7", "-o", csv, "--force"});
  BOOST_TEST(histogram.at("histogram").at("edges").size() == 8u);
  BOOST_TEST(lines_of(csv) == 8u);
  const json line =
      measured({"--along", "-5,0,0,5,0,0", "--above", "0.5", "--samples", "11", "-o", csv, "--force"});
  BOOST_TEST(line.at("along").at("profile").at("at").size() == 11u);
  BOOST_TEST(lines_of(csv) == 12u);
  BOOST_TEST(line.at("along").contains("crossings"));
  const json components =
      measured({"--components", "--above", "0.5", "--connect", "0,0,0,1,0,0", "-o", csv, "--force"});
  BOOST_TEST(lines_of(csv) == 1 + components.at("components").at("rows").size());
  BOOST_TEST(components.at("components").at("certain") == 1);
  BOOST_TEST(components.at("components").at("connected") == "yes");
  check_no_temporary_file_is_left();
}

BOOST_AUTO_TEST_CASE(what_cannot_be_measured_is_refused_by_name) {
  const auto refused = [](std::vector<std::string> words, const char* word) {
    words.insert(words.begin(), {"measure", small_volume()});
    check_refused(words, word);
  };
  refused({}, "nothing to measure");
  refused({"--above", "0.5", "--below", "1"}, "--above");
  refused({"--between", "1,0"}, "smaller");
  refused({"--components"}, "--components");
  refused({"--mean", "--samples", "9"}, "--samples");
  refused({"--mean", "--connect", "0,0,0,1,1,1"}, "--connect");
  refused({"--along", "0,0,0,1,1,1", "--between", "0,1"}, "--between");
  refused({"--mean", "-o", at("mean.csv")}, "--output");
  refused({"--mean", "--ball", "0,0,0,-1"}, "radius");
  refused({"--mean", "--roi", "900,0,0,901,1,1"}, "no volume");
  refused({"--mean", "--cylinder", "0,0,2,1,1"}, "--cylinder");
  refused({"--mean", "--mask", small_volume()}, "--mask");
  refused({"--above", "1", "--projections", small_scan()}, "--projections");
  refused({"--mean", "--photons", "100"}, "--photons");
  refused({"--histogram", "4", "--range", "1,0"}, "--range");
  check_refused({"measure", small_scan(), "--mean"}, "not a certified volume");
  const std::string windowed = at("windowed.vdvr");
  BOOST_REQUIRE(run({"build", small_scan(), "--epsilon", "20%", "--window", "0.2,2", "-o", windowed}).code ==
                0);
  check_refused({"measure", windowed, "--mean"}, "window");
}
