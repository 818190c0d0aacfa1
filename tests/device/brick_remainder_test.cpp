// What T leaves out, by brick, against derivatives of the field from its cosine series.
#define BOOST_TEST_MODULE brick_remainder
#include "host/certify/kept/brick_remainder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <string>

#include "host/certify/gold/gold_source.hpp"
#include "host/volume/bricks.hpp"
#include "tests/reference/field_derivatives.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/attack_scans.hpp"
#include "tests/support/cone_attacks.hpp"
#include "tests/support/cone_scans.hpp"
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
GoldSettings cone_settings_of(const Grid& grid, int differences) {
  return gold_settings(grid, 1, {6, Interpolation::eight_taps, 4, differences});
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

// --- cone beam ---

struct ConeCase {
  std::string name;
  testing::ConeShape shape;
  double spacing = 1;
};

std::vector<ConeCase> cone_cases() {
  const auto orbit = [](double source, std::int64_t rows, std::int64_t columns) {
    testing::ConeShape s;
    s.source_to_axis = source;
    s.rows = rows;
    s.columns = columns;
    return s;
  };
  testing::ConeShape tilted = orbit(70, 14, 24), displaced = orbit(120, 14, 24), arc = orbit(80, 14, 24);
  tilted.in_plane_deg = 1;
  tilted.out_of_plane_deg = 3;
  displaced.shift = 4;
  arc.arc_deg = 230;
  return {{"5 degrees", orbit(137, 14, 24)},
          {"15 degrees", orbit(45, 14, 24)},
          {"30 degrees", orbit(42, 14, 48)},
          {"few rows", orbit(60, 4, 24)},
          {"fan beam", orbit(60, 1, 24)},
          {"tilted", tilted},
          {"displaced", displaced},
          {"an arc", arc},
          {"cells of .4 pixels", orbit(60, 14, 24), 0.4},
          {"cells of .6 pixels", orbit(60, 14, 24), 0.6},
          {"cells of two pixels", orbit(60, 14, 24), 2}};
}

// Whether a base cell holds a point of the covered region.
bool meets(const Coverage& coverage, const Grid& grid, const Index3& cell) {
  const auto [low, high] = coverage.heights();
  const Vec3 middle{0, 0, 0.5 * (low + high)};
  Vec3 p{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double first = grid.origin[a] + static_cast<double>(cell[a]) * grid.spacing[a];
    p[a] = std::clamp(middle[a], first, first + grid.spacing[a]);
  }
  return coverage.margin(p[0], p[1]) >= 0 && coverage.margin_z(p[2]) >= 0;
}

// Differences of F around some places, h the step: over h^4 each is a mean of the derivative, so no larger
// than it is somewhere within two steps.
class Differences {
 public:
  explicit Differences(double share) : share_(share) {}
  void add(const Vec3& p, const Vec3& spacing) {
    for (const auto& offset : offsets()) {
      Vec3 at = p;
      for (std::size_t a = 0; a < 3; ++a) at[a] += offset[a] * share_ * spacing[a];
      points_.push_back(at);
    }
  }
  [[nodiscard]] std::span<const Vec3> points() const { return points_; }
  // spacing^4 times the derivatives at place n.
  [[nodiscard]] std::array<double, 6> of(const std::vector<double>& F, std::size_t n) const {
    const double* f = F.data() + n * offsets().size();
    std::array<double, 6> out{};
    for (std::size_t a = 0; a < 3; ++a)
      out[a] =
          (6 * f[0] - 4 * (f[1 + 4 * a] + f[2 + 4 * a]) + f[3 + 4 * a] + f[4 + 4 * a]) / std::pow(share_, 4);
    constexpr std::array<std::array<std::size_t, 2>, 3> pairs{{{0, 1}, {0, 2}, {1, 2}}};
    for (std::size_t d = 0; d < 3; ++d) {
      const auto& [i, j] = pairs[d];
      const double* corner = f + 13 + 4 * d;
      const double sides = f[1 + 4 * i] + f[2 + 4 * i] + f[1 + 4 * j] + f[2 + 4 * j];
      out[3 + d] =
          (corner[0] + corner[1] + corner[2] + corner[3] - 2 * sides + 4 * f[0]) / std::pow(share_, 4);
    }
    for (double& x : out) x = std::abs(x);
    return out;
  }
  // What an error of F adds to any.
  [[nodiscard]] double rounding(double of_field) const { return 16 * of_field / std::pow(share_, 4); }

 private:
  // The middle; one and two steps along each axis; corners in the planes xy, xz, yz.
  static const std::vector<Vec3>& offsets() {
    static const std::vector<Vec3> all = [] {
      std::vector<Vec3> out{{0, 0, 0}};
      for (std::size_t a = 0; a < 3; ++a)
        for (const double step : {-1.0, 1.0, -2.0, 2.0}) {
          out.push_back({0, 0, 0});
          out.back()[a] = step;
        }
      for (const auto& [i, j] : std::array<std::array<std::size_t, 2>, 3>{{{0, 1}, {0, 2}, {1, 2}}})
        for (int corner = 0; corner < 4; ++corner) {
          out.push_back({0, 0, 0});
          out.back()[i] = corner & 1 ? 1 : -1;
          out.back()[j] = corner & 2 ? 1 : -1;
        }
      return out;
    }();
    return all;
  }
  double share_;
  std::vector<Vec3> points_;
};

// Bound over truth by brick of one cell, in cells that meet the covered region and half a cell around them.
Ratios cone_ratios_of(const ProjectionSet& scan, const Grid& grid, int nodes_a_pixel, int points) {
  attacks::Chain chain(scan);
  GoldSource source(device().state(), chain.filtered, chain.sups, cone_settings_of(grid, nodes_a_pixel));
  const Bricks bricks(grid, 1);
  source.remainder->require(std::vector<std::uint8_t>(static_cast<std::size_t>(bricks.size()), 1), {});
  const Coverage coverage(chain.filtered.geometry, chain.filtered.views);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  constexpr double share = 0.1;
  Ratios out;
  for (std::int64_t brick = 0; brick < bricks.size(); ++brick) {
    const Index3 cell = bricks.position(brick);
    if (!meets(coverage, grid, cell)) continue;
    Differences differences(share);
    double lambda = 1;
    for (int i = 0; i < points; ++i) {
      Vec3 p{};
      for (std::size_t a = 0; a < 3; ++a) {
        // Up to where two steps more leave half a cell around.
        const double around = i % 3 == 0 ? 0.0 : 0.5 - 2 * share;
        p[a] = grid.origin[a] +
               grid.spacing[a] * (static_cast<double>(cell[a]) - around + unit(random) * (1 + 2 * around));
      }
      differences.add(p, grid.spacing);
    }
    for (const Vec3& p : differences.points())
      for (const ViewMatrix& m : chain.exact.views()) lambda = std::min(lambda, projected(m, p)[2]);
    const double rounding = differences.rounding(chain.exact.rounding() / (lambda * lambda));
    const auto F = chain.exact.at(differences.points());
    std::array<double, 6> truth{};
    for (int i = 0; i < points; ++i) {
      const std::array<double, 6> d = differences.of(F, static_cast<std::size_t>(i));
      for (std::size_t k = 0; k < 6; ++k) truth[k] = std::max(truth[k], d[k]);
    }
    const std::array<double, 6> bound = bounds_of(*source.remainder, source.kept, brick);
    for (std::size_t k = 0; k < 6; ++k) {
      if (scan.geometry.rows == 1 && fourth[k][2] > 0) continue;  // does not vary along z but for lambda
      // The difference of three roundings up of sums.
      const double more = rounding + 4 * tolerance::unit_roundoff * (bound[0] + bound[1] + bound[2]);
      out.least[k] = std::min(out.least[k], (bound[k] + more) / truth[k]);
      out.most[k] = std::max(out.most[k], bound[k] / truth[k]);
    }
  }
  return out;
}

// Around the axis, or across the region's rim at its top.
Grid cone_grid(const Coverage& coverage, double spacing, bool at_rim) {
  const auto [low, high] = coverage.heights();
  Grid grid;
  grid.cells = {2, 2, 2};
  grid.spacing = {spacing, spacing, spacing};
  const double r = at_rim ? coverage.inner_radius() * std::numbers::sqrt2 / 2 : 0.0;
  grid.origin = {r - spacing, r - 0.9 * spacing, (at_rim ? high : 0.5 * (low + high)) - 0.8 * spacing};
  return grid;
}

struct ConeField {
  std::string name;
  ProjectionSet scan;
  Grid grid;
};

// At the rim noise; about the axis each view's fourth derivative is as large as samples of 1 and -1 make it.
ConeField cone_field(const ConeCase& c, bool at_rim) {
  ConeField out{c.name + (at_rim ? ", rim, noise" : ", axis, extremal"), testing::noisy_cone(c.shape), {}};
  out.grid = cone_grid(certified_coverage(out.scan, {}), c.spacing, at_rim);
  if (at_rim) return out;
  Vec3 target{};
  for (std::size_t a = 0; a < 3; ++a) target[a] = out.grid.origin[a] + 0.6 * out.grid.spacing[a];
  attacks::FilteredViews q;
  for (const ViewMatrix& m : out.scan.cone->views)
    q.push_back(attacks::extremal_view(static_cast<std::size_t>(c.shape.rows),
                                       static_cast<std::size_t>(c.shape.columns), projected(m, target), 4,
                                       4));
  attacks::take_views(out.scan, q);
  return out;
}

BOOST_AUTO_TEST_CASE(no_fourth_derivative_of_cone_beam_exceeds_its_bound) {
  for (const int differences : {dense_differences, sparse_differences}) {
    double closest = INFINITY;
    for (const ConeCase& c : cone_cases())
      for (const bool at_rim : {false, true}) {
        const ConeField field = cone_field(c, at_rim);
        const Ratios r = cone_ratios_of(field.scan, field.grid, differences, 60);
        for (std::size_t k = 0; k < 6; ++k) {
          if (r.most[k] == 0) continue;
          const std::string name = fmt::format("{}x, {}, {}", differences, field.name, names[k]);
          BOOST_TEST_MESSAGE(name << ": bound / truth " << r.least[k] << " .. " << r.most[k]);
          BOOST_TEST(r.least[k] >= 1, name << ": " << r.least[k]);
          closest = std::min(closest, r.least[k]);
        }
      }
    BOOST_TEST_MESSAGE(differences << "x: closest " << closest);
    BOOST_TEST(closest <= 2);
  }
}

// What plans go by: four times as much at twice the spacing, a sixteenth for gold twice as fine.
BOOST_AUTO_TEST_CASE(what_sixth_derivatives_add_goes_with_the_spacings_of_nodes_and_gold) {
  for (const ConeCase& c : cone_cases()) {
    const ConeField field = cone_field(c, true);
    attacks::Chain chain(field.scan);
    GoldSource dense(device().state(), chain.filtered, chain.sups,
                     cone_settings_of(field.grid, dense_differences)),
        sparse(device().state(), chain.filtered, chain.sups,
               cone_settings_of(field.grid, sparse_differences));
    const auto sixth = [&](GoldSource& source, int rate) {
      return source.remainder->largest_of_sixth(source.kept.lattice(field.grid, rate));
    };
    const double of_dense = sixth(dense, 8), of_sparse = sixth(sparse, 8);
    BOOST_TEST_MESSAGE(field.name << ": " << of_dense << ", " << of_sparse);
    BOOST_TEST(of_dense > 0);
    // Axes of one kept node a cell keep the density; the stencils of sparse nodes reach farther.
    const Index3& kept = dense.kept.rates();
    const bool some = std::ranges::find(kept, 1) != kept.end();
    BOOST_TEST(of_sparse >= (some ? 1 : 4) * of_dense * (1 - 8 * tolerance::unit_roundoff));
    BOOST_TEST(of_sparse <= 6 * of_dense * (1 + 8 * tolerance::unit_roundoff));
    BOOST_TEST(std::abs(16 * sixth(dense, 16) / of_dense - 1) <= 8 * tolerance::unit_roundoff);
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
  const Grid grid =
      grid_in({52, 20, 20}, {0.6, 0.6, 0.4}, {-15, -6, -4});  // sixteen blocks: more than go together
  const GoldSettings settings = settings_of(grid, 2);
  const Bricks bricks(grid, 2);
  GoldSource all(device().state(), chain.filtered, chain.sups, settings);
  all.remainder->require(std::vector<std::uint8_t>(static_cast<std::size_t>(bricks.size()), 1), {});
  for (std::int64_t brick = 0; brick < bricks.size(); brick += 197) {
    GoldSource one(device().state(), chain.filtered, chain.sups, settings);
    std::vector<std::uint8_t> selected(static_cast<std::size_t>(bricks.size()), 0);
    selected[static_cast<std::size_t>(brick)] = 1;
    one.remainder->require(selected, {});
    const GoldLattice lattice = one.kept.lattice(grid, 4);
    BOOST_TEST(one.remainder->of(brick, lattice) == all.remainder->of(brick, lattice));
  }
}

// What one process knows it tells another, which then looks at the rest alone.
BOOST_AUTO_TEST_CASE(what_is_known_of_a_part_of_a_block_can_be_told) {
  const ProjectionSet noise = testing::noise_scan(15, 9, 33, 1);
  attacks::Chain chain(noise);
  const Grid grid = grid_in({20, 20, 20}, {1, 1, 1}, {-10, -10, -10});
  const GoldSettings settings = settings_of(grid, 2);
  const Bricks bricks(grid, 2);
  const auto among = [&](std::int64_t step) {
    std::vector<std::uint8_t> selected(static_cast<std::size_t>(bricks.size()), 0);
    for (std::int64_t i = 0; i < bricks.size(); i += step) selected[static_cast<std::size_t>(i)] = 1;
    return selected;
  };
  const auto size = [](const BrickRemainder::Block& b) { return b.bricks[0] * b.bricks[1] * b.bricks[2]; };
  const auto sizes = [&](const std::vector<BrickRemainder::Block>& blocks) {
    std::int64_t sum = 0;
    for (const BrickRemainder::Block& b : blocks) sum += size(b);
    return sum;
  };
  GoldSource all(device().state(), chain.filtered, chain.sups, settings),
      teller(device().state(), chain.filtered, chain.sups, settings),
      told(device().state(), chain.filtered, chain.sups, settings);
  all.remainder->require(among(1), {});
  const std::int64_t whole = sizes(all.remainder->known());
  BOOST_TEST(sizes(teller.remainder->open(among(1))) == whole);
  BOOST_TEST(sizes(teller.remainder->open(among(333))) < whole);
  teller.remainder->require(among(333), {});
  BOOST_TEST(teller.remainder->open(among(333)).empty());
  const std::vector<BrickRemainder::Block> known = teller.remainder->known();
  BOOST_TEST(sizes(known) > 0);
  BOOST_TEST(sizes(known) < whole);
  for (const BrickRemainder::Block& b : known) told.remainder->take(b, teller.remainder->found(b));
  BOOST_TEST(told.remainder->open(among(333)).empty());
  told.remainder->require(among(1), {});
  BOOST_TEST(sizes(told.remainder->known()) == whole);
  const GoldLattice lattice = all.kept.lattice(grid, 4);
  for (std::int64_t brick = 0; brick < bricks.size(); ++brick)
    BOOST_TEST(told.remainder->of(brick, lattice) == all.remainder->of(brick, lattice));
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
