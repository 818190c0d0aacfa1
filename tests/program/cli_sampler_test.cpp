// A file built on one device and drawn on another, whose texture unit does worse than the certificate says:
// held to F itself, it is refused, drawn with the buffer, or charged what that unit may err by. A preloaded
// layer stands for such units (opencl_shim.cpp).
#define BOOST_TEST_MODULE cli_sampler
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "tests/support/charged.hpp"
#include "tests/support/command_line.hpp"
#include "vdvr/expert/certify_picture.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr;
using namespace vdvr::support;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

namespace {

using Unit = std::map<std::string, std::string>;
const Unit kPlain{};
/// Weights of so many bits, rounded.
Unit unit_of(int bits) {
  return {{"LD_PRELOAD", VDVR_OPENCL_SHIM}, {"VDVR_SHIM_FILTER_BITS", std::to_string(bits)}};
}
/// The weights of corners are rounded, too.
Unit nvidia_like() {
  Unit unit = unit_of(8);
  unit["VDVR_SHIM_FILTER_PRODUCTS"] = "1";
  return unit;
}
/// Weights of fp32, but what it reads of 8-bit images is rounded to 8 bits again.
const Unit kBadlyU8{
    {"LD_PRELOAD", VDVR_OPENCL_SHIM}, {"VDVR_SHIM_FILTER_BITS", "22"}, {"VDVR_SHIM_FILTER_U8", "1"}};

Ended run_on(const Unit& unit, const Words& words) {
  Program program(folder().path());
  program.environment = unit;
  return program.run(words);
}
Json json_on(const Unit& unit, Words words) {
  words.emplace_back("--json");
  const Ended r = run_on(unit, words);
  BOOST_REQUIRE_MESSAGE(r.code == 0, "vdvr " << words[0] << ": " << r.err);
  return Json::parse(r.out);
}

const std::string& scan_file() {
  static const std::string path = [] {
    const Ended r = run({"simulate", "--phantom", "shepp-logan", "--detector", "25x9", "--angles", "36", "-o",
                         at("scan.h5")});
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    return at("scan.h5");
  }();
  return path;
}

std::string built(const Unit& unit, const std::string& name, const std::string& epsilon, const Words& more) {
  Words words{"build", scan_file(), "--epsilon", epsilon, "-o", at(name), "--force"};
  words.insert(words.end(), more.begin(), more.end());
  const Ended r = run_on(unit, words);
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  return at(name);
}

/// Tight, in 8 bits; another device than the layer's built it.
const std::string& tight() {
  static const std::string path = built(kPlain, "tight.vdvr", "1%", {"--storage", "u8"});
  return path;
}
/// Promises a quarter less than it was built for, which leaves room for weights of 8 bits.
const std::string& loose() {
  static const std::string path = [] {
    VdvrFile file = read_vdvr(built(kPlain, "narrow.vdvr", "4%", {"--storage", "f32"}));
    file.certificate.epsilon *= 1.25;
    file.certificate.epsilon_abs *= 1.25;
    write_vdvr(at("loose.vdvr"), file.volume, file.certificate);
    return at("loose.vdvr");
  }();
  return path;
}

constexpr std::int64_t kSide = 48;

/// The values of a slice across z near the middle of the volume, as `sampler` reads them there.
std::vector<float> slice_on(const Unit& unit, const std::string& volume, const std::string& sampler, double z,
                            const Words& more = {}) {
  Words words{"render", volume,   "--mode", "slice", "--slice-position", std::to_string(z), "--sampler",
              sampler,  "--size", "48x48",  "-o",    at("slice.npy"),    "--force"};
  words.insert(words.end(), more.begin(), more.end());
  const Ended r = run_on(unit, words);
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  const std::string bytes = bytes_of(at("slice.npy"));
  std::vector<float> values(kSide * kSide);
  BOOST_REQUIRE(bytes.size() > 4 * values.size());
  std::memcpy(values.data(), bytes.data() + bytes.size() - 4 * values.size(), 4 * values.size());
  return values;
}

/// The largest |V - F| over pixels of slices, V as it was drawn.
struct Truth {
  explicit Truth(const std::string& volume)
      : file(read_vdvr(volume)), scan(read_scan(scan_file())), field(scan, file.certificate.field) {}
  VdvrFile file;
  ProjectionSet scan;
  ExactField field;

