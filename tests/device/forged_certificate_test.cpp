// What verify finds of certificates that are not those of their volumes: edited and sealed again, or of
// totals below the truth.
#define BOOST_TEST_MODULE forged_certificate
#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/verify/verify_attack.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/scans.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/verify.hpp"

using namespace vdvr;
using vdvr::testing::noise_scan;
using Json = nlohmann::ordered_json;

namespace {

struct Made {
  ProjectionSet scan;
  MixedVolume volume;
  Certificate certificate;
};

std::string options_of(const ParallelGeometry& g, const MixedVolume& v, const Certificate& c) {
  Json j{{"granularity", v.granularity},
         {"base", {1, 1, 1}},
         {"terms", "all"},
         {"upsampling", c.rates.upsampling},
         {"u_filter", text_of(c.rates.interpolation)},
         {"gold", c.rates.gold}};
  j["geometry"] = {{"columns", g.columns},    {"rows", g.rows},     {"pitch_u", g.pitch_u},
                   {"pitch_v", g.pitch_v},    {"center", g.center}, {"unit", g.unit},
                   {"theta_rad", g.theta_rad}};
  return j.dump();
}

/// Built as the command line does, and in a file that is sealed.
const Made& made() {
  static const Made one = [] {
    Device device;
    Made m;
    m.scan = noise_scan(19, 9, 33, 10);
    GridOptions grid;
    grid.size = Index3{8, 8, 8};
    grid.spacing = 0.9;
    PlanSettings settings;
    settings.coarsening = LevelTriple{0, 0, 0};
    const Plan plan =
        make_plan(device, m.scan, make_grid(m.scan.geometry, grid), {}, {}, {0.02, {}}, settings);
    BuildOptions options;
    options.storage = StorageChoice::f32;
    BuildResult built = build(device, m.scan, plan, options);
    m.volume = std::move(built.volume);
    m.certificate = std::move(built.certificate);
    m.certificate.options_json = options_of(m.scan.geometry, m.volume, m.certificate);
    m.certificate.sealed = true;
    return m;
  }();
  return one;
}

/// What verify says of a certificate; "holds" if it does. A refusal is a finding too.
std::string verdict(const Certificate& c, bool exhaustive = true, const Made& of = made()) {
  static Device device;
  try {
    const VerifyResult r = verify(device, of.scan, of.volume, c, {exhaustive, 0.1, 3});
    BOOST_TEST(r.holds == r.failure.empty());
    return r.holds ? "holds" : r.failure;
  } catch (const Error& e) {
    return e.what();
  }
}

bool finds(const Certificate& c, const std::string& what, bool exhaustive = true, const Made& of = made()) {
  const std::string said = verdict(c, exhaustive, of);
  BOOST_TEST_MESSAGE(said);
  return said.find(what) != std::string::npos;
}

/// Totals that follow from the terms again, and what holds from those.
void add_up(Certificate& c) {
  charge_samplers(c, c.budget.sampler);
  c.holds_buffer = c.total_buffer <= c.epsilon_abs;
  if (c.total_image3d) c.holds_image3d = *c.total_image3d <= c.epsilon_abs;
}

/// All totals by brick that are above a value lowered to it, and the total of all with them.
void lower_totals(Certificate& c, double to) {
  for (float& total : c.brick_totals) total = std::min(total, static_cast<float>(to));
  c.measured_total = to;
  add_up(c);
}

/// Of cone beam, as the command line builds it.
const Made& made_of_cone() {
  static const Made one = [] {
    Device device;
    Made m;
    m.scan = vdvr::testing::noisy_cone({.views = 12, .rows = 17, .columns = 15, .source_to_axis = 90}, 5);
    CertifyOptions options;
    options.grid.size = Index3{4, 4, 4};
    options.build.storage = StorageChoice::f32;
    BuildResult built = certify(device, m.scan, Tolerance{0.1, {}}, options);
    m.volume = std::move(built.volume);
    m.certificate = std::move(built.certificate);
    m.certificate.sealed = true;
    return m;
  }();
  return one;
}

/// As programs from before wrote their rates of cone beam.
Certificate as_of_six_taps(Certificate c) {
  c.rates.upsampling = 8;
  c.rates.interpolation = Interpolation::six_taps;
  Json options = Json::parse(c.options_json);
  options["upsampling"] = 8;
  options["u_filter"] = "six-taps";
  c.options_json = options.dump();
  return c;
}

}  // namespace

