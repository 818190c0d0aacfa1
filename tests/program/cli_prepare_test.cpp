// Preparation through the commands: recorded with the certificate, done again by verify, refused with a
// reason.
#define BOOST_TEST_MODULE cli_prepare
#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"

using namespace vdvr::support;

namespace {

const std::vector<std::string> steps{"--outliers", "0.3",        "--stripes", "3,21,5",    "--median",
                                     "3",          "--gaussian", "0.5,0.5",   "--binning", "2"};

std::vector<std::string> with(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// A centre off the middle, so that one that is not binned with its columns shows.
std::string noisy_scan() {
  static const std::string path = [] {
    const std::string scan = at("noisy.h5");
    BOOST_REQUIRE(run({"simulate", "--phantom", "shepp-logan", "--detector", "48x20", "--angles", "60",
                       "--noise-sigma", "0.02", "--pitch", "3", "-o", scan})
                      .code == 0);
    return scan;
  }();
  return path;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_certificate_names_the_preparation_and_verify_does_it_again) {
  const std::string file = at("prepared.vdvr");
  const Ended built =
      run(with({"build", noisy_scan(), "--epsilon", "10%", "--center", "23.3", "-o", file}, steps));
  BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
  BOOST_TEST(
      built.out.find("prepared     outliers 0.3,3; stripes 3,21,5; median 3; gaussian 0.5,0.5; binning 2") !=
      std::string::npos);
  const auto info = nlohmann::json::parse(run({"info", file, "--json"}).out, nullptr, false);
  const auto field = info.at("certificate").at("field");
  BOOST_TEST(field.at("center").get<double>() == (23.3 - 0.5) / 2);
  BOOST_TEST(field.at("preparation").at("binning") == 2);
  BOOST_TEST(field.at("preparation").at("stripes").at("small") == 5);
  const Ended verified = run({"verify", file, "--projections", noisy_scan(), "--exhaustive"});
  BOOST_TEST(verified.code == 0, verified.err);
  // The same words again say nothing new; others contradict the file.
  BOOST_TEST(run(with({"verify", file, "--projections", noisy_scan(), "--center", "23.3"}, steps)).code == 0);
  check_refused({"verify", file, "--projections", noisy_scan(), "--stripes", "on"},
                "verify takes them from it");
  check_refused({"verify", file, "--projections", noisy_scan(), "--binning", "3"},
                "verify takes them from it");
}

BOOST_AUTO_TEST_CASE(the_exact_field_like_a_prepared_volume_is_the_volume_s) {
  const std::string file = at("like.vdvr"), points = at("points.csv"), exact = at("exact.csv"),
                    plain = at("plain.csv");
  BOOST_REQUIRE(run({"build", noisy_scan(), "--epsilon", "10%", "--binning", "2", "-o", file}).code == 0);
  std::ofstream(points) << "x,y,z\n3.1,-7.4,2.2\n-20.5,11,-6\n";
  BOOST_REQUIRE(
      run({"probe", noisy_scan(), "--exact", "--like", file, "--points", points, "-o", exact}).code == 0);
  BOOST_REQUIRE(run({"probe", file, "--points", points, "-o", plain}).code == 0);
  const auto rows = [](const std::string& path) {
    std::vector<std::vector<double>> all;
    std::ifstream in(path);
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
      all.emplace_back();
      for (std::size_t from = 0; from < line.size();) {
        const std::size_t to = std::min(line.find(',', from), line.size());
        const std::string word = line.substr(from, to - from);
        all.back().push_back(word.empty() || word.find_first_not_of("0123456789.e+-") != std::string::npos
                                 ? 0
                                 : std::stod(word));
        from = to + 1;
      }
    }
    return all;
  };
  const auto field = rows(exact), volume = rows(plain);
  BOOST_REQUIRE(field.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const double bound = volume[i][4];
    BOOST_TEST(bound > 0);
    BOOST_TEST(std::abs(field[i][3] - volume[i][3]) <= bound);
  }
}

BOOST_AUTO_TEST_CASE(steps_out_of_their_range_are_refused_with_their_name) {
  const auto refused = [](const std::vector<std::string>& more, const std::string& text) {
    check_refused(with({"reconstruct", noisy_scan(), "-o", at("refused.mha")}, more), text);
  };
  refused({"--median", "4"}, "must be odd");
  refused({"--outliers", "-1"}, "outliers: the threshold");
  refused({"--outliers", "0.1,2"}, "must be odd");
  refused({"--stripes", "3,50,21"}, "must be odd");
  refused({"--stripes", "off"}, "--stripes");
  refused({"--gaussian", "1"}, "expected 2");
  refused({"--gaussian", "1,nan"}, "gaussian");
  refused({"--binning", "40"}, "leaves");
  refused({"--phase", "10,20"}, "expected 3");
  refused({"--phase", "10,20,100"}, "whose length is not known");
}