  double error(const std::vector<float>& drawn, double z) const {
    RenderOptions o;
    o.mode = RenderMode::slice;
    o.width = o.height = kSide;
    o.slice_position = z;
    std::vector<Vec3> points;
    std::vector<double> values;
    for (std::int64_t y = 0; y < kSide; ++y)
      for (std::int64_t x = 0; x < kSide; ++x) {
        const Vec3 p = slice_point(o, file.volume.grid, x, y);
        const float v = drawn[static_cast<std::size_t>(y * kSide + x)];
        if (std::isnan(v) || !field.covered(p)) continue;
        points.push_back(p);
        values.push_back(static_cast<double>(v));
      }
    BOOST_REQUIRE(points.size() > 500);
    const std::vector<double> f = field.at(points);
    double worst = 0;
    for (std::size_t i = 0; i < f.size(); ++i) worst = std::max(worst, std::abs(values[i] - f[i]));
    return worst;
  }
};

const std::vector<double> kSlices{-1.3, 0.4, 2.21};

double largest(const Unit& unit, const Truth& truth, const std::string& volume, const std::string& sampler,
               const Words& more = {}) {
  double worst = 0;
  for (const double z : kSlices)
    worst = std::max(worst, truth.error(slice_on(unit, volume, sampler, z, more), z));
  return worst;
}

}  // namespace

// The builder weighs in fp32, the unit of the layer by few bits.
BOOST_AUTO_TEST_SUITE(a_coarser_unit, *boost::unit_test::precondition(on_fp32_weights))

BOOST_AUTO_TEST_CASE(what_the_file_says_of_its_builder_is_false_of_a_coarser_unit) {
  const Truth truth(tight());
  const Certificate& c = truth.file.certificate;
  BOOST_REQUIRE(c.holds_image3d.value_or(false));
  BOOST_TEST(largest(kPlain, truth, tight(), "image3d") <= *c.total_image3d);
  // The layer is such a unit: otherwise nothing below would be shown.
  BOOST_TEST(largest(unit_of(2), truth, tight(), "image3d", {"--unverified"}) > c.epsilon_abs);
  // What is charged there covers it.
  const Json bound = json_on(unit_of(2), {"render", tight(), "--mode", "error", "--sampler", "image3d", "-o",
                                          at("error.png"), "--force"});
  BOOST_TEST(bound.at("bound").get<double>() > c.epsilon_abs);
  BOOST_TEST(bound.at("sampler_term").at("value").get<double>() > c.budget.sampler.image3d->value);
}

BOOST_AUTO_TEST_CASE(an_image3d_that_does_not_hold_here_is_refused_by_name_and_nothing_is_written) {
  for (const int bits : {4, 8})
    for (const Words& how : {Words{}, Words{"--certify", "--no-shading"}, Words{"--mode", "slice"},
                             Words{"--show", "error"}, Words{"--certify", "--mode", "iso"}}) {
      Words words{"render", tight(), "--sampler", "image3d", "--size", "160x160", "-o", at("refused.png")};
      words.insert(words.end(), how.begin(), how.end());
      const Ended r = run_on(unit_of(bits), words);
      BOOST_TEST_CONTEXT(bits << " bits, " << (how.empty() ? "" : how.back()) << " said: " << r.err) {
        BOOST_TEST(r.code == 1);
        BOOST_TEST(last_line(r.err).find("does not hold for the image3d sampler here") != std::string::npos);
        BOOST_TEST(last_line(r.err).find("--sampler buffer") != std::string::npos);
        for (const char* name : {"refused.png", "refused.bound.png", "refused.certificate.json"})
          BOOST_TEST(!std::filesystem::exists(at(name)));
      }
    }
}

