// certify_picture() and verify_picture() of the library against the command line: the same files, to the
// byte.
#define BOOST_TEST_MODULE certified_picture
#include <boost/test/unit_test.hpp>

#include <fmt/format.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/command_line.hpp"
#include "vdvr/automatic_view.hpp"
#include "vdvr/certified_picture.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/framing.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/verify_file.hpp"

using namespace vdvr;
using namespace vdvr::support;
using Words = std::vector<std::string>;
namespace fs = std::filesystem;

namespace {

const VdvrFile& file() {
  static const VdvrFile f = read_certified(small_volume());
  return f;
}

Device& device() {
  static Device d;
  return d;
}

PictureRequest request_of(RenderMode mode) {
  PictureRequest request;
  request.options = automatic_view(file().volume, file().certificate);
  request.options.mode = mode;
  request.options.width = request.options.height = 40;
  // Another mode frames something else, and a slice, which has no camera, nothing of its own.
  const OrbitFrame frame = mode == RenderMode::slice ? frame_grid(file().volume.grid)
                                                     : frame_view(file().volume, request.options, 30, 20);
  request.options.camera = orbit_camera(frame, 30, 20, 1);
  if (mode != RenderMode::dvr) request.options.step_mode = StepMode::fixed;
  if (mode == RenderMode::integral) request.options.slice_range.reset();
  request.options.gradient = GradientKind::automatic;
  request.options.slice_position.reset();
  return request;
}

/// Both ways, in two folders, since the certificate names its picture.
void check_same(const std::string& mode, const PictureRequest& request, Words more) {
  const fs::path ours = at("library-" + mode), theirs = at("program-" + mode);
  fs::create_directories(ours);
  fs::create_directories(theirs);
  const CertifiedPicture picture = certify_picture(device(), file(), request);
  write_certified_picture(ours / "p.png", picture);
  Words words{"render", small_volume(), "--certify",
              "--mode", mode,           "--size",
              "40x40",  "-o",           (theirs / "p.png").string()};
  words.insert(words.end(), more.begin(), more.end());
  const Ended r = run(words);
  BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
  std::vector<fs::path> all = beside_picture("p.png", request.options.mode);
  all.emplace_back("p.png");
  BOOST_TEST(all.size() == (mode == "iso" ? 2u : 3u));
  for (const fs::path& one : all)
    BOOST_TEST(bytes_of((ours / one).string()) == bytes_of((theirs / one).string()),
               one.string() << " of mode " << mode << " differs");
  const ProjectionSet scan = read_scan(small_scan());
  const PictureVerification v = verify_picture(device(), file(), ours / "p.certificate.json", {&scan, 6});
  BOOST_TEST(v.holds, (v.failures.empty() ? "" : v.failures.front()));
  BOOST_TEST(v.same_pixels);
  BOOST_REQUIRE(v.rays);
  BOOST_TEST(v.rays->rays == 6);
  BOOST_TEST(v.rays->outside == 0);
}

}  // namespace

BOOST_AUTO_TEST_CASE(colours_and_slices_are_those_of_the_command_line) {
  PictureRequest dvr = request_of(RenderMode::dvr);
  dvr.options.shading = false;
  check_same("dvr", dvr, {"--no-shading"});
  check_same("slice", request_of(RenderMode::slice), {"--plain"});
}

BOOST_AUTO_TEST_CASE(surfaces_maxima_and_integrals_are_those_of_the_command_line) {
  check_same("iso", request_of(RenderMode::iso), {});
  check_same("mip", request_of(RenderMode::mip), {});
  check_same("integral", request_of(RenderMode::integral), {});
}

BOOST_AUTO_TEST_CASE(a_tolerance_and_a_light_reach_the_library) {
  PictureRequest lit = request_of(RenderMode::dvr);
  lit.lit = true;
  const CertifiedPicture of_f = certify_picture(device(), file(), lit);
  BOOST_TEST((of_f.bounds.light == CertifiedLight::lit));
  PictureRequest plain = request_of(RenderMode::dvr);
  plain.options.shading = false;
  plain.keep_steps = true;
  plain.options.step = 1;
  plain.options.step_mode = StepMode::fixed;
  plain.options.classification = Classification::post;
  const CertifiedPicture coarse = certify_picture(device(), file(), plain);
  BOOST_TEST((coarse.record.options.classification == Classification::post));
  BOOST_TEST(coarse.record.options.step == 1);
  plain.keep_steps = false;
  const double loose = certify_picture(device(), file(), plain).bound.max;
  plain.tolerance = 0;
  BOOST_TEST(certify_picture(device(), file(), plain).bound.max <= loose);
}