// Files of earlier programs have other terms, and these are compared too: what is called older has them.
BOOST_AUTO_TEST_CASE(a_certificate_of_cone_beam_cannot_be_called_an_older_one_to_promise_more) {
  const Made& of = made_of_cone();
  BOOST_TEST(verdict(of.certificate, true, of) == "holds");
  Certificate older = as_of_six_taps(of.certificate);
  BOOST_TEST(finds(older, "the projection term is", true, of));
  older.budget.arithmetic.value *= 0.5;
  add_up(older);
  BOOST_TEST(finds(older, "the arithmetic term is", true, of));
  Certificate other = of.certificate;
  other.rates.upsampling = 8;
  BOOST_TEST(finds(other, "upsampling", true, of));
}

BOOST_AUTO_TEST_CASE(a_right_certificate_is_confirmed) {
  BOOST_TEST(verdict(made().certificate) == "holds");
  BOOST_TEST(verdict(made().certificate, false) == "holds");
}

BOOST_AUTO_TEST_CASE(edits_of_a_promise_that_were_sealed_again_are_found) {
  const Certificate& right = made().certificate;
  Certificate c = right;
  lower_totals(c, right.measured_max);
  BOOST_TEST(finds(c, "the total of brick"));
  c = right;
  c.total_buffer = right.measured_max;
  BOOST_TEST(finds(c, "total"));
  c = right;
  c.budget.arithmetic.value = 0;
  add_up(c);
  BOOST_TEST(finds(c, "the arithmetic term is 0"));
  c = right;
  c.budget.sampler.buffer.value = 0;
  c.budget.sampler.image3d_by_brick.clear();
  if (c.budget.sampler.image3d) c.budget.sampler.image3d->value = 0;
  add_up(c);
  BOOST_TEST(finds(c, "the sampler term of buffer is 0"));
  if (c.budget.sampler.image3d) BOOST_TEST(finds(c, "texture unit without error"));
  c = right;
  c.reference_range *= 100;
  c.epsilon /= 100;
  BOOST_TEST(finds(c, "reference_range"));
  c = right;
  c.reference_range /= 2;
  c.epsilon *= 2;
  BOOST_TEST(finds(c, "reference_range"));
  c = right;
  c.not_covered_count += 7;
  BOOST_TEST(finds(c, "not_covered.count"));
  c = right;
  c.not_covered_fraction += 0.01;
  BOOST_TEST(finds(c, "not_covered.fraction"));
  c = right;
  c.brick_totals.clear();
  BOOST_TEST(finds(c, "/brick_total, are missing"));
  c = right;
  auto options = Json::parse(c.options_json);
  options["geometry"]["pitch_u"] = 0.5;
  c.options_json = options.dump();
  BOOST_TEST(finds(c, "options.geometry.pitch_u"));
  c = right;
  // In the middle of the brick of the least total.
  const Index3 n = made().volume.bricks();
  const auto least = std::distance(
      c.brick_totals.begin(), std::min_element(c.brick_totals.begin(), c.brick_totals.end(),
                                               [](float a, float b) { return a >= 0 && (b < 0 || a < b); }));
  const std::int64_t middle = made().volume.granularity / 2, g = made().volume.granularity;
  c.worst_at = made().volume.grid.position(
      {least % n[0] * g + middle, least / n[0] % n[1] * g + middle, least / (n[0] * n[1]) * g + middle});
  BOOST_TEST(finds(c, "worst_at"));
  c = right;
  c.roi = std::array<double, 6>{0.1, 0.1, 0.1, 0.5, 0.5, 0.5};
  BOOST_TEST(finds(c, "roi"));
  c = right;
  c.epsilon_abs *= 4;
  c.epsilon *= 4;
  BOOST_TEST(verdict(c) == "holds");  // a weaker promise, and true
}

BOOST_AUTO_TEST_CASE(the_sample_of_bricks_finds_what_is_wrong_with_all) {
  Certificate c = made().certificate;
  lower_totals(c, c.measured_max);
  BOOST_TEST(finds(c, "the total of brick", false));
  c = made().certificate;
  c.budget.arithmetic.value = 0;
  add_up(c);
  BOOST_TEST(finds(c, "the arithmetic term is 0", false));
}

// A sample rests on where the file says that F is smallest and largest; files from before make the base
// again.
BOOST_AUTO_TEST_CASE(a_range_is_compared_where_it_is_attained) {
  const Certificate& right = made().certificate;
  BOOST_REQUIRE(right.range_at.has_value());
  Certificate c = right;
  c.range_at.reset();
  for (const bool exhaustive : {false, true}) BOOST_TEST(verdict(c, exhaustive) == "holds");
  for (const bool with_places : {true, false})
    for (const double factor : {1.01, 0.99}) {
      c = right;
      if (!with_places) c.range_at.reset();
      c.reference_range *= factor;
      c.epsilon /= factor;
      for (const bool exhaustive : {false, true}) BOOST_TEST(finds(c, "reference_range", exhaustive));
    }
  const Vec3 spacing = made().volume.grid.spacing;
  for (const bool exhaustive : {false, true})
    for (const std::size_t which : {0u, 1u}) {
      c = right;
      (*c.range_at)[which][0] += 0.5 * spacing[0];
      BOOST_TEST(finds(c, "range_at: no sample", exhaustive));
      c = right;
      (*c.range_at)[which][1] = made().volume.grid.origin[1] - 3 * spacing[1];  // beyond the grid
      BOOST_TEST(finds(c, "range_at: no sample", exhaustive));
      c = right;
      (*c.range_at)[which] = (*c.range_at)[1 - which];
      BOOST_TEST(finds(c, "reference_range", exhaustive));
    }
}

