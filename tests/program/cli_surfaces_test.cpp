// vdvr render --certify of surfaces and maxima, and build --picture-tolerance: what they write, what they
// refuse.
#define BOOST_TEST_MODULE cli_surfaces
#include <boost/test/unit_test.hpp>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"

using namespace vdvr::support;

namespace {

nlohmann::json json_of(const std::string& path) { return nlohmann::json::parse(bytes_of(path)); }

}  // namespace

BOOST_AUTO_TEST_CASE(a_surface_has_a_certificate_beside_its_picture) {
  const Ended r = run({"render", small_volume(), "--mode", "iso", "--iso", "0.5", "--certify", "-o",
                       at("iso.png"), "--size", "64x64", "--json"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const auto json = json_of(at("iso.certificate.json"));
  const auto& iso = json.at("iso");
  BOOST_TEST(std::abs(iso.at("sure").get<double>() + iso.at("possible").get<double>() +
                      iso.at("none").get<double>() - 1) < 1e-12);
  BOOST_TEST(iso.at("sure").get<double>() > 0);
  BOOST_TEST(iso.at("none").get<double>() > 0.2);
  BOOST_TEST(json.at("picture").at("sha256").get<std::string>().size() == 64u);
  BOOST_TEST(nlohmann::json::parse(r.out).at("certificate").at("iso") == iso);
  for (const char* show : {"class", "band"})
    for (const char* ending : {".png", ".npy"}) {
      const std::string out = at(std::string(show) + ending);
      const Ended one = run({"render", small_volume(), "--mode", "iso", "--iso", "0.5", "--certify", "--show",
                             show, "-o", out, "--size", "32x32", "--force"});
      BOOST_TEST(one.code == 0, one.err);
      BOOST_TEST(bytes_of(out).size() > 100u);
    }
}

BOOST_AUTO_TEST_CASE(a_maximum_has_its_bounds) {
  for (const char* show : {"lo", "hi"}) {
    const Ended r = run({"render", small_volume(), "--mode", "mip", "--certify", "--show", show, "-o",
                         at(std::string(show) + ".npy"), "--size", "32x32"});
    BOOST_TEST(r.code == 0, r.err);
    BOOST_TEST(
        json_of(at(std::string(show) + ".certificate.json")).at("mip").at("half_width_mean").get<double>() >
        0);
  }
}

BOOST_AUTO_TEST_CASE(what_has_no_certificate_by_ray_is_refused) {
  const std::string out = at("refused.png");
  check_refused({"render", small_volume(), "--mode", "slice", "--certify", "-o", out}, "--certify");
  check_refused({"render", small_volume(), "--mode", "iso", "--show", "band", "-o", out}, "--certify");
  check_refused({"render", small_volume(), "--mode", "mip", "--certify", "--show", "class", "-o", out},
                "--show class");
  check_refused({"render", small_volume(), "--mode", "iso", "--certify", "--iso", "0.3,0.5", "-o", out},
                "one surface");
}

BOOST_AUTO_TEST_CASE(a_build_is_refined_until_its_pictures_are_certain) {
  const std::string views = at("views.json"), out = at("pictures.vdvr");
  write(views, R"({"size": [12, 12], "tf": "default", "tf_range": [0, 1], "views": [{"azimuth": 10}]})");
  const Ended r = run({"build", small_scan(), "--picture-tolerance", "40", "--views", views,
                       "--picture-finest", "2%", "-o", out, "--json"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const auto json = nlohmann::json::parse(r.out);
  const auto& pictures = json.at("pictures");
  BOOST_TEST(pictures.at("met") == true);
  BOOST_TEST(pictures.at("worst").get<double>() <= 40);
  BOOST_TEST(std::abs(json.at("certificate").at("epsilon").get<double>() - 0.25) < 1e-12);
  const Ended verified = run({"verify", out, "--projections", small_scan()});
  BOOST_TEST(verified.code == 0, verified.err);
}

BOOST_AUTO_TEST_CASE(views_that_make_no_sense_are_refused_by_name) {
  const std::string views = at("bad.json"), out = at("bad.vdvr");
  const std::vector<std::pair<std::string, std::string>> bad{
      {"[]", "views"},
      {R"({"views": []})", "views"},
      {R"({"size": [0, 4], "views": [{}]})", "size"},
      {R"({"view": [{}]})", "view"},
      {R"({"views": [{"zoom": 0}]})", "zoom"},
      {R"({"views": [{"position": [0, 0, 0]}]})", "views"}};
  for (const auto& [text, named] : bad) {
    write(views, text);
    check_refused({"build", small_scan(), "--picture-tolerance", "8", "--views", views, "-o", out}, named);
  }
  check_refused({"build", small_scan(), "--picture-tolerance", "8", "-o", out}, "--views");
  check_refused({"build", small_scan(), "--epsilon", "3%", "--views", views, "-o", out},
                "--picture-tolerance");
}
