// What an audit finds of volumes that are altered on purpose, by name; and what it finds of those that are
// not.
#define BOOST_TEST_MODULE audit
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <string>
#include <vector>

#include "host/verify/audit/orientation.hpp"
#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/audit.hpp"

using namespace vdvr;
using namespace vdvr::testing;
using vdvr::support::device;

namespace {

/// Not its own mirror image, along no axis and no diagonal.
Phantom lopsided(double r) {
  return ellipsoid_list({{1, {0, 0, 0}, {0.75 * r, 0.62 * r, 0.55 * r}, 20},
                         {-0.5, {0.25 * r, 0.12 * r, 0.2 * r}, {0.2 * r, 0.3 * r, 0.16 * r}, 50},
                         {0.7, {-0.3 * r, 0.2 * r, -0.1 * r}, {0.14 * r, 0.1 * r, 0.2 * r}, 0},
                         {0.6, {0.1 * r, -0.35 * r, -0.25 * r}, {0.12 * r, 0.16 * r, 0.1 * r}, 0}},
                        0, "lopsided");
}

struct Case {
  std::string name;
  ProjectionSet scan;
};

/// Half a turn without noise, of an odd detector; and one of even rows with noise of 2 % of the largest
/// integral.
const std::vector<Case>& cases() {
  static const std::vector<Case> all = [] {
    std::vector<Case> list{{"lopsided", simulated(lopsided(17), 37, 37, 48)},
                           {"noisy", simulated(lopsided(47), 97, 64, 120)}};
    unsigned state = 1;
    for (float& p : list[1].scan.data) {
      double sum = 0;  // of twelve uniform numbers: nearly normal
      for (int i = 0; i < 12; ++i)
        sum += static_cast<double>((state = state * 1664525u + 1013904223u) >> 8) / 0x1p24;
      p += static_cast<float>(0.02 * 70 * (sum - 6));
    }
    return list;
  }();
  return all;
}

Volume made(const ProjectionSet& scan, const FieldOptions& field = {}) {
  GridOptions grid;
  // An even and an odd number of samples, and a box that is no cube.
  grid.size = Index3{scan.geometry.columns - 5, scan.geometry.columns - 4, scan.geometry.rows - 7};
  return reconstruct(device(), scan, make_grid(scan, grid), {field, 8, Interpolation::linear});
}

Registration found(const ProjectionSet& scan, const Volume& v) {
  return register_volume(device(), scan, v, {});
}

bool says(const Registration& r, const std::string& words) {
  for (const std::string& w : r.words)
    if (w.find(words) != std::string::npos) return true;
  return false;
}

std::string all(const Registration& r) {
  std::string text;
  for (const std::string& w : r.words) text += w + "; ";
  return text;
}

void check_names(const Case& c, const Volume& v, const std::vector<std::string>& words) {
  const Registration r = found(c.scan, v);
  BOOST_TEST_CONTEXT(c.name << ": " << all(r)) {
    BOOST_TEST(r.words.size() == words.size());
    for (const std::string& w : words) BOOST_TEST(says(r, w), w);
    // A factor and an offset leave the share that is explained as it is; all else must halve the rest.
    const bool moved = std::any_of(words.begin(), words.end(), [](const std::string& w) {
      return w.find("densities") == std::string::npos && w.find("offset") == std::string::npos;
    });
    if (moved) BOOST_TEST(r.unexplained_registered < r.unexplained / 2);
  }
}

}  // namespace

BOOST_AUTO_TEST_CASE(our_own_reconstruction_has_no_fault) {
  for (const Case& c : cases()) check_names(c, made(c.scan), {});
}

BOOST_AUTO_TEST_CASE(mirrors_and_transposed_axes_are_named) {
  for (const Case& c : cases()) {
    const Volume v = made(c.scan);
    check_names(c, oriented(v, {{0, 1, 2}, {true, false, false}}), {"mirrored along x"});
    check_names(c, oriented(v, {{0, 1, 2}, {false, false, true}}), {"mirrored along z"});
    check_names(c, oriented(v, {{1, 0, 2}, {}}), {"axes x and y transposed"});
    check_names(c, oriented(v, {{2, 1, 0}, {}}), {"axes x and z transposed"});
    check_names(c, oriented(v, {{1, 0, 2}, {true, false, false}}), {"a quarter turn about z"});
  }
}

BOOST_AUTO_TEST_CASE(factors_offsets_and_shifts_are_named) {
  for (const Case& c : cases()) {
    const Volume v = made(c.scan);
    Volume twice = v;
    for (float& s : twice.samples) s *= 2;
    check_names(c, twice, {"densities 2 times too large"});
    Volume raised = v;
    for (float& s : raised.samples) s += 0.5f;
    check_names(c, raised, {"an offset: +0.5"});
    Volume off = v;
    off.grid.origin[1] += 0.5;
    check_names(c, off, {"half a sample off towards larger y"});
    off = v;
    off.grid.origin[2] -= 1;
    check_names(c, off, {"1 sample off towards smaller z"});
  }
}

