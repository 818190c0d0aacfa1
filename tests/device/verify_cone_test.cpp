// Verify of cone beam: its nodes and bounds against F in double precision, on several orbits; valid
// certificates, damaged ones, and those of other views.
#define BOOST_TEST_MODULE verify_cone
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "host/base/system/casts.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/field/fdk/view_derivatives.hpp"
#include "host/verify/verify_field.hpp"
#include "host/verify/verify_points.hpp"
#include "host/verify/witness/cone_bounds.hpp"
#include "host/verify/witness/nodes.hpp"
#include "host/volume/bricks.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/device.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/certify.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/verify.hpp"

using namespace vdvr;
using vdvr::testing::ConeShape;
using vdvr::testing::grid_of;
using vdvr::testing::noisy_cone;

namespace {

struct Case {
  std::string name;
  ConeShape shape;
  double spacing = 1;
  VerifyField::Made made = VerifyField::Made::dense;
};

ConeShape orbit(double source, std::int64_t rows = 12, std::int64_t columns = 14) {
  ConeShape s;
  s.views = 17;
  s.source_to_axis = source;
  s.rows = rows;
  s.columns = columns;
  return s;
}

std::vector<Case> cases() {
  ConeShape tilted = orbit(50), other_way = orbit(40, 40), rolled = orbit(30), displaced = orbit(60),
            arc = orbit(45);
  tilted.in_plane_deg = 1;
  other_way.in_plane_deg = -3;
  other_way.out_of_plane_deg = -2;
  rolled.in_plane_deg = 40;
  tilted.out_of_plane_deg = 3;
  displaced.shift = 2.5;
  displaced.views = 30;
  arc.arc_deg = 230;
  return {{"5 degrees", orbit(80)},
          {"15 degrees", orbit(26)},
          {"tilted", tilted},
          {"tilted the other way", other_way},
          {"rolled by 40 degrees", rolled},
          {"displaced", displaced},
          {"short scan", arc},
          {"fan beam", orbit(50, 1)},
          {"cells of .6 pixels", orbit(50), 0.6},
          {"cells of two pixels", orbit(50), 2}};
}

/// Places of the array of gold, two nodes around the grid's own.
struct Gold {
  std::int64_t n = 0, nz = 0, z_padded = 0;
  std::vector<float> values;
};

Gold gold_of(opencl::State& state, VerifyNodes& nodes, const Grid& grid, int rate) {
  Gold g;
  g.n = std::max(grid.cells[0], grid.cells[1]) * rate + 5;
  g.nz = grid.cells[2] * rate + 5;
  g.z_padded = (g.nz + 15) / 16 * 16;
  const opencl::DeviceArray<float> values(state, count(g.n * g.n * g.z_padded + 64), "gold");
  const std::array<std::int64_t, 2> corner{-2, -2};
  nodes.gold({rate, std::span(&corner, 1), g.n, -2, g.z_padded}, values);
  g.values = values.to_host();
  return g;
}

/// Nodes of the whole grid.
VerifyNodes::Part part_of(const Grid& grid, const ConeNodeRates& rates, int finest, int points = 12) {
  VerifyNodes::Part p;
  p.points = points;
  p.across = rates.across;
  p.rows = false;
  p.along = rates.along;
  const std::int64_t around = finest > p.across ? p.reach() + 1 : 2,
                     beyond = finest > p.along ? p.reach() + 1 : 2 * std::max(1, p.along / p.across);
  p.first_x = p.first_y = -around;
  p.nx = grid.cells[0] * p.across + 1 + 2 * around;
  p.ny = grid.cells[1] * p.across + 1 + 2 * around;
  p.first_z = -beyond;
  p.nz = grid.cells[2] * p.along + 1 + 2 * beyond;
  p.tiles.assign(at(VerifyNodes::tiles_across(p.nx) * VerifyNodes::tiles_across(p.ny)), 1);
  return p;
}

struct Worst {
  double share = 0;
  std::int64_t nodes = 0, off_detector = 0;
};

bool is_seen(const ExactField& exact, const Vec3& p) {
  return std::all_of(exact.views().begin(), exact.views().end(), [&](const ViewMatrix& m) {
    const Vec3 s = projected(m, p);
    return s[0] >= -0.5 && s[0] <= static_cast<double>(exact.geometry().columns) - 0.5 && s[1] >= -0.5 &&
           s[1] <= static_cast<double>(exact.geometry().rows) - 0.5;
  });
}

/// Nodes by chance, of the cylinder and two steps of gold around, as a share of the bound.
Worst compare(const ExactField& exact, const Coverage& coverage, const Grid& grid, const Gold& gold, int rate,
              double bound) {
  std::mt19937 random(7);
  std::vector<Vec3> points;
  std::vector<double> values;
  const double reach = 3 * std::hypot(grid.spacing[0], grid.spacing[1]) / rate;
  for (int tries = 0; tries < 20000 && points.size() < 500; ++tries) {
    const Index3 node{static_cast<std::int64_t>(random() % count(grid.cells[0] * rate + 5)),
                      static_cast<std::int64_t>(random() % count(grid.cells[1] * rate + 5)),
                      static_cast<std::int64_t>(random() % count(gold.nz))};
    Vec3 p{};
    for (std::size_t a = 0; a < 3; ++a)
      p[a] = grid.origin[a] + static_cast<double>(node[a] - 2) / rate * grid.spacing[a];
    if (coverage.margin(p[0], p[1]) < -reach) continue;
    points.push_back(p);
    values.push_back(
        static_cast<double>(gold.values[at((node[1] * gold.n + node[0]) * gold.z_padded + node[2])]));
  }
  Worst w;
  w.nodes = static_cast<std::int64_t>(points.size());
  const std::vector<double> F = exact.at(points);
  for (std::size_t i = 0; i < F.size(); ++i) {
    const double share = std::abs(values[i] - F[i]) / bound;
    if (!(share <= w.share)) w.share = std::isnan(share) ? std::numeric_limits<double>::infinity() : share;
    w.off_detector += is_seen(exact, points[i]) ? 0 : 1;
  }
  return w;
}

double uniform(std::mt19937& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
}

/// Base samples of F, every brick at level 0.
MixedVolume volume_of(const ExactField& exact, const Grid& grid, int rate) {
  MixedVolume v;
  v.grid = grid;
  v.granularity = 2;
  v.rate = rate;
  const std::vector<Vec3> points = vdvr::testing::places_of(grid);
  const std::vector<double> F = exact.at(points);
  v.base.f32.assign(F.begin(), F.end());
  v.level.assign(at(v.brick_count()), LevelTriple{0, 0, 0});
  v.tile.assign(at(v.brick_count()), 0);
  return v;
}

struct Built {
  ProjectionSet scan;
  BuildResult result;
};

// Ellipsoids, so that bricks have several levels.
const Built& built() {
  static const Built all = [] {
    SimulateOptions options;
    options.columns = options.rows = 24;
    options.angles = 30;
    options.arc_deg = 360;
    options.cone = ConeSetup{};
    options.cone->source_to_axis = options.cone->source_to_detector = 60;
    Built b;
    b.scan = simulate(shepp_logan(18), options);
    b.result = certify(support::device(), b.scan, Tolerance{.relative = 0.05});
    return b;
  }();
  return all;
}

VerifyResult verified(const MixedVolume& volume, const Certificate& certificate) {
  VerifyOptions options;
  options.exhaustive = true;
  return verify(support::device(), built().scan, volume, certificate, options);
}

bool names(const std::vector<std::string>& differences, const std::string& what) {
  return std::any_of(differences.begin(), differences.end(),
                     [&](const std::string& d) { return d.find(what) != std::string::npos; });
}

}  // namespace

