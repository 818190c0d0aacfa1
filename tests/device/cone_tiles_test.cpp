// Gold of cone beam from kept nodes against F in double precision: orbits, cone angles, lattices, and nodes
// around the covered region.
#define BOOST_TEST_MODULE cone_tiles
#include "host/certify/kept/cone_tiles.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <iterator>
#include <random>
#include <string>

#include "host/base/system/casts.hpp"
#include "host/certify/gold/gold_source.hpp"
#include "host/certify/kept/kept_gold.hpp"
#include "host/field/fbp/back_project.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/scans.hpp"

namespace vdvr {
namespace {

using attacks::Chain;
using attacks::device;
using testing::ConeShape;
using testing::grid_of;
using testing::noisy_cone;

struct Case {
  std::string name;
  ConeShape shape;
  double spacing = 1;
};

ConeShape orbit(double source, std::int64_t rows = 20, std::int64_t columns = 24) {
  ConeShape s;
  s.source_to_axis = source;
  s.rows = rows;
  s.columns = columns;
  return s;
}

std::vector<Case> cases() {
  ConeShape tilted = orbit(70), rolled = orbit(36), displaced = orbit(90), arc = orbit(80);
  rolled.in_plane_deg = 62;
  tilted.in_plane_deg = 1;
  tilted.out_of_plane_deg = 3;
  displaced.shift = 4;
  arc.arc_deg = 230;
  return {{"5 degrees", orbit(137)},
          {"15 degrees", orbit(45)},
          {"30 degrees", orbit(42, 20, 48)},
          {"few rows", orbit(60, 5)},
          {"fan beam", orbit(60, 1)},
          {"tilted", tilted},
          {"rolled by 62 degrees", rolled},
          {"displaced", displaced},
          {"an arc", arc},
          {"cells of .6 pixels", orbit(60), 0.6},
          {"cells of two pixels", orbit(60), 2}};
}

struct Compared {
  std::int64_t nodes = 0, beyond = 0;
  double worst = 0;  // error over bound
};

// Nodes by chance that may be asked for.
Compared compare(const Chain& chain, KeptGold& kept, const Grid& grid, int rate, double reach) {
  const GoldLattice lattice = kept.lattice(grid, rate);
  const GoldErrors e = kept.errors(lattice);
  GoldBox box;
  constexpr std::int64_t around = 2;
  for (std::size_t a = 0; a < 3; ++a) {
    box.first[a] = -around;
    box.nodes[a] = grid.cells[a] * rate + 1 + 2 * around;
  }
  kept.prepare(lattice, {box}, {});
  const std::int64_t stride = column_stride(box.nodes[2]);
  const opencl::DeviceArray<float> out(device().state(), count(box.nodes[0] * box.nodes[1] * stride), "gold");
  kept.fill(lattice, box, out, 0, stride);
  const std::vector<float> gold = out.to_host();
  const Coverage coverage(chain.filtered.geometry, chain.filtered.views);
  std::mt19937 random(5);
  std::vector<Vec3> points;
  std::vector<double> found;
  Compared r;
  for (int tries = 0; tries < 4000 && points.size() < 400; ++tries) {
    Index3 node{};
    Vec3 p{};
    for (std::size_t a = 0; a < 3; ++a) {
      node[a] = static_cast<std::int64_t>(random() % count(box.nodes[a]));
      p[a] = grid.origin[a] + static_cast<double>(node[a] + box.first[a]) / rate * grid.spacing[a];
    }
    const double margin = coverage.margin(p[0], p[1]);
    if (margin < -reach) continue;
    points.push_back(p);
    found.push_back(static_cast<double>(gold[at((node[1] * box.nodes[0] + node[0]) * stride + node[2])]));
    r.beyond += margin < 0 || coverage.margin_z(p[2]) < 0;
  }
  r.nodes = static_cast<std::int64_t>(points.size());
  const double bound = e.interpolation + e.rounding + e.ramp;
  const auto F = chain.exact.at(points);
  for (std::size_t i = 0; i < F.size(); ++i) {
    const double ratio = std::abs(found[i] - F[i]) / (bound + chain.exact.rounding());
    if (!(ratio <= r.worst)) r.worst = std::isnan(ratio) ? double{INFINITY} : ratio;
  }
  BOOST_TEST_MESSAGE("  " << rate << "x of kept " << kept.rates()[0] << ", " << kept.rates()[2] << ": P "
                          << e.interpolation / kept.sup() << " S, rounding " << e.rounding / kept.sup()
                          << " S, ramp " << e.ramp / kept.sup() << " S, curved "
                          << (e.curved_interpolation + e.curved_rounding) / kept.sup() << " S; " << r.nodes
                          << " nodes, " << r.beyond << " beyond, error / bound " << r.worst);
  return r;
}

// One tile of nodes and more heights than a run has, and what they may err.
struct Nodes {
  ConeLattice lattice;
  std::array<double, 2> first{};
  std::vector<float> values;
  double bound = 0;
  bool in_runs = false;
};

// Places of some nodes that are claimed, and what they hold.
void take_claimed(const Nodes& nodes, const Coverage& coverage, std::vector<Vec3>& points,
                  std::vector<double>& found) {
  const Vec3& spacing = nodes.lattice.spacing;
  for (std::int64_t y = 0; y < VDVR_CONE_TILE; y += 2)
    for (std::int64_t x = y % 3; x < VDVR_CONE_TILE - 1; x += 3)
      for (std::int64_t z = y % 4; z < 8 * nodes.lattice.groups; z += 5) {
        const Vec3 p{nodes.first[0] + static_cast<double>(x) * spacing[0],
                     nodes.first[1] + static_cast<double>(y) * spacing[1],
                     static_cast<double>(nodes.lattice.low + z) * spacing[2]};
        if (coverage.margin(p[0], p[1]) < -1.5 || coverage.margin_z(p[2]) < -1.5) continue;
        points.push_back(p);
        found.push_back(
            static_cast<double>(nodes.values[at((y * VDVR_CONE_TILE + x) * nodes.lattice.stride + z)]));
      }
}

Nodes nodes_of(Chain& chain, const Coverage& coverage, const Vec3& spacing, bool strips) {
  Nodes out;
  ConeLattice& l = out.lattice;
  l.spacing = spacing;
  l.claimed = l.reach = 1.5;
  l.claimed_z = {coverage.heights().first - 1.5, coverage.heights().second + 1.5};
  l.groups = 5;
  l.low = -21;
  l.stride = column_stride(8 * l.groups + 16);
  ConeTiles tiles(device().state(), chain.filtered, chain.upsampler, chain.sups, coverage, l);
  if (!strips) tiles.take_no_strips();
  constexpr std::int64_t side = VDVR_CONE_TILE;
  opencl::DeviceArray<float> values(device().state(), count(side * side * l.stride), "nodes");
  values.fill(0.0f);
  out.first = {-0.4 * side * spacing[0], -0.6 * side * spacing[1]};
  ConePage page{&values, {out.first}, {}};
  for (std::int32_t y = 0; y < side; ++y)
    page.wanted.push_back({y % 3, to_int(side) - 1 - y % 2, 0, INT32_MAX});
  tiles.back_project(std::span(&page, 1), {});
  out.values = values.to_host();
  out.in_runs = tiles.in_runs();
  const ConeTiles::Errors e = tiles.errors();
  out.bound = e.interpolation + e.rounding +
              tiles.largest_weight() * filter_error_bound(chain.upsampler, chain.filtered);
  BOOST_TEST_MESSAGE("  in runs " << tiles.in_runs() << ": bound " << out.bound / tiles.sup() << " S");
  return out;
}

BOOST_AUTO_TEST_CASE(kept_nodes_of_either_form_are_within_their_errors_of_the_field) {
  for (const Case& c : cases()) {
    const ProjectionSet scan = noisy_cone(c.shape);
    Chain chain(scan);
    const Coverage coverage(chain.filtered.geometry, chain.filtered.views);
    for (const Vec3& spacing : {Vec3{0.5, 0.5, 0.5}, Vec3{0.3, 0.35, 0.11}}) {
      std::vector<double> in_strips;
      for (const bool strips : {true, false}) {
        const Nodes nodes = nodes_of(chain, coverage, spacing, strips);
        std::vector<Vec3> points;
        std::vector<double> found;
        take_claimed(nodes, coverage, points, found);
        BOOST_TEST(points.size() > 50, c.name);
        double worst = 0;
        const auto F = chain.exact.at(points);
        for (std::size_t i = 0; i < F.size(); ++i) worst = std::max(worst, std::abs(found[i] - F[i]));
        BOOST_TEST(worst <= nodes.bound + chain.exact.rounding(),
                   c.name << ", strips " << strips << ": error " << worst << ", bound " << nodes.bound);
        BOOST_TEST_MESSAGE(c.name << ", " << points.size() << " nodes: error / bound "
                                  << worst / nodes.bound);
        // Devices must agree to the bit.
        if (strips) in_strips = found;
        else BOOST_TEST((found == in_strips), c.name);
      }
    }
  }
}

// A run of heights that reads more rows than a strip holds.
BOOST_AUTO_TEST_CASE(nodes_too_far_apart_for_strips_go_without) {
  const ProjectionSet scan = noisy_cone(orbit(400, 140));
  Chain chain(scan);
  const Coverage coverage(chain.filtered.geometry, chain.filtered.views);
  const Nodes nodes = nodes_of(chain, coverage, {0.5, 0.5, 3.3}, true);
  BOOST_TEST(!nodes.in_runs);
  std::vector<Vec3> points;
  std::vector<double> found;
  take_claimed(nodes, coverage, points, found);
  BOOST_REQUIRE(points.size() > 500);
  const auto F = chain.exact.at(points);
  for (std::size_t i = 0; i < F.size(); ++i)
    BOOST_TEST(std::abs(found[i] - F[i]) <= nodes.bound + chain.exact.rounding());
}

BOOST_AUTO_TEST_CASE(gold_of_cone_beam_is_within_its_errors_of_the_field) {
  std::int64_t beyond = 0;
  double closest = 0;
  for (const Case& c : cases()) {
    const ProjectionSet scan = noisy_cone(c.shape);
    const Chain chain(scan);
    const Grid grid = grid_of(Coverage(chain.filtered.geometry, chain.filtered.views), c.spacing);
    constexpr double reach = 1.5;
    KeptGold kept(device().state(), chain.filtered, chain.sups, grid, reach, 8, Interpolation::six_taps);
    BOOST_TEST_MESSAGE(c.name << ": S " << kept.sup() << ", at the axis' lengths " << chain.sups.value);
    for (const int rate : {1, 2, 4, 8}) {
      const Compared r = compare(chain, kept, grid, rate, reach);
      BOOST_TEST(r.nodes > 100, c.name);
      BOOST_TEST(r.worst <= 1, c.name << ", " << rate << "x: error / bound " << r.worst);
      beyond += r.beyond;
      closest = std::max(closest, r.worst);
    }
  }
  BOOST_TEST(beyond > 500);
  BOOST_TEST_MESSAGE("closest " << closest);
}

// For some places: what boxes read, again and again from tiles that hold some of it, is what whole tiles
// hold.
BOOST_AUTO_TEST_CASE(nodes_made_for_some_boxes_are_those_of_whole_tiles) {
  for (const bool tilted : {false, true}) {
    ConeShape shape = orbit(60, 40, 48);
    if (tilted) shape.out_of_plane_deg = 3;
    const ProjectionSet scan = noisy_cone(shape, 11);
    const Chain chain(scan);
    const Grid grid = grid_of(Coverage(chain.filtered.geometry, chain.filtered.views), 1);
    KeptGold whole(device().state(), chain.filtered, chain.sups, grid, 2, 8, Interpolation::six_taps),
        sparing(device().state(), chain.filtered, chain.sups, grid, 2, 8, Interpolation::six_taps);
    sparing.make_only_what_is_read();
    const GoldLattice fine = whole.lattice(grid, 4), coarse = whole.lattice(grid, 2);
    const auto is_alike = [&](const GoldLattice& lattice, const GoldBox& box) {
      const std::int64_t stride = column_stride(box.nodes[2]);
      std::array<std::vector<float>, 2> found;
      for (std::size_t i = 0; i < 2; ++i) {
        KeptGold& kept = i == 0 ? whole : sparing;
        kept.prepare(lattice, {box}, {});
        const opencl::DeviceArray<float> out(device().state(), count(box.nodes[0] * box.nodes[1] * stride),
                                             "gold");
        kept.fill(lattice, box, out, 0, stride);
        const std::vector<float> all = out.to_host();
        for (std::int64_t column = 0; column < box.nodes[0] * box.nodes[1]; ++column)
          std::copy_n(all.begin() + column * stride, box.nodes[2], std::back_inserter(found[i]));
      }
      return found[0] == found[1] && *std::ranges::max_element(found[0]) > 0;
    };
    const std::int64_t middle = 4 * grid.cells[0] / 2, high = 4 * grid.cells[2] / 2;
    const GoldBox first{{middle, middle, high}, {17, 9, 17}}, above{{middle, middle, high + 40}, {17, 9, 17}},
        beside{{middle - 20, middle + 3, high - 30}, {30, 20, 9}},
        of_coarse{{middle / 2 - 30, middle / 2 - 9, high / 2 - 7}, {9, 9, 20}};
    sparing.will_read(coarse, {of_coarse});
    BOOST_TEST(is_alike(fine, first));
    double seconds = sparing.prepare_seconds();
    BOOST_TEST(is_alike(coarse, of_coarse));
    BOOST_TEST(is_alike(fine, first));
    BOOST_TEST(sparing.prepare_seconds() == seconds);  // it was all there
    BOOST_TEST(is_alike(fine, above));
    BOOST_TEST(is_alike(fine, beside));
    BOOST_TEST(sparing.prepare_seconds() > seconds);
    seconds = sparing.prepare_seconds();
    for (const GoldBox& box : {first, above, beside}) BOOST_TEST(is_alike(fine, box));
    BOOST_TEST(is_alike(coarse, of_coarse));
    BOOST_TEST(sparing.prepare_seconds() == seconds);
  }
}

// Crews end what they prepare when others have done the work, and go on with the next pass.
BOOST_AUTO_TEST_CASE(nodes_whose_making_was_ended_are_made_again) {
  struct Ended {};
  ConeShape shape = orbit(60, 20, 24);
  shape.views = 40;
  for (const bool cone : {true, false})
    for (const bool sparing : {false, true}) {
      const ProjectionSet scan = cone ? noisy_cone(shape, 5) : testing::noise_scan(40, 40, 24, 5);
      const Chain chain(scan);
      const Grid grid = cone ? grid_of(Coverage(chain.filtered.geometry, chain.filtered.views), 1) : [&] {
        Grid g;
        g.cells = {8, 8, 8};
        g.spacing = {1, 1, 1};
        g.origin = {-4, -4, -4};
        return g;
      }();
      std::array<std::vector<float>, 2> found;
      for (const bool ended : {false, true}) {
        KeptGold kept(device().state(), chain.filtered, chain.sups, grid, 2, 8, Interpolation::six_taps);
        if (sparing) kept.make_only_what_is_read();
        const GoldLattice lattice = kept.lattice(grid, 4);
        const GoldBox box{{4, 5, 6}, {17, 9, 17}};
        bool was_ended = false;
        if (ended) try {
            kept.prepare(lattice, {box}, [](const std::string&, double) { throw Ended(); });
          } catch (const Ended&) {
            was_ended = true;
          }
        BOOST_TEST(was_ended == ended);
        kept.prepare(lattice, {box}, {});
        const std::int64_t stride = column_stride(box.nodes[2]);
        const opencl::DeviceArray<float> out(device().state(), count(box.nodes[0] * box.nodes[1] * stride),
                                             "gold");
        kept.fill(lattice, box, out, 0, stride);
        const std::vector<float> all = out.to_host();
        for (std::int64_t column = 0; column < box.nodes[0] * box.nodes[1]; ++column)
          std::copy_n(all.begin() + column * stride, box.nodes[2], std::back_inserter(found[ended ? 1 : 0]));
      }
      BOOST_TEST((found[0] == found[1]), (cone ? "cone" : "parallel") << (sparing ? ", sparing" : ""));
      BOOST_TEST(*std::ranges::max_element(found[0]) > 0);
    }
}

// All of a crew sum up as many views at once, whatever memory each has left: the same nodes.
BOOST_AUTO_TEST_CASE(views_are_summed_up_as_another_device_does) {
  ConeShape shape = orbit(60, 20, 24);
  shape.views = 37;
  const ProjectionSet scan = noisy_cone(shape, 5);
  const Chain chain(scan);
  const Grid grid = grid_of(Coverage(chain.filtered.geometry, chain.filtered.views), 1);
  constexpr std::uint64_t little = std::uint64_t{9} << 20;
  const auto made = [&](Device& on, std::int64_t together) {
    GoldSettings settings = gold_settings(grid, 4, Rates{8, Interpolation::eight_taps, 4});
    settings.views_together = together;
    settings.base_only = true;
    GoldSource source(on.state(), chain.filtered, chain.sups, settings);
    KeptGold& kept = source.kept;
    const GoldLattice lattice = kept.lattice(grid, 2);
    const GoldBox box{{4, 5, 6}, {17, 9, 17}};
    kept.prepare(lattice, {box}, {});
    const std::int64_t stride = column_stride(box.nodes[2]);
    opencl::DeviceArray<float> out(on.state(), count(box.nodes[0] * box.nodes[1] * stride), "gold");
    out.fill(0.0f);
    kept.fill(lattice, box, out, 0, stride);
    return std::pair{kept.views_together(), out.to_host()};
  };
  Device own("", little);
  const auto [fit, by_little] = made(own, 0);
  BOOST_TEST(fit < ConeTiles::most_views);
  const auto [most, by_much] = made(device(), 0);
  BOOST_TEST(most == ConeTiles::most_views);
  BOOST_TEST((by_much != by_little));
  const auto [alike, as_little] = made(device(), fit);
  BOOST_TEST(alike == fit);
  BOOST_TEST((as_little == by_little));
}

}  // namespace
}  // namespace vdvr