BOOST_AUTO_TEST_CASE(what_cannot_be_certified_is_refused_and_leaves_nothing) {
  const auto refused = [&](const PictureRequest& request, const std::string& named) {
    BOOST_CHECK_EXCEPTION(
        static_cast<void>(certify_picture(device(), file(), request)), InputError,
        [&](const InputError& e) { return std::string(e.what()).find(named) != std::string::npos; });
  };
  PictureRequest request = request_of(RenderMode::error);
  refused(request, "mode");
  request = request_of(RenderMode::dvr);
  request.options.output = RenderOutput::depth;
  refused(request, "colours");
  request = request_of(RenderMode::iso);
  request.options.surfaces.push_back(request.options.surfaces.front());
  refused(request, "one surface");
  request = request_of(RenderMode::dvr);
  request.options.clip = Clip{{900, 900, -900}, {901, 901, 900}};
  refused(request, "clip");
  request.options.clip = Clip{};
  request.options.clip->axis = {1, 0};
  refused(request, "clip");
  request.options.clip = Clip{};
  request.options.clip->low[1] = std::numeric_limits<double>::quiet_NaN();
  refused(request, "clip");
  VdvrFile altered = file();
  altered.altered = "its seal is broken";
  BOOST_CHECK_THROW(static_cast<void>(certify_picture(device(), altered, request_of(RenderMode::dvr))),
                    MismatchError);
  VdvrFile better = file();
  better.certificate.total_buffer /= 2;
  BOOST_CHECK_THROW(static_cast<void>(certify_picture(device(), better, request_of(RenderMode::dvr))),
                    MismatchError);
  VdvrFile other = file();
  other.certificate.comparison = true;
  BOOST_CHECK_THROW(static_cast<void>(certify_picture(device(), other, request_of(RenderMode::dvr))),
                    InputError);
  const CertifiedPicture slice = certify_picture(device(), file(), request_of(RenderMode::slice));
  BOOST_CHECK_THROW(write_certified_picture(at("never.npy"), slice), InputError);
  BOOST_CHECK_THROW(write_certified_picture(at("no-folder/never.png"), slice), Error);
  for (const char* name : {"never.npy", "never.certificate.json", "never.bound.png", "no-folder"})
    BOOST_TEST(!fs::exists(at(name)));
}

BOOST_AUTO_TEST_CASE(a_part_that_is_not_covered_cannot_be_asked_for) {
  PictureRequest request = request_of(RenderMode::dvr);
  request.options.shading = false;
  const CertifiedPicture usual = certify_picture(device(), file(), request);
  request.covered = CoveredCylinder{1e6, {-1e6, 1e6}};
  const CertifiedPicture asked = certify_picture(device(), file(), request);
  BOOST_TEST(asked.record.covered.radius == usual.record.covered.radius);
  BOOST_TEST(asked.record.pixels_sha256 == usual.record.pixels_sha256);
}

BOOST_AUTO_TEST_CASE(a_certificate_that_was_changed_does_not_hold) {
  const CertifiedPicture slice = certify_picture(device(), file(), request_of(RenderMode::slice));
  const fs::path png = at("changed.png"), json = at("changed.certificate.json");
  write_certified_picture(png, slice);
  std::string text = bytes_of(json.string());
  const auto mean = text.find("\"mean\": ") + 8;
  text.replace(mean, text.find(',', mean) - mean, "0.001");
  write(json.string(), text);
  const PictureVerification v = verify_picture(device(), file(), json);
  BOOST_TEST(!v.holds);
  BOOST_TEST(v.failures.size() == 1u);
  BOOST_TEST(!v.rays.has_value());
  VdvrFile other = file();
  other.altered = "its seal is broken";
  BOOST_CHECK_THROW(static_cast<void>(verify_picture(device(), other, json)), MismatchError);
  other = file();
  other.certificate.content_sha256 = std::string(64, '0');
  BOOST_CHECK_THROW(static_cast<void>(verify_picture(device(), other, json)), MismatchError);
}
