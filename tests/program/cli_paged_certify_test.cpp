// vdvr render --certify and verify --picture of a volume larger than --max-memory: the files of the whole
// volume, byte for byte, in every mode.
#define BOOST_TEST_MODULE cli_paged_certify
#include <boost/test/unit_test.hpp>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"

using namespace vdvr::support;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

namespace {

// Less than the 19 MiB that the volume takes, and enough for a part of it and what pictures need beside.
const char* const kLittle = "18M";

/// Noise to a small tolerance: nearly every brick is fine.
const std::string& large_volume() {
  static const std::string file = [] {
    const std::string scan = at("noise.h5"), volume = at("noise.vdvr");
    const Ended made = run({"simulate", "--phantom", "shepp-logan", "--angles", "20", "--detector", "32x32",
                            "--noise-sigma", "0.5", "--seed", "1", "-o", scan});
    BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
    const Ended built = run({"build", scan, "--epsilon", "1.6%", "--storage", "f32", "-o", volume});
    BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
    return volume;
  }();
  return file;
}

Words certified(const Words& more) {
  Words words{"render", large_volume(), "--certify", "--size", "72x56",
              "-o",     at("x.png"),    "--force",   "--json"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// Picture, bound and certificate, and what was printed.
struct Made {
  std::vector<std::string> files;
  Json printed;
};
Made made(const Words& more) {
  const Ended r = run(certified(more));
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  Made m;
  for (const char* ending : {"x.png", "x.bound.png", "x.certificate.json"})
    m.files.push_back(std::filesystem::exists(at(ending)) ? bytes_of(at(ending)) : "");
  m.printed = Json::parse(r.out);
  return m;
}

}  // namespace

BOOST_AUTO_TEST_CASE(certified_pictures_by_bricks_are_those_of_the_whole_volume_byte_for_byte) {
  const std::vector<Words> modes{{"--no-shading", "--explain", "36,28"},
                                 {"--clip", "-9,-20,-20,20,5,20"},
                                 {"--certify-light", "lit"},
                                 {"--mode", "iso"},
                                 {"--mode", "mip"},
                                 {"--mode", "integral"},
                                 {"--mode", "slice"}};
  for (Words mode : modes) {
    BOOST_TEST_CONTEXT(mode.front() << " " << (mode.size() > 1 ? mode[1] : "")) {
      const Made whole = made(mode);
      mode.insert(mode.end(), {"--max-memory", kLittle});
      const Made by_bricks = made(mode);
      BOOST_TEST(whole.printed.at("paging").is_null());
      BOOST_TEST(by_bricks.printed.at("paging").at("parts").get<int>() > 1);
      for (std::size_t i = 0; i < whole.files.size(); ++i)
        BOOST_TEST((whole.files[i] == by_bricks.files[i]), "file " << i << " differs");
      if (whole.printed.contains("explain"))
        BOOST_TEST(whole.printed.at("explain") == by_bricks.printed.at("explain"));
      // The files of the latter are there.
      const Ended v = run({"verify", large_volume(), "--picture", at("x.certificate.json"), "--max-memory",
                           kLittle, "--projections", at("noise.h5"), "--rays", "2"});
      BOOST_TEST(v.code == 0, v.err);
    }
  }
}

BOOST_AUTO_TEST_CASE(a_limit_that_is_too_small_is_refused_with_one_that_is_not) {
  const Ended r = run(certified({"--no-shading", "--max-memory", "6M"}));
  BOOST_TEST(r.code == 3);
  const std::string said = last_line(r.err);
  const auto end = said.find(" a device would do");
  BOOST_REQUIRE_MESSAGE(end != std::string::npos, r.err);
  BOOST_TEST(said.find("--max-memory") != std::string::npos);
  const auto first = said.rfind(' ', end - 1) + 1;
  const Ended again = run(certified({"--no-shading", "--max-memory", said.substr(first, end - first)}));
  BOOST_TEST(again.code == 0, again.err);
}

BOOST_AUTO_TEST_CASE(an_interrupted_picture_by_bricks_leaves_nothing) {
  check_interrupted({"render", large_volume(), "--certify", "--certify-parts", "0.002", "--size", "400x400",
                     "--max-memory", "16M", "-o", at("stopped.png")},
                    "certify", with_certificate("stopped"));
}