// Two programs of one theorem.
BOOST_AUTO_TEST_CASE(derivatives_are_bounded_as_build_bounds_them) {
  std::mt19937 random(3);
  for (const Case& c : cases())
    for (int tries = 0; tries < 20; ++tries) {
      const ViewMatrix m = testing::cone_of(c.shape).views[at(tries % c.shape.views)];
      ConeBox box;
      for (std::size_t a = 0; a < 3; ++a) {
        box.low[a] = uniform(random, -5, 4);
        box.high[a] = box.low[a] + uniform(random, 0, 2);
      }
      const double value = uniform(random, 0.1, 1);
      const DetectorSups sups{value, uniform(random, 0.1, 12) * value, uniform(random, 0.1, 12) * value};
      for (int x = 0; x <= 6; ++x)
        for (int y = 0; x + y <= 6; ++y)
          for (int z = 0; x + y + z <= 6; ++z) {
            const double own = cone_derivative(m, {x, y, z}, sups.value, sups.second_u, sups.second_v, box,
                                               {1, 1, 1}),
                         theirs = derivative_bound(view_box(m, box.low, box.high), {x, y, z}, sups);
            // Either is widened by some thousand roundings.
            BOOST_TEST(std::abs(own - theirs) <= 0x1p-30 * theirs, c.name << ": " << x << y << z);
          }
    }
}

