// What T leaves out, by brick, against derivatives of the field from its cosine series.
#define BOOST_TEST_MODULE brick_remainder
#include "host/kept/brick_remainder.hpp"

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <random>
#include <string>

#include "host/gold/gold_source.hpp"
#include "host/volume/bricks.hpp"
#include "tests/reference/field_derivatives.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/attack_scans.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"

namespace vdvr {
namespace {

using attacks::device;

constexpr std::array<std::array<int, 3>, 6> fourth{
    {{4, 0, 0}, {0, 4, 0}, {0, 0, 4}, {2, 2, 0}, {2, 0, 2}, {0, 2, 2}}};  // xx, yy, zz, xy, xz, yz
constexpr std::array names{"xxxx", "yyyy", "zzzz", "xxyy", "xxzz", "yyzz"};

GoldSettings settings_of(const Grid& grid, int granularity) {
  return {grid, granularity, 4, 8, Interpolation::six_taps};
}

// The six bounds of h_i^2 h_j^2 |F_iijj|, h the spacings of the grid: axes that shall not show get a spacing
// of next to nothing.
std::array<double, 6> bounds_of(const BrickRemainder& remainder, const KeptGold& kept, std::int64_t brick) {
  constexpr int nothing = 1 << 24;
  const auto of = [&](bool x, bool y, bool z) {
    GoldLattice lattice;
    const std::array shown{x, y, z};
    // As coarse as the grid.
    for (std::size_t a = 0; a < 3; ++a) {
      lattice.step[a] = shown[a] ? static_cast<int>(kept.rates()[a]) : 1;
      lattice.phases[a] = shown[a] ? 1 : nothing;
    }
    return static_cast<double>(remainder.of(brick, lattice));
  };
  const double xx = of(true, false, false), yy = of(false, true, false), zz = of(false, false, true);
  std::array<double, 6> out{xx,
                            yy,
                            zz,
                            of(true, true, false) - xx - yy,
                            of(true, false, true) - xx - zz,
                            of(false, true, true) - yy - zz};
  for (std::size_t d = 0; d < 6; ++d) out[d] /= 0.125 * (d < 3 ? 5.0 / 24 : 2.0 / 8);
  return out;
}

struct Ratios {
  std::array<double, 6> least, most;
  Ratios() {
    least.fill(INFINITY);
    most.fill(0);
  }
};

// Bound over truth, least and most over the bricks of a grid, at many points of each and one step of gold at
// 2x around it.
Ratios ratios_of(const ProjectionSet& scan, const Grid& grid, int granularity, int points) {
  attacks::Chain chain(scan);
  const GoldSettings settings = settings_of(grid, granularity);
  GoldSource source(device().state(), chain.filtered, chain.sups, settings);
  const Bricks bricks(grid, granularity);
  source.remainder->require(std::vector<std::uint8_t>(static_cast<std::size_t>(bricks.size()), 1), {});
  const reference::FieldDerivatives exact(chain.filtered.geometry, chain.filtered.samples);
  const Coverage coverage(chain.filtered.geometry);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  Ratios out;
  for (std::int64_t brick = 0; brick < bricks.size(); ++brick) {
    const std::array<double, 6> bound = bounds_of(*source.remainder, source.kept, brick);
    const Index3 at = bricks.position(brick);
    std::array<double, 6> truth{};
    bool tested = false;
    for (int i = 0; i < points; ++i) {
      // A point of a cell that meets the covered region, then up to a step of gold beyond it.
      Vec3 p{}, step{};
      for (std::size_t a = 0; a < 3; ++a) {
        const double first = static_cast<double>(at[a] * granularity);
        p[a] = grid.origin[a] + grid.spacing[a] * (first + unit(random) * granularity);
        step[a] = i % 3 == 0 ? 0.0 : (i % 3 == 1 ? std::round(unit(random)) : unit(random)) - 0.5;
      }
      if (coverage.margin(p[0], p[1]) < -std::hypot(grid.spacing[0], grid.spacing[1])) continue;
      tested = true;
      for (std::size_t a = 0; a < 3; ++a) p[a] += step[a] * grid.spacing[a];
      const std::array<double, 6> d = exact.at(p, fourth);
      for (std::size_t k = 0; k < 6; ++k) {
        double h = 1;
        for (std::size_t a = 0; a < 3; ++a) h *= std::pow(grid.spacing[a], fourth[k][a]);
        truth[k] = std::max(truth[k], std::abs(d[k]) * h);
      }
    }
    if (!tested) continue;
    for (std::size_t k = 0; k < 6; ++k) {
      if (scan.geometry.rows == 1 && fourth[k][2] > 0) continue;  // does not vary along z
      // The difference of three roundings up of sums.
      const double rounding = 4 * tolerance::unit_roundoff * (bound[0] + bound[1] + bound[2]);
      out.least[k] = std::min(out.least[k], (bound[k] + rounding) / truth[k]);
      out.most[k] = std::max(out.most[k], bound[k] / truth[k]);
    }
  }
  return out;
}

Grid grid_in(const Index3& cells, const Vec3& spacing, const Vec3& origin) {
  Grid grid;
  grid.cells = cells;
  grid.spacing = spacing;
  grid.origin = origin;
  return grid;
}

struct Case {
  std::string name;
  ProjectionSet scan;
  Grid grid;
  int granularity = 4;
  double most = 15;  // bound over truth, of fields as rough as their pixels allow
};

std::vector<Case> cases() {
  ProjectionSet oblong = testing::noise_scan(13, 6, 25, 7);
  oblong.geometry.pitch_u = 0.7;
  oblong.geometry.pitch_v = 1.3;
  oblong.geometry.center = 10.8;
  const ProjectionSet noise = testing::noise_scan(15, 9, 33, 1);
  return {
      {"spacing of a pixel", noise, grid_in({8, 8, 8}, {1, 1, 1}, {-3.7, -4.1, -4})},
      {"spacing of 1 / sqrt 2", noise, grid_in({8, 8, 8}, {0.7071, 0.7071, 0.7071}, {-2, -3, -2.5})},
      {"at the rim", noise, grid_in({8, 8, 4}, {1, 1, 1}, {7, 6.5, -2})},
      {"beyond the first and last row", noise, grid_in({4, 4, 12}, {1, 1, 1}, {-2, -2, -6})},
      {"bricks smaller than a stencil", noise, grid_in({4, 4, 4}, {0.3, 0.3, 0.3}, {-2, -2, -0.5}), 1},
      {"bricks of two cells", noise, grid_in({6, 4, 4}, {1, 1, 1}, {-2, -2, -2}), 2},
      {"spacing of two pixels", noise, grid_in({8, 8, 4}, {2, 2, 2}, {-8, -8, -4})},
      {"oblong pixels and cells", oblong, grid_in({8, 8, 6}, {0.5, 0.8, 1.1}, {-2, -3, -3})},
      {"one row", testing::noise_scan(21, 1, 25, 3), grid_in({8, 8, 1}, {1, 1, 1}, {-3, -4, -0.5}), 2},
      {"two rows", testing::noise_scan(15, 2, 25, 3), grid_in({8, 8, 2}, {1, 1, 1}, {-3, -4, -1}), 2},
  };
}

BOOST_AUTO_TEST_CASE(no_fourth_derivative_exceeds_its_bound_and_bounds_of_rough_fields_are_not_idle) {
  for (const Case& c : cases()) {
    const Ratios r = ratios_of(c.scan, c.grid, c.granularity, 1200);
    for (std::size_t k = 0; k < 6; ++k) {
      if (r.most[k] == 0) continue;
      BOOST_TEST_MESSAGE(c.name << ", " << names[k] << ": bound / truth " << r.least[k] << " .. "
                                << r.most[k]);
      BOOST_TEST(r.least[k] >= 1, c.name << ", " << names[k] << ": " << r.least[k]);
      BOOST_TEST(r.least[k] <= c.most, c.name << ", " << names[k] << ": " << r.least[k]);
    }
  }
}

// All waves of one view in phase at a point, where one derivative is as large as the sups allow.
BOOST_AUTO_TEST_CASE(peaks_between_nodes_do_not_exceed_their_bounds) {
  for (const double sign : {1.0, -1.0})
    for (const std::size_t low : {1u, 12u, 20u}) {
      const attacks::Scan scan = attacks::axis_peak(8, low, sign, false);
      for (const double shift : {0.0, 0.25, 0.13}) {
        const Grid grid = grid_in({8, 8, 4}, {1, 1, 1}, {-4 + shift, -4 - shift, scan.target[2] - 2 + shift});
        const Ratios r = ratios_of(scan.data, grid, 4, 300);
        for (std::size_t k = 0; k < 6; ++k)
          BOOST_TEST(r.least[k] >= 1, scan.name << ", " << names[k] << ": " << r.least[k]);
      }
    }
}

BOOST_AUTO_TEST_CASE(bounds_go_with_the_powers_of_the_spacings) {
  const ProjectionSet noise = testing::noise_scan(15, 9, 33, 1);
  attacks::Chain chain(noise);
  const Grid grid = grid_in({4, 4, 4}, {1, 1, 1}, {-2, -2, -2});
  GoldSource source(device().state(), chain.filtered, chain.sups, settings_of(grid, 4));
  source.remainder->require({1}, {});
  double before = 0;
  for (const int rate : {2, 4, 8, 16}) {
    const auto here = static_cast<double>(source.remainder->of(0, source.kept.lattice(grid, rate)));
    BOOST_TEST(here > 0);
    // Rounded up to fp32.
    if (before > 0) BOOST_TEST(std::abs(here / before * 16 - 1) <= 4 * tolerance::unit_roundoff);
    before = here;
  }
}

// However bricks are asked for, and however many: what is said of one does not change.
BOOST_AUTO_TEST_CASE(a_brick_asked_for_alone_has_the_bound_that_it_has_among_all) {
  const ProjectionSet noise = testing::noise_scan(15, 9, 33, 1);
  attacks::Chain chain(noise);
  const Grid grid = grid_in({20, 12, 8}, {1, 1, 1}, {-4, -6, -4});
  const GoldSettings settings = settings_of(grid, 2);
  const Bricks bricks(grid, 2);
  GoldSource all(device().state(), chain.filtered, chain.sups, settings);
  all.remainder->require(std::vector<std::uint8_t>(static_cast<std::size_t>(bricks.size()), 1), {});
  for (std::int64_t brick = 0; brick < bricks.size(); brick += 37) {
    GoldSource one(device().state(), chain.filtered, chain.sups, settings);
    std::vector<std::uint8_t> selected(static_cast<std::size_t>(bricks.size()), 0);
    selected[static_cast<std::size_t>(brick)] = 1;
    one.remainder->require(selected, {});
    const GoldLattice lattice = one.kept.lattice(grid, 4);
    BOOST_TEST(one.remainder->of(brick, lattice) == all.remainder->of(brick, lattice));
  }
}

BOOST_AUTO_TEST_CASE(differences_of_no_number_make_no_bound) {
  ProjectionSet noise = testing::noise_scan(9, 5, 17, 2);
  attacks::Chain chain(noise);
  chain.filtered.samples[chain.filtered.samples.size() / 2] = std::numeric_limits<float>::quiet_NaN();
  const Grid grid = grid_in({4, 4, 4}, {1, 1, 1}, {-2, -2, -2});
  GoldSource source(device().state(), chain.filtered, chain.sups, settings_of(grid, 4));
  source.remainder->require({1}, {});
  BOOST_TEST(std::isinf(source.remainder->of(0, source.kept.lattice(grid, 4))));
}

}  // namespace
}  // namespace vdvr
