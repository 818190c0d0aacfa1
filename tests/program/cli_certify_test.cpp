// vdvr render --certify of mode dvr, and verify --picture: what they write, what they find, what they refuse.
#define BOOST_TEST_MODULE cli_certify
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

Words certified(const std::string& out, const Words& more = {}) {
  Words words{"render", small_volume(), "--certify", "--no-shading", "--size",
              "48x48",  "-o",           at(out),     "--force"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// A certified picture of the small volume, made once; the path of its certificate.
const std::string& certificate() {
  static const std::string path = [] {
    const Ended r = run(certified("whole.png"));
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    return at("whole.certificate.json");
  }();
  return path;
}

/// A copy of the certificate with one member changed, beside the same picture.
template <class Change>
std::string changed(const std::string& name, Change&& change) {
  Json json = json_of(certificate());
  change(json);
  write(at(name), json.dump());
  return at(name);
}

void check_found(const std::string& certificate_path, const std::string& named) {
  const Ended r = run({"verify", small_volume(), "--picture", certificate_path});
  BOOST_TEST_CONTEXT(certificate_path << " said: " << r.err) {
    BOOST_TEST(r.code == 1);
    BOOST_TEST(last_line(r.err).find(named) != std::string::npos);
  }
}

/// A shape's size as numpy writes it.
bool has_shape(const std::string& path, const std::string& shape) {
  return bytes_of(path).substr(0, 128).find(shape) != std::string::npos;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_certified_picture_has_its_bound_and_its_certificate_beside_it) {
  const Json json = json_of(certificate());
  BOOST_TEST(bytes_of(at("whole.bound.png")).substr(1, 3) == "PNG");
  BOOST_TEST(json.at("light") == "unlit");
  BOOST_TEST(json.at("statement").get<std::string>().find("over F inside the covered region") !=
             std::string::npos);
  const Json& levels = json.at("levels");
  BOOST_TEST(levels.at("mean").get<double>() > 0);
  BOOST_TEST(levels.at("mean").get<double>() <= levels.at("p99").get<double>());
  BOOST_TEST(levels.at("p99").get<double>() <= levels.at("max").get<double>());
  double before = 0;
  for (const char* n : {"1", "2", "4", "8", "16"}) {
    const double share = json.at("within").at(n).get<double>();
    BOOST_TEST(share >= before);
    before = share;
  }
  BOOST_TEST(before <= 1);
  BOOST_TEST(json.at("pixels").at("certified") == 48 * 48);
  BOOST_TEST(json.at("ray_offset_pixels").get<double>() < 0.01);
  const Ended lit =
      run({"render", small_volume(), "--certify", "--size", "32x32", "-o", at("lit.png"), "--json"});
  BOOST_REQUIRE_MESSAGE(lit.code == 0, lit.err);
  BOOST_TEST(Json::parse(lit.out).at("light") == "as drawn");
}

BOOST_AUTO_TEST_CASE(values_of_bounds_are_written_on_demand) {
  for (const char* show : {"bound", "lo", "hi", "middle"}) {
    for (const char* ending : {".png", ".npy"}) {
      const std::string name = std::string("shown-") + show + ending;
      const Ended r = run(certified(name, {"--show", show}));
      BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    }
    BOOST_TEST(has_shape(at(std::string("shown-") + show + ".npy"),
                         std::string(show) == "bound" ? "(48, 48)" : "(48, 48, 3)"));
  }
}

BOOST_AUTO_TEST_CASE(the_fast_form_holds_more_than_the_exact_one) {
  const Ended r = run({"render", small_volume(), "--certify=fast", "--no-shading", "--size", "48x48", "-o",
                       at("fast.png"), "--json"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const Json fast = Json::parse(r.out), exact = json_of(certificate());
  BOOST_TEST(fast.at("fast") == true);
  BOOST_TEST(fast.at("levels").at("mean").get<double>() > exact.at("levels").at("mean").get<double>());
}

BOOST_AUTO_TEST_CASE(box_steps_hold_more_and_are_repeated_when_they_are_verified) {
  const Ended r = run({"render", small_volume(), "--certify=box", "--no-shading", "--size", "48x48", "-o",
                       at("box.png"), "--json"});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const Json box = Json::parse(r.out), exact = json_of(certificate());
  BOOST_TEST(box.at("step") == "box");
  BOOST_TEST(exact.at("step") == "joint");
  BOOST_TEST(exact.at("levels").at("mean").get<double>() < 0.99 * box.at("levels").at("mean").get<double>());
  const std::string file = at("box.certificate.json");
  const Ended good = run({"verify", small_volume(), "--picture", file});
  BOOST_TEST(good.code == 0, good.err);
  Json as_box = exact;
  as_box["step"] = "box";
  write(at("as-box.json"), as_box.dump());
  const Ended bad = run({"verify", small_volume(), "--picture", at("as-box.json")});
  BOOST_TEST(bad.code == 1);
  BOOST_TEST((bad.out + bad.err).find("the bound is") != std::string::npos);
  check_refused({"render", small_volume(), "--mode", "mip", "--certify=box", "-o", at("never.png")},
                "--certify");
}

BOOST_AUTO_TEST_CASE(where_the_drawing_would_be_much_of_the_bound_steps_are_shorter) {
  const std::string volume = at("tight.vdvr"), tf = at("steep-tf.json");
  write(tf, R"({"points": [{"value": 0.4, "rgb": [1, 0.5, 0], "opacity": 0},
                           {"value": 0.6, "rgb": [0, 0.5, 1], "opacity": 0.95}]})");
  const Ended built = run({"build", small_scan(), "--epsilon", "0.4%", "-o", volume});
  BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
  for (const Words& light : {Words{"--no-shading"}, Words{}}) {
    const auto drawn = [&](const Words& more) {
      Words words{"render", volume, "--certify",     "--size",  "48x48", "--tf",
                  tf,       "-o",   at("tight.png"), "--force", "--json"};
      words.insert(words.end(), light.begin(), light.end());
      words.insert(words.end(), more.begin(), more.end());
      const Ended r = run(words);
      BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
      return Json::parse(r.out);
    };
    const Json coarse = drawn({"--step", "1", "--classification", "preintegrated", "--step-mode", "fixed"}),
               fine = drawn({});
    BOOST_TEST(coarse.at("picture").at("step") == 1.0);
    BOOST_TEST(fine.at("picture").at("step").get<double>() < 1);
    BOOST_TEST(fine.at("levels").at("mean").get<double>() <
               0.9 * coarse.at("levels").at("mean").get<double>());
    const Ended v = run({"verify", volume, "--picture", at("tight.certificate.json")});
    BOOST_TEST(v.code == 0, v.err);
  }
  // Wide bounds leave the step as it is.
  BOOST_TEST(json_of(certificate()).at("picture").at("step") == 1.0);
}

BOOST_AUTO_TEST_CASE(a_picture_beyond_the_tolerance_ends_with_1_and_is_written) {
  const double worst = json_of(certificate()).at("levels").at("max").get<double>();
  const Ended no = run(certified("beyond.png", {"--picture-tolerance", std::to_string(worst / 2)}));
  BOOST_TEST(no.code == 1);
  BOOST_TEST(last_line(no.err).find("are not certain to") != std::string::npos);
  BOOST_TEST(bytes_of(at("beyond.certificate.json")).size() > 100u);
  const Ended yes = run(certified("within.png", {"--picture-tolerance", "255"}));
  BOOST_TEST(yes.code == 0, yes.err);
}

BOOST_AUTO_TEST_CASE(a_pixel_is_explained_by_its_bricks) {
  const Json worst = json_of(certificate()).at("worst_pixel");
  const std::string pixel =
      std::to_string(worst.at(0).get<int>()) + "," + std::to_string(worst.at(1).get<int>());
  const Ended r = run(certified("why.png", {"--explain", pixel, "--json"}));
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const Json why = Json::parse(r.out).at("explain");
  BOOST_TEST(why.at("pixel") == worst);
  BOOST_REQUIRE(!why.at("bricks").empty());
  double before = std::numeric_limits<double>::infinity();
  for (const Json& brick : why.at("bricks")) {
    BOOST_TEST(brick.at("levels").get<double>() <= before);
    BOOST_TEST(brick.at("bound").get<double>() > 0);
    before = brick.at("levels").get<double>();
  }
}

BOOST_AUTO_TEST_CASE(a_picture_is_verified_with_and_without_projections) {
  for (const Words& more : {Words{}, Words{"--projections", small_scan(), "--rays", "6"}}) {
    Words words{"verify", small_volume(), "--picture", certificate(), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const Ended r = run(words);
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    const Json json = Json::parse(r.out);
    BOOST_TEST(json.at("holds") == true);
    BOOST_TEST(json.at("same_pixels") == true);
    if (more.empty()) continue;
    BOOST_TEST(json.at("rays").at("count") == 6);
    BOOST_TEST(json.at("rays").at("outside") == 0);
  }
}

BOOST_AUTO_TEST_CASE(what_was_changed_is_found) {
  check_found(changed("tight.json", [](Json& j) { j["levels"]["max"] = 0.01; }), "the bound is");
  check_found(changed("share.json", [](Json& j) { j["within"]["1"] = 1.0; }), "are certain to 1");
  check_found(changed("light.json", [](Json& j) { j["light"] = "lit"; }), "light");
  check_found(changed("words.json", [](Json& j) { j["statement"] = "It is perfect."; }), "what is proved");
  check_found(changed("camera.json", [](Json& j) { j["picture"]["camera"]["position"][0] = 90.0; }),
              "another");
  check_found(changed("clip.json",
                      [](Json& j) {
                        j["picture"]["clip"]["radius"] = 1e6;
                        j["covered"]["radius"] = 1e6;
                      }),
              "more than the volume says is covered");
  check_found(changed("noclip.json", [](Json& j) { j["picture"]["clip"]["radius"] = nullptr; }), "covered");
  check_found(changed("roi.json", [](Json& j) { j["volume"]["content_sha256"] = "00"; }), "is of the volume");
  const std::string picture = bytes_of(at("whole.png"));
  write(at("whole.png"), picture + "x");
  check_found(certificate(), "is not the picture that was certified");
  write(at("whole.png"), picture);
}

BOOST_AUTO_TEST_CASE(a_certificate_that_makes_no_sense_is_refused_by_name) {
  const std::string base = bytes_of(certificate());
  const auto refused = [&](const std::string& path) {
    check_refused({"verify", small_volume(), "--picture", path}, path);
  };
  refused(small_volume());
  write(at("cut.json"), base.substr(0, base.size() / 2));
  refused(at("cut.json"));
  refused(changed("width.json", [](Json& j) { j["picture"]["width"] = 1'000'000'000; }));
  refused(changed("kappa.json", [](Json& j) { j["kappa"] = -1; }));
  refused(changed("step.json", [](Json& j) { j["step"] = "sideways"; }));
  refused(changed("type.json", [](Json& j) { j["theta"] = "small"; }));
  refused(changed("points.json", [](Json& j) { j["picture"]["transfer"]["points"] = Json::array(); }));
  refused(changed("format.json", [](Json& j) { j["format"] = "vdvr picture certificate 99"; }));
  check_refused({"verify", small_volume(), "--picture",
                 changed("gone.json", [](Json& j) { j["picture"]["file"] = "no-such.png"; })},
                "no-such.png");
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
  refused({"--certify=quick"}, "--certify");
  refused({"--certify-parts", "1"}, "--certify");
  refused({"--certify", "--certify-parts", "0"}, "--certify-parts");
  refused({"--certify", "--certify-parts", "1e9"}, "certify_parts");
  refused({"--explain", "1,1"}, "--certify");
  refused({"--certify", "--explain", "32,0"}, "--explain");
  refused({"--certify", "--explain", "1.5,0"}, "--explain");
  refused({"--picture-tolerance", "-1"}, "--picture-tolerance");
  refused({"--picture-tolerance", "256"}, "--picture-tolerance");
  refused({"--certify", "--turntable", "3"}, "--turntable");
  refused({"--certify", "--method", "dvr"}, "--method");
  refused({"--certify", "--gradient", "stored"}, "stored");
  refused({"--certify", "--show", "depth"}, "depth");
  refused({"--certify", "--show", "lo", "--caption"}, "--caption");
  refused({"--show", "bound"}, "--certify");
  refused({"--certify", "--unverified"}, "--unverified");
  refused({"--certify", "--clip", "900,900,-900,901,901,900"}, "--clip");
  refused({"--covered-from", small_scan()}, "--covered-from");
  refused({"--certify", "--covered-from", at("no-scan.h5")}, "no-scan.h5");
  check_refused({"render", small_volume(), "--certify", "-o", at("never.npy")}, "--show");
  check_refused({"render", small_scan() + ":/exchange/data", "--certify", "-o", out}, "certif");
  check_refused({"verify", small_volume(), "--rays", "4", "--projections", small_scan()}, "--rays");
}

BOOST_AUTO_TEST_CASE(nothing_is_overwritten_without_force) {
  write(at("kept.bound.png"), "mine");
  check_refused({"render", small_volume(), "--certify", "--size", "32x32", "-o", at("kept.png")},
                "kept.bound.png");
  BOOST_TEST(bytes_of(at("kept.bound.png")) == "mine");
  BOOST_TEST(!std::filesystem::exists(at("kept.png")));
}

BOOST_AUTO_TEST_CASE(the_scan_says_as_well_as_the_file_where_it_is_covered) {
  const Ended r = run(certified("from-scan.png", {"--covered-from", small_scan()}));
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const std::string whole = certificate();
  BOOST_TEST(bytes_of(at("from-scan.png")) == bytes_of(at("whole.png")));
  BOOST_TEST(json_of(at("from-scan.certificate.json")).at("covered") == json_of(whole).at("covered"));
  const Ended clipped = run({"render", small_volume(), "--clip-covered", "--no-shading", "--size", "48x48",
                             "--classification", "preintegrated", "-o", at("clipped.png")});
  BOOST_TEST(clipped.code == 0, clipped.err);
}

BOOST_AUTO_TEST_CASE(a_region_of_interest_is_drawn_alone) {
  const std::string volume = at("roi.vdvr");
  const Ended built = run({"build", small_scan(), "--epsilon", "20%", "--roi=-6,-6,-3,6,6,3", "-o", volume});
  BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
  const Ended r =
      run({"render", volume, "--certify", "--no-shading", "--size", "32x32", "-o", at("roi.png")});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const Json json = json_of(at("roi.certificate.json"));
  BOOST_TEST(json.at("picture").at("clip").at("low").at(0) == -6.0);
  BOOST_TEST(json.at("pixels").at("untested") == 0);
  const Ended v = run({"verify", volume, "--picture", at("roi.certificate.json"), "--projections",
                       small_scan(), "--rays", "4"});
  BOOST_TEST(v.code == 0, v.err);
}

BOOST_AUTO_TEST_CASE(a_windowed_volume_is_certified_where_nothing_shows_outside_the_window) {
  const std::string volume = at("window.vdvr"), tf = at("window-tf.json");
  const Ended built = run({"build", small_scan(), "--epsilon", "20%", "--window", "0.2,0.8", "-o", volume});
  BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
  const Words words{"render", volume,           "--certify", "--no-shading", "--size", "32x32",
                    "-o",     at("window.png"), "--force",   "--tf",         tf};
  write(tf, R"({"points": [{"value": 0.3, "rgb": [1, 1, 1], "opacity": 0},
                           {"value": 0.9, "rgb": [1, 1, 1], "opacity": 0.5}]})");
  check_refused(words, "--window 0.2,0.8");
  write(tf, R"({"points": [{"value": 0.3, "rgb": [1, 1, 1], "opacity": 0},
                           {"value": 0.5, "rgb": [1, 1, 1], "opacity": 0.5},
                           {"value": 0.8, "rgb": [1, 1, 1], "opacity": 0}]})");
  const Ended r = run(words);
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const Json json = json_of(at("window.certificate.json"));
  BOOST_TEST(json.at("window") == Json::array({0.2, 0.8}));
  BOOST_TEST(json.at("pixels").at("untested") == 0);
  const Ended v = run({"verify", volume, "--picture", at("window.certificate.json"), "--projections",
                       small_scan(), "--rays", "8"});
  BOOST_TEST(v.code == 0, v.err);
}

BOOST_AUTO_TEST_CASE(a_cone_beam_volume_is_certified_where_it_is_covered) {
  const std::string scan = at("cone"), volume = at("cone.vdvr");
  const Ended made = run({"simulate", "--phantom", "sphere", "--detector", "24x24", "--angles", "40",
                          "--cone", "80,80", "-o", scan});
  BOOST_REQUIRE_MESSAGE(made.code == 0, made.err);
  const Ended built = run({"build", scan, "--epsilon", "20%", "-o", volume});
  BOOST_REQUIRE_MESSAGE(built.code == 0, built.err);
  const Ended r =
      run({"render", volume, "--certify", "--no-shading", "--size", "32x32", "-o", at("cone.png")});
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const Ended v =
      run({"verify", volume, "--picture", at("cone.certificate.json"), "--projections", scan, "--rays", "4"});
  BOOST_TEST(v.code == 0, v.err);
}

BOOST_AUTO_TEST_CASE(an_interrupted_picture_leaves_nothing) {
  check_interrupted({"render", small_volume(), "--certify", "--certify-parts", "0.002", "--size", "1600x1600",
                     "-o", at("stopped.png")},
                    "certify", with_certificate("stopped"));
}