namespace {

struct Gauge {
  const Case& c;
  const ExactField& exact;
  const Coverage& coverage;
  const Grid& grid;
  SupsByView sups;
};

/// Gold of these rates, made of such nodes, against F: the least and the largest share of the bound that a
/// rate's worst node reaches.
std::pair<double, double> shares(const Gauge& g, const ConeNodeRates& nodes_to_a_cell, int points,
                                 const std::vector<int>& rates, std::int64_t& off_detector) {
  VerifyNodes nodes(support::device().state(), g.exact, g.coverage, g.grid, 1);
  const VerifyNodes::Part part = part_of(g.grid, nodes_to_a_cell, rates.back(), points);
  nodes.make(part);
  std::pair<double, double> found{HUGE_VAL, 0};
  for (const int rate : rates) {
    Vec3 h = g.grid.spacing;
    for (double& x : h) x /= rate;
    ConeBox box;
    for (std::size_t a = 0; a < 3; ++a) {
      const double around =
          (2.0 / rate + static_cast<double>(part.reach()) / (a < 2 ? part.across : part.along)) *
          g.grid.spacing[a];
      box.low[a] = g.grid.origin[a] - around;
      box.high[a] = g.grid.origin[a] + static_cast<double>(g.grid.cells[a]) * g.grid.spacing[a] + around;
    }
    const FieldBounds bounds =
        cone_field_bounds(g.exact.views(), g.sups, box, h,
                          {nodes.path(part, rate), nodes.cone_facts(), g.exact.rounding()}, true);
    const Gold gold = gold_of(support::device().state(), nodes, g.grid, rate);
    const Worst w = compare(g.exact, g.coverage, g.grid, gold, rate, bounds.arithmetic);
    BOOST_TEST_MESSAGE(g.c.name << ", " << part.across << " and " << part.along << " nodes, " << rate
                                << "x: " << 100 * w.share << " % of the bound " << bounds.arithmetic << " of "
                                << w.nodes << " nodes, " << w.off_detector << " off the detector");
    BOOST_TEST(w.share <= tolerance::bound(1.0), g.c.name << ", " << rate << "x");
    BOOST_TEST(w.nodes > 200, g.c.name);
    found = {std::min(found.first, w.share), std::max(found.second, w.share)};
    off_detector += w.off_detector;
  }
  return found;
}

}  // namespace

BOOST_AUTO_TEST_CASE(F_is_within_its_bound_at_every_node) {
  std::int64_t off_detector = 0;
  for (const Case& c : cases()) {
    const ProjectionSet scan = noisy_cone(c.shape);
    const ExactField exact(scan, {});
    const Coverage coverage = certified_coverage(scan, {});
    const Grid grid = grid_of(coverage, c.spacing);
    const Gauge gauge{c, exact, coverage, grid, cone_view_sups(exact, {})};
    const ConeNodeRates rates = cone_node_rates(exact, coverage, grid.spacing);
    // Where nodes of one axis are denser than gold, every second of them serves, or every fourth.
    const int base = rates.across;
    // A bound that nothing comes near would hide a fault. On finer gold it is that of the fastest waves.
    BOOST_TEST(shares(gauge, rates, 12, {base}, off_detector).first > 0.002, c.name);
    BOOST_TEST(shares(gauge, rates, 12, {base, 2 * base}, off_detector).first > 0.0002, c.name);
  }
  BOOST_TEST(off_detector > 50);
}

BOOST_AUTO_TEST_CASE(F_of_sparse_nodes_is_within_its_bound) {
  std::int64_t off_detector = 0, fewer = 0;
  for (Case c : cases()) {
    // Polynomials of many nodes reach far around objects of few pixels, toward sources.
    c.shape.source_to_axis *= 5;
    const ProjectionSet scan = noisy_cone(c.shape);
    const ExactField exact(scan, {});
    const Coverage coverage = certified_coverage(scan, {});
    const Grid grid = grid_of(coverage, c.spacing);
    const Gauge gauge{c, exact, coverage, grid, cone_view_sups(exact, {})};
    const ConeNodeRates dense = cone_node_rates(exact, coverage, grid.spacing),
                        sparse = sparse_node_rates(exact, coverage, grid.spacing);
    BOOST_TEST(sparse.across < dense.across, c.name);
    BOOST_TEST(sparse.along <= dense.along, c.name);
    // Gold whose nodes are the very nodes would show nothing.
    int rate = dense.across / 2;
    while (rate <= 8 && (rate % sparse.across == 0 || rate < sparse.across)) rate *= 2;
    if (rate > 8) continue;
    ++fewer;
    BOOST_TEST(shares(gauge, sparse, sparse_points, {rate}, off_detector).second > 2e-4, c.name);
  }
  BOOST_TEST(fewer > 2);
}

