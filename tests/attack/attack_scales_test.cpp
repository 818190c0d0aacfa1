// Certificates in every unit: scans whose pitch, pitch ratio or densities once made a term of the certificate
// overflow or underflow in float32, held to the truth in double, and the same cases at scale 1 beside them.
#define BOOST_TEST_MODULE attack_scales
#include <boost/test/unit_test.hpp>

#include "tests/support/device.hpp"
#include "tests/support/hostile_check.hpp"

using namespace vdvr;
using namespace vdvr::hostile;
using support::device;

namespace {

constexpr std::uint64_t seed =
    12;  // of the points; one at which verify's sample and the file are checked too

// The default grid, at scale 1.
Case case_of(std::string name, ProjectionSet scan, double epsilon) {
  Case c;
  c.name = std::move(name);
  c.scan = std::move(scan);
  c.grid = make_grid(c.scan.geometry, {});
  c.epsilon = epsilon;
  return c;
}

Case at_scale(Case c, const Scale& scale) {
  find_range(c);
  c.scale = scale;
  return c;
}

std::string text_of(const Scale& s) {
  return "pitch " + detail::text_of(s.pitch_u) + " x " + detail::text_of(s.pitch_v) + ", density " +
         detail::text_of(s.density);
}

// At one tolerance, without a ladder of larger ones.
Report checked(const Case& c) {
  Report r = run_case(device(), c, seed, 0);
  for (const Failure& f : r.failures)
    BOOST_ERROR(c.name << ", " << text_of(c.scale) << ": " << f.kind << ": " << f.text);
  return r;
}

Report certified(const Case& c) {
  Report r = checked(c);
  BOOST_TEST(r.outcome.kind == "built", c.name << ", " << text_of(c.scale) << ": " << r.outcome.message);
  return r;
}

Case wave_of_one_row(double epsilon) {
  const ParallelGeometry g = attacks::geometry(2, 1, 12);
  Case c = case_of(
      "wave at 11/12 of Nyquist, two views of one row",
      attacks::scan_of(g,
                       [](auto, auto, auto u) {
                         return std::cos(reference::frequency(11, 12) * (static_cast<double>(u) + 0.5));
                       }),
      epsilon);
  c.rates = {64, Interpolation::linear, 2};
  c.settings.comparison.coefficients = Coefficients::sampled;
  return c;
}

Case wave_along_v() {
  const ParallelGeometry g = attacks::geometry(8, 9, 12);
  Case c =
      case_of("wave along v",
              attacks::unramp(g,
                              [](auto, auto v, auto) {
                                return std::cos(reference::frequency(5, 9) * (static_cast<double>(v) + 0.5));
                              }),
              0.15);
  c.rates = {8, Interpolation::cubic, 2};
  c.settings.comparison.coefficients = Coefficients::sampled;
  return c;
}

Case noisy_sphere() {
  return case_of("sphere with noise", detail::noisy_sphere(attacks::geometry(32, 9, 17), 0.3, 1), 0.02);
}

}  // namespace

BOOST_AUTO_TEST_CASE(noise_in_pixels_of_a_tenth_of_a_nanometre_is_certified_rightly) {
  for (const double pitch : {1.0, 3e-8, 3e-10, 1e-10, 1e-12, 1e12})
    certified(at_scale(noisy_sphere(), {pitch, pitch, 1}));
}

BOOST_AUTO_TEST_CASE(remainder_of_gold_survives_small_pitches_and_large_integrals) {
  // Line integrals of 1 and a pitch of 30 nm in metres; and integrals of 1e37.
  for (const Scale& s : {Scale{1, 1, 1}, Scale{3e-8, 3e-8, 1 / 3e-8}, Scale{1, 1, 1e37}}) {
    checked(at_scale(wave_of_one_row(0.15), s));  // out of reach, as it is at scale 1
    certified(at_scale(wave_of_one_row(0.45), s));
  }
}

BOOST_AUTO_TEST_CASE(curvature_along_v_survives_oblong_pixels) {
  for (const double ratio : {1.0, 1e12, 1e-12}) {
    certified(at_scale(wave_along_v(), {1, ratio, 1}));
    certified(at_scale(wave_along_v(), {1 / std::sqrt(ratio), std::sqrt(ratio), 1}));
  }
}

BOOST_AUTO_TEST_CASE(powers_of_two_change_neither_levels_nor_shares) {
  // run_case compares brick by brick with scale 1.
  for (const Case& c : {noisy_sphere(), wave_of_one_row(0.45), wave_along_v()})
    for (const Scale& s : {Scale{0x1p-40, 0x1p-40, 1}, Scale{0x1p40, 0x1p40, 1}, Scale{1, 0x1p40, 1},
                           Scale{1, 0x1p-40, 1}, Scale{1, 1, 0x1p-110}, Scale{1, 1, 0x1p115},
                           Scale{0x1p-40, 0x1p-80, 0x1p119}, Scale{0x1p40, 0x1p80, 0x1p-119}})
      BOOST_TEST(checked(at_scale(c, s)).compared, c.name << ", " << text_of(s) << ": not compared");
}

BOOST_AUTO_TEST_CASE(what_float32_cannot_hold_is_refused_by_name) {
  for (const Scale& s : {Scale{1e12, 1e12, 1e36}, Scale{1e-12, 1e-12, 1e-36}, Scale{1, 1, 3e38}}) {
    const Case c = at_scale(noisy_sphere(), s);
    BOOST_TEST(!misfit(c, s).empty());
    const Report r = checked(c);
    BOOST_TEST(r.outcome.kind == "input", text_of(s) << ": " << r.outcome.kind << ": " << r.outcome.message);
  }
}

// The harness itself: what it must find in a certificate that was right before.
BOOST_AUTO_TEST_CASE(wrong_certificates_are_found) {
  Case c = at_scale(noisy_sphere(), {});
  c.options.storage = StorageChoice::f32;
  const Inputs in = inputs_at(c, c.scale);
  const auto outcome = detail::attempt(device(), in);
  BOOST_REQUIRE(outcome.built);
  const auto kinds = [&](auto&& damage) {
    BuildResult result = *outcome.built;
    damage(result);
    Report r;
    check_built(device(), c, in, result, seed, r);
    std::set<std::string> found;
    for (const Failure& f : r.failures) found.insert(f.kind);
    return found;
  };
  BOOST_TEST(kinds([](BuildResult&) {}).empty());
  BOOST_TEST(kinds([](BuildResult& b) { b.certificate.total_buffer *= 0.6; }).contains("violation"));
  BOOST_TEST(kinds([](BuildResult& b) {
               for (float& t : b.certificate.brick_totals) t *= 0.6f;
             }).contains("brick bound"));
  BOOST_TEST(kinds([](BuildResult& b) {
               for (float& t : b.certificate.brick_totals) t = t == b.certificate.brick_totals[12] ? -1 : t;
             }).contains("not tested"));
  BOOST_TEST(kinds([](BuildResult& b) { b.certificate.bounds[0].value = INFINITY; }).contains("not finite"));
  BOOST_TEST(kinds([](BuildResult& b) { b.certificate.budget.gold.value = NAN; }).contains("not finite"));
  // Of every tile every other sample: points of check_built hit some cell that has one.
  BOOST_TEST(kinds([](BuildResult& b) {
               for (auto& [level, tiles] : b.volume.tiles)
                 for (std::size_t i = 0; i < tiles.f32.size(); i += 2)
                   tiles.f32[i] = std::numeric_limits<float>::quiet_NaN();
             }).contains("violation"));
}