BOOST_AUTO_TEST_CASE(without_a_name_the_picture_is_the_buffer_s_to_the_bit) {
  for (const double z : kSlices)
    BOOST_TEST((slice_on(unit_of(4), tight(), "auto", z) == slice_on(kPlain, tight(), "buffer", z)));
  const Json said =
      json_on(unit_of(4), {"render", tight(), "--size", "32x32", "-o", at("auto.png"), "--force"});
  BOOST_TEST(said.at("sampler") == "buffer");
  BOOST_TEST(said.at("sampler_term").at("sampler") == "buffer");
  BOOST_TEST(said.at("verified") == true);
}

BOOST_AUTO_TEST_CASE(verify_tells_a_builder_s_false_term_from_another_device_s_unit) {
  const Json elsewhere =
      json_on(unit_of(8), {"verify", tight(), "--projections", scan_file()}).at("samplers");
  BOOST_TEST(elsewhere.at("buffer").at("holds") == true);
  BOOST_TEST(elsewhere.at("image3d").at("holds") == false);
  BOOST_TEST(elsewhere.at("image3d").at("of_this_device") == false);
  // The same file, said to be of this very device: then its term is wrong.
  VdvrFile file = read_vdvr(tight());
  file.certificate.driver =
      json_on(unit_of(8), {"devices", "--device", "0"}).at("devices").at(0).at("driver").get<std::string>();
  write_vdvr(at("claimed.vdvr"), file.volume, file.certificate);
  const Ended builder = run_on(unit_of(8), {"verify", at("claimed.vdvr"), "--projections", scan_file()});
  BOOST_TEST(builder.code == 1);
  BOOST_TEST(builder.err.find("the sampler term of image3d") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(an_image3d_that_holds_here_is_charged_what_this_unit_errs_by) {
  const Unit unit = unit_of(8);
  const Truth truth(loose());
  const Certificate& c = truth.file.certificate;
  const Words certify{"render", loose(), "--certify", "--no-shading",    "--sampler", "image3d",
                      "--size", "48x48", "-o",        at("charged.png"), "--force"};
  const Json here = json_on(unit, certify);
  BOOST_TEST(here.at("device") == c.device);
  BOOST_TEST(here.at("driver") != c.driver);
  BOOST_TEST(here.at("sampler") == "image3d");
  const double term = here.at("sampler_term").at("value").get<double>();
  BOOST_TEST(here.at("sampler_term").at("sampler") == "image3d");
  BOOST_TEST(term > 10 * c.budget.sampler.image3d->value);
  const auto total = json_on(unit, {"render", loose(), "--mode", "error", "--sampler", "image3d", "-o",
                                    at("error.png"), "--force"})
                         .at("bound")
                         .get<double>();
  BOOST_TEST(total <= c.epsilon_abs * (1 + 0x1p-22));  // in fp32
  BOOST_TEST(largest(unit, truth, loose(), "image3d") <= total);
  double apart = 0;
  for (const double z : kSlices) {
    const auto image = slice_on(unit, loose(), "image3d", z), buffer = slice_on(unit, loose(), "buffer", z);
    for (std::size_t i = 0; i < image.size(); ++i)
      apart = std::max(apart, std::abs(static_cast<double>(image[i]) - static_cast<double>(buffer[i])));
  }
  BOOST_TEST(apart <= term);
  BOOST_TEST(apart > 2 * c.budget.sampler.image3d->value);  // more than the file charges
  // Held to this unit when it is verified.
  const std::string certificate = at("charged.certificate.json");
  BOOST_TEST(run_on(unit, {"verify", loose(), "--picture", certificate}).code == 0);
  Json less = Json::parse(bytes_of(certificate));
  less["sampler_term"]["value"] = c.budget.sampler.image3d->value;
  write(at("less.certificate.json"), less.dump());
  const Ended found = run_on(unit, {"verify", loose(), "--picture", at("less.certificate.json")});
  BOOST_TEST(found.code == 1);
  BOOST_TEST(found.err.find("the term of the sampler") != std::string::npos);
  // What the builder certifies of its own is narrower, and does not hold here.
  const double mean = here.at("levels").at("mean").get<double>();
  BOOST_TEST(json_on(kPlain, certify).at("levels").at("mean").get<double>() < mean);
  BOOST_TEST(run_on(unit, {"verify", loose(), "--picture", certificate}).code == 1);
}

BOOST_AUTO_TEST_CASE(a_build_on_a_coarse_unit_holds_for_both_samplers_and_costs_little_more) {
  const auto samples = [](const std::string& volume) {
    return json_on(kPlain, {"info", volume}).at("storage").at("samples_ratio").get<double>();
  };
  Unit without = unit_of(8);
  without["VDVR_SHIM_IMAGES"] = "0";
  const std::string buffer = built(without, "buffer.vdvr", "3%", {"--storage", "f32"});
  for (const auto& [unit, more] : {std::pair{unit_of(8), 1.25}, {nvidia_like(), 1.5}}) {
    const std::string coarse = built(unit, "coarse.vdvr", "3%", {"--storage", "f32"});
    const Truth truth(coarse);
    const Certificate& c = truth.file.certificate;
    BOOST_REQUIRE(c.holds_image3d.value_or(false));
    BOOST_TEST(c.budget.sampler.image3d->value > 10 * c.budget.sampler.buffer.value);
    BOOST_TEST(largest(unit, truth, coarse, "image3d") <= *c.total_image3d);
    BOOST_TEST(run_on(unit, {"verify", coarse, "--projections", scan_file()}).code == 0);
    BOOST_TEST(samples(coarse) <= more * samples(buffer));
  }
}

BOOST_AUTO_TEST_CASE(a_tolerance_in_sigma_holds_for_a_coarse_unit_brick_by_brick) {
  const std::string noisy = at("noisy.h5");
  json_on(kPlain, {"simulate", "--phantom", "shepp-logan", "--detector", "33x9", "--angles", "90", "--pitch",
                   "0.1", "--photons", "20000", "-o", noisy});
  const Json said = json_on(nvidia_like(), {"build", noisy, "--epsilon", "1sigma", "-o", at("sigma.vdvr")});
  const Json& c = said.at("certificate");
  BOOST_TEST(c.at("holds").at("image3d") == true);
  const double worst = c.at("noise").at("worst").at("image3d").get<double>();
  BOOST_TEST(worst <= 1);
  BOOST_TEST(worst > c.at("noise").at("worst").at("buffer").get<double>());
  BOOST_TEST(run_on(nvidia_like(), {"verify", at("sigma.vdvr"), "--projections", noisy}).code == 0);
}

BOOST_AUTO_TEST_CASE(auto_storage_takes_no_type_that_the_unit_filters_badly) {
  const Json probe =
      json_on(kBadlyU8, {"devices", "--device", "0", "--probe"}).at("devices").at(0).at("probe");
  BOOST_TEST(probe.at("f32").at("delta").get<double>() <= 0x1p-22);
  BOOST_TEST(probe.at("u16").at("delta").get<double>() <= 0x1p-22);
  BOOST_TEST(probe.at("u8").at("weight_error").get<double>() > 0x1p-10);
  const Ended text = run_on(kBadlyU8, {"devices", "--device", "0", "--probe"});
  for (const char* type : {"filter f32", "filter u16", "filter u8"})
    BOOST_TEST(text.out.find(type) != std::string::npos);
  const VdvrFile well = read_vdvr(built(kPlain, "well.vdvr", "5%", {}));
  const VdvrFile badly = read_vdvr(built(kBadlyU8, "badly.vdvr", "5%", {}));
  BOOST_TEST((well.volume.base.type == SampleType::u8));
  BOOST_TEST((badly.volume.base.type == SampleType::u16));
  for (const auto& [kind, block] : badly.volume.tiles) BOOST_TEST((block.type != SampleType::u8));
  BOOST_TEST(badly.certificate.holds_image3d.value_or(false));
}

BOOST_AUTO_TEST_SUITE_END()