// V and F at all points of a lattice twice as dense as gold: the trilinear V errs most between nodes.
BOOST_AUTO_TEST_CASE(no_point_exceeds_the_bound_of_its_brick) {
  std::vector<Case> all = cases();
  for (const Case& c : cases()) {
    all.push_back(c);
    all.back().made = VerifyField::Made::sparse;
    all.back().shape.source_to_axis *= 5;
  }
  for (const Case& c : all) {
    if (c.shape.rows == 1) continue;  // no cell has a covered height
    const bool sparse = c.made == VerifyField::Made::sparse;
    const ProjectionSet scan = noisy_cone(c.shape, 4);
    const ExactField exact(scan, {});
    const Coverage coverage = certified_coverage(scan, {});
    const MixedVolume volume = volume_of(exact, grid_of(coverage, c.spacing), 8);
    VerifyField field(support::device().state(), exact, volume, {}, {});
    for (const int rate : {sparse ? 4 : 2, 8}) {
      std::vector<double> total(volume.level.size(), -1);
      field.run(
          std::vector<std::uint8_t>(volume.level.size(), 1), std::span(&rate, 1),
          [](std::size_t, int) { return true; },
          [&](const VerifyField::Piece& p) { total[at(p.brick)] = std::max(total[at(p.brick)], p.total); },
          {}, c.made);
      std::mt19937 random(5);
      std::vector<Vec3> points;
      const Grid& g = volume.grid;
      while (points.size() < 1500) {
        Vec3 p{};
        for (std::size_t a = 0; a < 3; ++a) {
          const auto half = static_cast<std::int64_t>(random() % count(g.cells[a] * 2 * rate + 1));
          p[a] = g.origin[a] + static_cast<double>(half) / (2 * rate) * g.spacing[a];
        }
        if (field.covered(p)) points.push_back(p);
      }
      const std::vector<double> F = exact.at(points);
      double worst = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double error = std::abs(static_cast<double>(sample_at(volume, points[i])) - F[i]),
                     bound = total[at(Bricks(g, volume.granularity).number(brick_at(volume, points[i])))];
        worst = std::max(worst, error / bound);
        BOOST_TEST(error <= bound, c.name << ", " << rate << "x: " << error << " for " << bound);
      }
      BOOST_TEST_MESSAGE(c.name << (sparse ? ", sparse, " : ", ") << rate << "x: largest error / bound "
                                << worst);
      if (rate == 8) BOOST_TEST(worst > 0.4, c.name);
    }
  }
}

BOOST_AUTO_TEST_CASE(gold_that_leaves_out_nodes_is_refused) {
  const ProjectionSet scan = noisy_cone(orbit(80));
  const ExactField exact(scan, {});
  const Coverage coverage = certified_coverage(scan, {});
  const Grid grid = grid_of(coverage, 1);
  VerifyNodes nodes(support::device().state(), exact, coverage, grid, 1);
  nodes.make(part_of(grid, {4, 4}, 4));
  (void)gold_of(support::device().state(), nodes, grid, 4);
  BOOST_CHECK_THROW((void)gold_of(support::device().state(), nodes, grid, 2), InputError);
}

// Of a brick by itself only its own nodes are made, and those around.
BOOST_AUTO_TEST_CASE(sparse_nodes_of_a_brick_by_itself_serve_it) {
  const ProjectionSet scan = noisy_cone(orbit(400), 4);
  const ExactField exact(scan, {});
  const Coverage coverage = certified_coverage(scan, {});
  const MixedVolume volume = volume_of(exact, grid_of(coverage, 1), 8);
  VerifyField field(support::device().state(), exact, volume, {}, {});
  const Index3 n = volume.bricks();
  for (const Index3& d : {Index3{0, 0, 0}, Index3{1, 0, 0}, Index3{0, 1, 0}, Index3{0, 0, 1}}) {
    const auto brick = at(((n[2] / 2 - d[2]) * n[1] + n[1] / 2 - d[1]) * n[0] + n[0] / 2 - d[0]);
    std::vector<std::uint8_t> selected(volume.level.size(), 0);
    selected[brick] = 1;
    const std::size_t before = field.seen().size();
    field.look_at({brick}, 200, 3);
    const std::array<int, 2> rates{4, 8};
    field.run(
        selected, rates, [](std::size_t, int) { return true; }, [](const VerifyField::Piece&) {}, {},
        VerifyField::Made::sparse);
    std::vector<Vec3> nodes;
    for (std::size_t i = before; i < field.seen().size(); ++i) nodes.push_back(field.seen()[i].at);
    BOOST_TEST(nodes.size() == 400);
    const std::vector<double> F = exact.at(nodes);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const VerifyField::Node& node = field.seen()[before + i];
      BOOST_TEST(std::abs(node.value - F[i]) <= tolerance::bound(node.arithmetic));
    }
  }
}