BOOST_AUTO_TEST_CASE(another_centre_and_another_window_are_named) {
  for (const Case& c : cases()) {
    FieldOptions field;
    field.center = c.scan.geometry.center + 0.5;
    check_names(c, made(c.scan, field), {"F with its axis at"});
    const Registration r = found(c.scan, made(c.scan, field));
    // Words give two decimals: they are right where it is nearer to this than to the next ones.
    BOOST_TEST(std::abs(r.center - 0.5) < 0.005, c.name << " " << r.center);
    field = {};
    field.filter = RampWindow::hann;
    check_names(c, made(c.scan, field), {"another window: hann fits better than ram-lak"});
  }
}

BOOST_AUTO_TEST_CASE(several_faults_at_once_are_named) {
  const Case& c = cases().front();
  Volume v = oriented(made(c.scan), {{0, 1, 2}, {false, true, false}});
  v.grid.origin[0] += 1.3;
  for (float& s : v.samples) s *= 0.5f;
  check_names(c, v, {"mirrored along y", "densities 2 times too small", "1.30 samples off towards larger x"});
}

BOOST_AUTO_TEST_CASE(a_volume_of_something_else_is_doubted_and_nothing_is_named) {
  const Case& c = cases().front();
  Volume other = made(noise_scan(48, 37, 37, 9));
  const Registration r = found(c.scan, other);
  BOOST_TEST(r.words.empty(), all(r));
  BOOST_TEST(r.doubt.find("is it of this scan") != std::string::npos);
  BOOST_TEST(found(c.scan, made(c.scan)).doubt.empty());
}

BOOST_AUTO_TEST_CASE(what_is_put_right_is_what_it_was) {
  const Case& c = cases().front();
  const Volume v = made(c.scan);
  Volume twice = oriented(v, {{1, 2, 0}, {true, false, false}});
  for (float& s : twice.samples) s *= 2;
  const Audit a = audit(device(), c.scan, twice, {});
  BOOST_REQUIRE(a.registered.has_value());
  AuditOptions as_is;
  as_is.as_is = true;
  const Audit own = audit(device(), c.scan, v, as_is);
  BOOST_TEST(!own.registration.has_value());
  // Factor and offset are fitted by least squares: by Cauchy's inequality they are off by at most rms(e) over
  // the standard deviation of W, and rms(e) more, with e what W errs at samples; rms of a part of them is at
  // most twice that of all.
  double mean = 0, squares = 0, largest = 0;
  for (const float s : v.samples) mean += static_cast<double>(s) / static_cast<double>(v.samples.size());
  for (const float s : v.samples) {
    const double off = static_cast<double>(s) - mean;
    squares += off * off / static_cast<double>(v.samples.size());
    largest = std::max(largest, std::abs(off));
  }
  const double fitted = 2 * own.as_is.rms * (1 + largest / std::sqrt(squares));
  BOOST_TEST(std::abs(a.registered->lower - own.as_is.lower) <= fitted);
  BOOST_TEST(fitted < 0.1 * own.as_is.lower);
  BOOST_TEST(a.as_is.lower > a.registered->lower);
  BOOST_TEST(a.registered->samples == own.as_is.samples);
}

BOOST_AUTO_TEST_CASE(a_spike_is_found_where_it_is) {
  const Case& c = cases().front();
  Volume v = made(c.scan);
  const Index3 n = v.grid.samples();
  const Index3 place{n[0] / 2 + 3, n[1] / 2 - 4, n[2] / 2 + 2};
  v.samples[static_cast<std::size_t>((place[2] * n[1] + place[1]) * n[0] + place[0])] += 10;
  AuditOptions options;
  options.as_is = true;
  const AuditFigures f = audit(device(), c.scan, v, options).as_is;
  const Vec3 at = v.grid.position(place);
  BOOST_TEST(f.largest_at == at, boost::test_tools::per_element());
  BOOST_TEST(std::abs(f.largest - 10) < 0.1);
  BOOST_TEST(std::abs(f.rms * std::sqrt(static_cast<double>(f.samples)) - 10) < 0.5);
  // A box without it knows nothing of it.
  options.roi = {-8, -8, -8, 8, 8, at[2] - 1};
  BOOST_TEST(audit(device(), c.scan, v, options).as_is.lower < 5);
}

BOOST_AUTO_TEST_CASE(what_cannot_be_audited_is_refused) {
  const Case& c = cases().front();
  Volume away = made(c.scan);
  away.grid.origin[0] += 1000;
  BOOST_CHECK_THROW(audit(device(), c.scan, away, {}), InputError);
  AuditOptions as_is;
  as_is.as_is = true;
  BOOST_CHECK_THROW(audit(device(), c.scan, away, as_is), InputError);
  Volume flat = made(c.scan);
  for (float& s : flat.samples) s = 1;
  BOOST_CHECK_THROW(found(c.scan, flat), InputError);
}
