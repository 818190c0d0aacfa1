// vdvr render --certify-light: pictures under the light of F itself, what verify --picture finds in them,
// what is refused.
#define BOOST_TEST_MODULE cli_certify_light
#include <boost/test/unit_test.hpp>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"

using namespace vdvr::support;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

namespace {

Json json_of(const std::string& path) { return Json::parse(bytes_of(path)); }

Ended lit_picture(const std::string& volume, const std::string& out, const Words& more = {}) {
  Words words{"render", volume, "--certify", "--certify-light", "lit",   "--size",
              "40x40",  "-o",   at(out),     "--force",         "--json"};
  words.insert(words.end(), more.begin(), more.end());
  return run(words);
}

/// A lit picture of the small volume, made once; the path of its certificate.
const std::string& certificate() {
  static const std::string path = [] {
    const Ended r = lit_picture(small_volume(), "lit.png", {"--caption"});
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    return at("lit.certificate.json");
  }();
  return path;
}

void check_held(const std::string& volume, const std::string& picture, const std::string& scan) {
  const Ended r =
      run({"verify", volume, "--picture", picture, "--projections", scan, "--rays", "8", "--json"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const Json json = Json::parse(r.out);
  BOOST_TEST(json.at("same_pixels") == true);
  BOOST_TEST(json.at("rays").at("count") == 8);
  BOOST_TEST(json.at("rays").at("outside") == 0);
}

template <class Change>
void check_found(const std::string& name, const std::string& named, Change&& change) {
  Json json = json_of(certificate());
  change(json);
  write(at(name), json.dump());
  const Ended r = run({"verify", small_volume(), "--picture", at(name)});
  BOOST_TEST_CONTEXT(name << " said: " << r.err) {
    BOOST_TEST(r.code == 1);
    BOOST_TEST(last_line(r.err).find(named) != std::string::npos);
  }
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_certificate_says_that_light_is_that_of_f_and_holds_less_than_light_as_drawn) {
  const Json lit = json_of(certificate());
  BOOST_TEST(lit.at("light") == "lit");
  BOOST_TEST(lit.at("statement").get<std::string>().find("light of F's own differences") !=
             std::string::npos);
  BOOST_TEST(lit.at("pixels").at("untested") == 0);
  // Box steps alone, by either name.
  BOOST_TEST(lit.at("step") == "box");
  const Ended box = run({"render", small_volume(), "--certify=box", "--certify-light", "lit", "--size",
                         "40x40", "-o", at("box.png"), "--json"});
  BOOST_REQUIRE_MESSAGE(box.code == 0, box.err);
  BOOST_TEST(Json::parse(box.out).at("step") == "box");
  BOOST_TEST(Json::parse(box.out).at("levels") == lit.at("levels"));
  // With the buffer, whose light F's rays can be held to.
  const Ended r = run({"render", small_volume(), "--certify", "--certify-light=as-drawn", "--size", "40x40",
                       "--sampler", "buffer", "-o", at("drawn.png"), "--json"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const Json drawn = Json::parse(r.out);
  BOOST_TEST(drawn.at("light") == "as drawn");
  check_held(small_volume(), at("drawn.certificate.json"), small_scan());
  BOOST_TEST(lit.at("levels").at("mean").get<double>() > drawn.at("levels").at("mean").get<double>());
  // Differences over one cell are known half a cell within what is covered.
  const Json &inner = lit.at("picture").at("clip"), &outer = drawn.at("picture").at("clip");
  const double less = outer.at("radius").get<double>() - inner.at("radius").get<double>();
  BOOST_TEST(less >= 0.5);
  BOOST_TEST(less < 0.501);
  BOOST_TEST(inner.at("high").at(2).get<double>() <= outer.at("high").at(2).get<double>() - 0.5);
}

BOOST_AUTO_TEST_CASE(f_is_found_in_its_intervals) {
  check_held(small_volume(), certificate(), small_scan());
  const Ended r =
      lit_picture(small_volume(), "three.png",
                  {"--light", "head", "--light", "1,2,-1", "--light", "-1,0,0", "--certify-parts", "0.25"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  check_held(small_volume(), at("three.certificate.json"), small_scan());
}

BOOST_AUTO_TEST_CASE(what_was_changed_is_found) {
  check_found("light.json", "what is proved", [](Json& j) { j["light"] = "as drawn"; });
  check_found("tight.json", "the bound is", [](Json& j) { j["levels"]["max"] = 0.5; });
  check_found("lamp.json", "another", [](Json& j) {
    j["picture"]["lights"] = Json::array({Json::array({1, 0, 0})});
    j["picture"]["head_light"] = false;
  });
  // A picture that is as drawn cannot be passed off as one under the light of F.
  const Ended made = run({"render", small_volume(), "--certify", "--size", "40x40", "--sampler", "buffer",
                          "-o", at("plain.png"), "--force"});
  BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
  Json json = json_of(at("plain.certificate.json"));
  json["light"] = "lit";
  json["statement"] = json_of(certificate()).at("statement");
  write(at("passed-off.json"), json.dump());
  const Ended r = run({"verify", small_volume(), "--picture", at("passed-off.json")});
  BOOST_TEST(r.code == 1);
  BOOST_TEST(last_line(r.err).find("the bound is") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(regions_of_interest_and_cone_beam_have_it_too) {
  const std::string volume = at("roi.vdvr");
  const Ended built = run({"build", small_scan(), "--epsilon", "20%", "--roi=-6,-6,-3,6,6,3", "-o", volume});
  BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
  const Ended r = lit_picture(volume, "roi.png");
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const Json json = json_of(at("roi.certificate.json"));
  BOOST_TEST(json.at("picture").at("clip").at("low").at(0).get<double>() > -5.501);
  BOOST_TEST(json.at("pixels").at("untested") == 0);
  check_held(volume, at("roi.certificate.json"), small_scan());

  const std::string scan = at("cone"), cone = at("cone.vdvr");
  const Ended made = run({"simulate", "--phantom", "sphere", "--detector", "24x24", "--angles", "40",
                          "--cone", "80,80", "-o", scan});
  BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
  const Ended certified = run({"build", scan, "--epsilon", "20%", "-o", cone});
  BOOST_REQUIRE_MESSAGE(certified.code == 0, certified.err);
  const Ended drawn = lit_picture(cone, "cone.png");
  BOOST_REQUIRE_MESSAGE(drawn.code == 0, drawn.err);
  check_held(cone, at("cone.certificate.json"), scan);
}

BOOST_AUTO_TEST_CASE(options_that_do_not_fit_are_refused_before_anything_is_written) {
  const std::string out = at("never.png");
  const auto refused = [&](const Words& more, const std::string& named) {
    Words words{"render", small_volume(), "--size", "32x32", "-o", out};
    words.insert(words.end(), more.begin(), more.end());
    check_refused(words, named);
    BOOST_TEST(!std::filesystem::exists(out));
    BOOST_TEST(!std::filesystem::exists(at("never.certificate.json")));
  };
  refused({"--certify-light", "lit"}, "--certify");
  refused({"--certify", "--certify-light", "bright"}, "--certify-light");
  refused({"--certify=fast", "--certify-light", "lit"}, "--certify fast");
  refused({"--certify", "--certify-light", "lit", "--no-shading"}, "--no-shading");
  refused({"--certify", "--certify-light", "lit", "--gradient", "analytic"}, "--gradient central");
  refused({"--certify", "--certify-light", "lit", "--gradient", "stored"}, "--gradient");
  refused({"--certify", "--certify-light", "lit", "--explain", "1,1"}, "--explain");
  refused({"--certify", "--certify-light", "lit", "--mode", "mip"}, "--certify-light");
  refused({"--certify", "--certify-light", "lit", "--mode", "slice"}, "--certify-light");
  refused({"--certify", "--certify-light", "lit", "--mode", "iso", "--iso", "0.5"}, "--certify-light");
  refused({"--certify", "--certify-light", "lit", "--mode", "integral"}, "--certify-light");
  refused({"--certify", "--certify-light", "lit", "--certify-parts", "1e9"}, "certify_parts");
  refused({"--certify", "--certify-light", "lit", "--clip", "900,900,-900,901,901,900"}, "--clip");
  // Too thin for any difference.
  const std::string sheet = at("sheet.vdvr");
  const Ended flat =
      run({"build", small_scan(), "--epsilon", "20%", "--roi=-6,-6,-0.4,6,6,0.4", "-o", sheet});
  BOOST_REQUIRE_MESSAGE(flat.code == 0, flat.err);
  check_refused({"render", sheet, "--certify", "--certify-light", "lit", "-o", out},
                "along z no more than one cell");
  const std::string volume = at("window.vdvr");
  const Ended built = run({"build", small_scan(), "--epsilon", "20%", "--window", "0.2,0.8", "-o", volume});
  BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
  check_refused({"render", volume, "--certify", "--certify-light", "lit", "-o", out}, "--window 0.2,0.8");
  BOOST_TEST(!std::filesystem::exists(out));
}

BOOST_AUTO_TEST_CASE(a_picture_beyond_the_tolerance_ends_with_1) {
  const Ended no = lit_picture(small_volume(), "beyond.png", {"--picture-tolerance", "1"});
  BOOST_TEST(no.code == 1);
  BOOST_TEST(last_line(no.err).find("are not certain to") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(an_interrupted_picture_leaves_nothing) {
  check_interrupted({"render", small_volume(), "--certify", "--certify-light", "lit", "--certify-parts",
                     "0.002", "--size", "1600x1600", "-o", at("stopped.png")},
                    "certify", with_certificate("stopped"));
}