BOOST_AUTO_TEST_CASE(a_valid_certificate_holds) {
  const VerifyResult r = verified(built().result.volume, built().result.certificate);
  BOOST_TEST(r.holds, r.failure);
  BOOST_TEST(r.differences.empty());
  BOOST_TEST(r.measured_max <= built().result.certificate.measured_max + r.arithmetic);
  BOOST_TEST(r.field_points > 100);
  BOOST_TEST(r.field_share <= 1);
  BOOST_TEST_MESSAGE("total " << r.total << ", certified " << built().result.certificate.total_buffer);
}

BOOST_AUTO_TEST_CASE(a_damaged_sample_is_found_and_named) {
  MixedVolume damaged = built().result.volume;
  const Grid& g = damaged.grid;
  // Any brick of level 0 that lies well inside: its samples are the base's.
  const Bricks bricks(g, damaged.granularity);
  std::int64_t brick = -1;
  Index3 sample{};
  for (std::int64_t i = 0; i < bricks.size() && brick < 0; ++i) {
    const Index3 p = bricks.position(i);
    for (std::size_t a = 0; a < 3; ++a) sample[a] = p[a] * damaged.granularity + 1;
    const Vec3 at_sample = g.position(sample);
    if (damaged.level[at(i)] == LevelTriple{0, 0, 0} && damaged.coarsening == LevelTriple{0, 0, 0} &&
        std::hypot(at_sample[0], at_sample[1]) < 4 && std::abs(at_sample[2]) < 4)
      brick = i;
  }
  BOOST_REQUIRE(brick >= 0);
  const Index3 n = g.samples();
  const std::size_t place = at((sample[2] * n[1] + sample[1]) * n[0] + sample[0]);
  if (!damaged.base.f32.empty()) damaged.base.f32[place] += 10;
  if (!damaged.base.u16.empty()) damaged.base.u16[place] ^= 0x8000;
  if (!damaged.base.u8.empty()) damaged.base.u8[place] ^= 0x80;
  const VerifyResult r = verified(damaged, built().result.certificate);
  BOOST_TEST(!r.holds);
  BOOST_TEST(r.worst.brick == brick);
  BOOST_TEST(r.worst.dataset == "/base");
  for (std::size_t a = 0; a < 3; ++a) BOOST_TEST(r.worst.sample[a] == sample[a]);
}

BOOST_AUTO_TEST_CASE(certificates_of_other_views_are_refused_by_name) {
  const auto changed = [&](const auto& change) {
    Certificate c = built().result.certificate;
    auto options = nlohmann::ordered_json::parse(c.options_json);
    change(options["geometry"]);
    c.options_json = options.dump();
    VerifyOptions few;
    few.fraction = 0.001;
    return verify(support::device(), built().scan, built().result.volume, c, few);
  };
  const VerifyResult matrix = changed([](auto& g) {
    g["cone"]["matrices"][12 * 3 + 1] = g["cone"]["matrices"][12 * 3 + 1].template get<double>() + 1e-9;
  });
  BOOST_TEST(!matrix.holds);
  BOOST_TEST(names(matrix.differences, "options.geometry.cone.matrices[37] (view 3, row 0, column 1)"));
  const VerifyResult fewer = changed([](auto& g) { g["cone"]["matrices"].erase(0); });
  BOOST_TEST(names(fewer.differences, "the number of matrices"));
  const VerifyResult redundancy = changed([](auto& g) { g["cone"]["redundancy"] = "short-scan"; });
  BOOST_TEST(names(redundancy.differences, "redundancy"));
  const VerifyResult parallel = changed([](auto& g) { g.erase("cone"); });
  BOOST_TEST(names(parallel.differences, "parallel beam, not of cone beam"));
}