BOOST_AUTO_TEST_CASE(every_total_of_a_brick_that_was_lowered_is_found) {
  const Certificate& right = made().certificate;
  for (std::size_t i = 0; i < right.brick_totals.size(); ++i) {
    Certificate c = right;
    if (c.brick_totals[i] < 0) c.brick_totals[i] = 0;
    else c.brick_totals[i] *= 0.5f;
    if (*std::max_element(c.brick_totals.begin(), c.brick_totals.end()) <
        static_cast<float>(0.9 * c.measured_total))
      continue;
    BOOST_TEST(verdict(c) != "holds", "brick " << i);
  }
}

BOOST_AUTO_TEST_CASE(every_number_that_promises_something_is_compared) {
  const Json json = Json::parse(to_json(made().certificate)), leaves = json.flatten();
  std::size_t edits = 0;
  for (const auto& [name, value] : leaves.items()) {
    const Json::json_pointer member(name);
    if (!value.is_number() || name.starts_with("/bounds") || name.starts_with("/budget/gold")) continue;
    // Another node of the same brick is not found: only its brick is compared.
    if (name.starts_with("/worst_at")) continue;
    // Angles are all compared alike.
    if (name.starts_with("/options/geometry/theta_rad/") && name != "/options/geometry/theta_rad/5") continue;
    for (const double factor : {0.5, 2.0}) {
      Json changed = json;
      if (value.is_number_integer()) changed[member] = value.get<std::int64_t>() + (factor < 1 ? -1 : 1);
      else if (value.get<double>() == 0) changed[member] = factor;
      else changed[member] = factor * value.get<double>();
      Certificate c = certificate_from_json(changed.dump());
      c.brick_totals = made().certificate.brick_totals;
      ++edits;
      BOOST_TEST(verdict(c) != "holds", name << " is " << changed[member].dump());
    }
  }
  BOOST_TEST_MESSAGE(edits << " edits");
  BOOST_TEST(edits > 50u);
}

BOOST_AUTO_TEST_CASE(a_total_below_the_truth_between_nodes_is_found_by_points) {
  // V is F at all gold nodes, and interpolated between them.
  Device device;
  const ProjectionSet& scan = made().scan;
  const ExactField exact(scan, {});
  GridOptions options;
  options.size = Index3{8, 8, 4};
  Volume samples{make_grid(scan.geometry, options), {}};
  const std::vector<Vec3> nodes = vdvr::testing::places_of(samples.grid);
  const std::vector<double> F = exact.at(nodes);
  samples.samples.assign(F.begin(), F.end());
  const MixedVolume volume = as_mixed(samples);
  VerifyField field(device.state(), exact, volume, {}, {});
  const std::vector<std::uint8_t> all(volume.level.size(), 1);
  Certificate at_nodes;
  at_nodes.brick_totals.assign(volume.level.size(), -1);
  double largest = 0;
  field.run(all, volume.rate,
            [&](const VerifyField::Piece& b) {
              if (b.total < 0) return;
              at_nodes.brick_totals[static_cast<std::size_t>(b.brick)] =
                  static_cast<float>(b.error + 2 * field.arithmetic());
              largest = std::max(largest, b.total);
            },
            {});
  const CertifiedRegion region(scan);
  const auto attacked = [&](const Certificate& c) {
    TotalAttack attack(volume, c, region);
    field.run(all, volume.rate,
              [&](const VerifyField::Piece& b) {
                if (b.total >= 0) attack.consider(b);
              },
              {});
    return attack.run(exact, {});
  };
  // A bound by theory holds, what is true at every node does not: no node tells.
  Certificate proved = at_nodes;
  for (float& total : proved.brick_totals)
    if (total >= 0) total = static_cast<float>(0.999 * largest);
  const TotalAttack::Outcome right = attacked(proved);
  BOOST_TEST(right.failure.empty(), right.failure);
  BOOST_TEST(right.worst_share <= 1);
  const TotalAttack::Outcome wrong = attacked(at_nodes);
  BOOST_TEST(wrong.points > 100);
  BOOST_TEST(wrong.points <= 4000);
  BOOST_TEST(wrong.worst_share > 1);
  BOOST_TEST(wrong.failure.find("the certificate bounds it by") != std::string::npos, wrong.failure);
}
