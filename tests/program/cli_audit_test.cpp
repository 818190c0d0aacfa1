// vdvr audit: what it prints and writes, exit codes, what it refuses.
#define BOOST_TEST_MODULE cli_audit
#include <boost/test/unit_test.hpp>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command_line.hpp"
#include "vdvr/expert/volume_file.hpp"

using namespace vdvr::support;
using nlohmann::json;

namespace {

const std::string& reconstruction() {
  static const std::string path = [] {
    const std::string file = at("ours.mha");
    const Ended r = run({"reconstruct", small_scan(), "-o", file});
    BOOST_REQUIRE_MESSAGE(r.code == 0, r.err);
    return file;
  }();
  return path;
}

json audited(const std::string& volume, std::vector<std::string> more = {}, int code = 0) {
  std::vector<std::string> words{"audit", volume, "--projections", small_scan(), "--json", "--quiet"};
  words.insert(words.end(), more.begin(), more.end());
  const Ended r = run(words);
  BOOST_REQUIRE_MESSAGE(r.code == code, r.err);
  return json::parse(r.out);
}

/// The samples as numpy.save has them, without a grid.
std::string npy_of(const vdvr::Volume& v) {
  const vdvr::Index3 n = v.grid.samples();
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::to_string(n[2]) + ", " +
                       std::to_string(n[1]) + ", " + std::to_string(n[0]) + "), }";
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  std::string bytes = "\x93NUMPY";
  bytes += '\x01';
  bytes += '\x00';
  bytes += static_cast<char>(header.size() & 0xff);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(v.samples.data()), v.samples.size() * sizeof(float));
  return bytes;
}

}  // namespace

BOOST_AUTO_TEST_CASE(our_own_volume_has_no_fault_and_ends_in_order) {
  const json a = audited(reconstruction());
  BOOST_TEST(a.at("registration").at("found").empty());
  BOOST_TEST(a.at("registered").is_null());
  const json& f = a.at("as_is");
  BOOST_TEST(f.at("rms").get<double>() < f.at("largest").get<double>());
  BOOST_TEST(f.at("largest").get<double>() <= f.at("lower").get<double>());
  BOOST_TEST(f.at("lower").get<double>() <= f.at("upper").get<double>());
  BOOST_TEST(a.at("origin_from") == "file");
  const Ended r = run({"audit", reconstruction(), "--projections", small_scan()});
  BOOST_TEST(r.code == 0);
  for (const char* words : {"nothing is off", "at samples", "between", "certified", "a distance"})
    BOOST_TEST(r.out.find(words) != std::string::npos, words);
}

BOOST_AUTO_TEST_CASE(a_file_without_a_grid_is_centred_on_the_axis) {
  const vdvr::Volume v = vdvr::read_volume(reconstruction());
  write(at("ours.npy"), npy_of(v));
  const json own = audited(reconstruction()), a = audited(at("ours.npy"));
  BOOST_TEST(a.at("spacing_from") == "the detector's pitch");
  BOOST_TEST(a.at("origin_from") == "centred on the axis");
  for (const char* figure : {"rms", "largest", "lower", "upper"})
    BOOST_TEST(a.at("as_is").at(figure).get<double>() == own.at("as_is").at(figure).get<double>(), figure);
  // Options go before what is assumed.
  const json off = audited(at("ours.npy"), {"--origin", "-16,-15.5,-4"});
  BOOST_TEST(off.at("origin_from") == "option");
  BOOST_TEST(off.at("as_is").at("rms").get<double>() > a.at("as_is").at("rms").get<double>());
}

BOOST_AUTO_TEST_CASE(a_factor_is_named_and_put_right) {
  vdvr::Volume v = vdvr::read_volume(reconstruction());
  for (float& s : v.samples) s *= 2;
  vdvr::write_volume(at("twice.mha"), v);
  const json a = audited(at("twice.mha"));
  BOOST_TEST(a.at("registration").at("found").size() == 1u);
  BOOST_TEST(a.at("registration").at("found").at(0) == "densities 2 times too large");
  BOOST_TEST(a.at("registered").at("rms").get<double>() < a.at("as_is").at("rms").get<double>());
  BOOST_TEST(audited(at("twice.mha"), {"--as-is"}).at("registration").is_null());
}

BOOST_AUTO_TEST_CASE(a_tolerance_decides_the_exit_code) {
  const json a = audited(reconstruction());
  const double lower = a.at("as_is").at("lower"), upper = a.at("as_is").at("upper");
  BOOST_TEST(audited(reconstruction(), {"--within", std::to_string(1.01 * upper), "--as-is"}).at("met") ==
             true);
  BOOST_TEST(audited(reconstruction(), {"--within", std::to_string(0.9 * lower), "--as-is"}, 1).at("met") ==
             false);
  BOOST_TEST(audited(reconstruction(), {"--within", "90%", "--as-is"}).at("met") == true);
  const Ended r =
      run({"audit", reconstruction(), "--projections", small_scan(), "--within", "0.01%", "--quiet"});
  BOOST_TEST(r.code == 1);
  BOOST_TEST(last_line(r.err).find("reaches") != std::string::npos, r.err);
}

BOOST_AUTO_TEST_CASE(a_picture_shows_the_worst_slice) {
  audited(reconstruction(), {"--as-is", "-o", at("worst.png")});
  BOOST_TEST(bytes_of(at("worst.png")).substr(1, 3) == "PNG");
  check_refused({"audit", reconstruction(), "--projections", small_scan(), "-o", at("worst.png")},
                "worst.png");
  check_no_temporary_file_is_left();
}

BOOST_AUTO_TEST_CASE(bad_input_is_refused_in_one_line) {
  const std::string scan = small_scan(), volume = reconstruction();
  check_refused({"audit", at("none.mha"), "--projections", scan}, "none.mha");
  check_refused({"audit", volume, "--projections", at("none.h5")}, "none.h5");
  check_refused({"audit", volume}, "projections");
  check_refused({"audit", small_volume(), "--projections", scan}, "verify");
  check_refused({"audit", volume, "--projections", scan, "--within", "-1"}, "within");
  check_refused({"audit", volume, "--projections", scan, "--interpolate", "sinc"}, "interpolate");
  check_refused({"audit", volume, "--projections", scan, "--size", "4x4x4"}, "size");
  check_refused({"audit", volume, "--projections", scan, "--origin", "900,0,0"}, "all views see");
  check_refused({"audit", volume, "--projections", scan, "-o", at("worst.jpg")}, "png");
  write(at("flat.npy"), "no array at all");
  check_refused({"audit", at("flat.npy"), "--projections", scan}, "flat.npy");
}

BOOST_AUTO_TEST_CASE(memory_is_limited_and_an_interrupted_audit_leaves_nothing) {
  const Ended r = run({"audit", reconstruction(), "--projections", small_scan(), "--max-memory", "100K"});
  BOOST_TEST((r.code == 2 || r.code == 3), r.err);
  check_interrupted({"audit", reconstruction(), "--projections", small_scan(), "-o", at("gone.png")},
                    "register", {"gone.png"});
}