// An axis near the detector's edge is half acquisition in parallel beam; of cone beam weights make up for it.
BOOST_AUTO_TEST_CASE(a_detector_far_off_the_axis_verifies) {
  const ProjectionSet scan =
      noisy_cone({.views = 20, .rows = 4, .columns = 24, .source_to_axis = 150, .shift = 7.5});
  BOOST_REQUIRE((scan.cone->redundancy == Redundancy::displaced));
  const BuildResult result = certify(support::device(), scan, Tolerance{.relative = 0.5});
  VerifyOptions options;
  options.exhaustive = true;
  const VerifyResult r = verify(support::device(), scan, result.volume, result.certificate, options);
  BOOST_TEST(r.holds, r.failure);
}

// Cells of verify's reach farther out of a window than build's: what nodes beyond it err is not promised, and
// what those within err is.
BOOST_AUTO_TEST_CASE(nodes_beyond_a_window_are_promised_nothing) {
  CertifyOptions options;
  const auto [low, high] = std::array{0.1, 0.4};
  options.build.window = {low, high};
  const BuildResult windowed = certify(support::device(), built().scan, Tolerance{.relative = 0.08}, options);
  VerifyOptions all;
  all.exhaustive = true;
  const auto again = [&](const Certificate& c) {
    return verify(support::device(), built().scan, windowed.volume, c, all);
  };
  const VerifyResult r = again(windowed.certificate);
  BOOST_TEST(r.holds, r.failure);
  Certificate less = windowed.certificate;
  for (float& total : less.brick_totals)
    if (total > 0) total *= 0.5f;
  const VerifyResult broken = again(less);
  BOOST_TEST(!broken.holds);
  BOOST_TEST(broken.failure.find("of one brick") != std::string::npos, broken.failure);
}

// A certificate that says more than is so: of the terms that build's own code makes again.
BOOST_AUTO_TEST_CASE(edited_terms_are_told) {
  const auto changed = [&](const auto& change) {
    Certificate c = built().result.certificate;
    change(c);
    VerifyOptions few;
    few.fraction = 0.001;
    return verify(support::device(), built().scan, built().result.volume, c, few);
  };
  BOOST_TEST(names(changed([](Certificate& c) { c.budget.projection.value *= 0.9; }).differences,
                   "the projection term"));
  BOOST_TEST(names(changed([](Certificate& c) {
                     const double less = 0.1 * c.budget.arithmetic.value;
                     c.budget.arithmetic.value -= less;
                     c.total_buffer -= less;
                     if (c.total_image3d) *c.total_image3d -= less;
                   }).differences,
                   "the arithmetic term"));
  BOOST_TEST(
      names(changed([](Certificate& c) { c.not_covered_count += 1; }).differences, "not_covered.count"));
  BOOST_TEST(!changed([](Certificate& c) { c.reference_range *= 1.01; }).holds);
  for (const std::size_t which : {0u, 1u})  // a corner, which no view sees
    BOOST_TEST(names(changed([&](Certificate& c) {
                       (*c.range_at)[which] = built().result.volume.grid.origin;
                     }).differences,
                     "range_at: no sample"));
}

// What a view sees beyond the certified cylinder is promised nothing.
BOOST_AUTO_TEST_CASE(points_are_drawn_in_the_certified_cylinder) {
  const ProjectionSet& scan = built().scan;
  const ExactField exact(scan, {});
  const CertifiedRegion region(scan);
  const MixedVolume& volume = built().result.volume;
  const std::vector<std::uint8_t> all(volume.level.size(), 1);
  const FieldPoints points(exact, region, volume, all, 1);
  BOOST_TEST(points.bricks().size() > 4u);
  // Four of them are looked at on interpolated gold too.
  BOOST_TEST(std::count(points.flags().begin(), points.flags().end(), 2) == 4);
  BOOST_TEST(std::count(points.flags().begin(), points.flags().end(), 1) == std::ssize(points.bricks()) - 4);
  VerifyField field(support::device().state(), exact, volume, {}, {});
  field.look_at(points.bricks(), points.nodes_each(), 1);
  field.run(points.flags(), 8, [](const VerifyField::Piece&) {}, {});
  BOOST_TEST(field.seen().size() > 50);
  for (const VerifyField::Node& node : field.seen()) BOOST_TEST(region.contains(node.at));
  BOOST_TEST(FieldPoints::compare(exact, field.seen(), {}).failure.empty());
}
