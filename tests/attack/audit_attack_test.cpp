// The certified upper end of an audit against F by its definition on lattices six times finer than the
// volume: no point may lie beyond it, whatever the volume, its grid and the interpolation.
#define BOOST_TEST_MODULE audit_attack
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <random>
#include <vector>

#include "tests/reference/interpolated.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/device.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/expert/audit.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/exact_field.hpp"

using namespace vdvr;
using namespace vdvr::testing;
using vdvr::support::device;

namespace {

constexpr std::int64_t kFiner = 6;

/// F at the samples, and on it noise of `noise` times the range; or that noise alone.
Volume volume_on(const Grid& grid, const ExactField& exact, bool of_field, double noise, unsigned seed) {
  Volume v{grid, {}};
  const Index3 n = grid.samples();
  std::vector<Vec3> points;
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) points.push_back(grid.position({x, y, z}));
  std::mt19937 random(seed);
  for (const double f : exact.at(points))
    v.samples.push_back(static_cast<float>((of_field ? f : 0) +
                                           noise * (static_cast<double>(random()) / 4294967296.0 - 0.5)));
  return v;
}

struct Dense {
  double largest = 0;
  std::int64_t points = 0;
};

/// In cells all of whose samples are covered.
Dense dense_error(const Volume& v, Between between, const ExactField& exact, const CertifiedRegion& region) {
  const Grid& g = v.grid;
  std::vector<Vec3> cells, points;
  for (std::int64_t z = 0; z < g.cells[2]; ++z)
    for (std::int64_t y = 0; y < g.cells[1]; ++y)
      for (std::int64_t x = 0; x < g.cells[0]; ++x) {
        bool covered = true;
        for (std::int64_t c = 0; c < 8; ++c)
          covered = covered && region.contains(g.position({x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)}));
        if (!covered) continue;
        // Just inside the ends, so that nearest is asked on this side of its jumps.
        for (std::int64_t i = 0; i < (kFiner + 1) * (kFiner + 1) * (kFiner + 1); ++i) {
          const std::array<std::int64_t, 3> step{i % (kFiner + 1), i / (kFiner + 1) % (kFiner + 1),
                                                 i / (kFiner + 1) / (kFiner + 1)};
          const Index3 cell{x, y, z};
          Vec3 p{}, world{};
          for (std::size_t a = 0; a < 3; ++a) {
            p[a] = static_cast<double>(cell[a]) + std::min(static_cast<double>(step[a]) / kFiner, 1 - 1e-9);
            world[a] = g.origin[a] + p[a] * g.spacing[a];
          }
          cells.push_back(p);
          points.push_back(world);
        }
      }
  const std::vector<double> f = exact.at(points);
  Dense dense;
  dense.points = static_cast<std::int64_t>(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    dense.largest = std::max(dense.largest, std::abs(reference::interpolated(v, between, cells[i]) - f[i]));
  return dense;
}

void attack(const ProjectionSet& scan, const Grid& grid, unsigned seed) {
  const ExactField exact(scan, {});
  const CertifiedRegion region(scan);
  for (const bool of_field : {true, false})
    for (const Between between : {Between::nearest, Between::linear, Between::cubic}) {
      const Volume v = volume_on(grid, exact, of_field, of_field ? 0.02 : 1.0, seed);
      AuditOptions options;
      options.as_is = true;
      options.between = between;
      const Audit found = audit(device(), scan, v, options);
      const AuditFigures& f = found.as_is;
      const Dense truth = dense_error(v, between, exact, region);
      BOOST_TEST_CONTEXT("seed " << seed << ", " << text_of(between)
                                 << (of_field ? ", F and noise" : ", noise")) {
        BOOST_REQUIRE(f.upper.has_value());
        BOOST_REQUIRE(truth.points > 0);
        BOOST_TEST(truth.largest <= *f.upper);
        BOOST_TEST(f.lower <= *f.upper);
        BOOST_TEST(f.largest <= f.lower);
        // Not by being far too large. Cubic is bounded by way of linear, which may lie much farther from F.
        if (between != Between::cubic)
          BOOST_TEST(*f.upper <= (between == Between::linear ? 1.1 : 2.0) * truth.largest);
        BOOST_TEST(f.lower >= 0.8 * truth.largest);
        // What is said to be attained is.
        Vec3 cells{};
        for (std::size_t a = 0; a < 3; ++a) cells[a] = (f.lower_at[a] - grid.origin[a]) / grid.spacing[a];
        BOOST_TEST(exact.at(std::vector<Vec3>{f.lower_at}).front() == f.f_there);
        BOOST_TEST(std::abs(f.w_there - f.f_there) == f.lower);
        // 64 samples by weights of places that err by some u: slopes of cubic weights are below 2 along each
        // axis.
        double largest = 0;
        for (const float s : v.samples) largest = std::max(largest, std::abs(static_cast<double>(s)));
        if (between != Between::nearest)
          BOOST_TEST(std::abs(reference::interpolated(v, between, cells) - f.w_there) <=
                     tolerance::fp64_sum(64, 8 * largest));
      }
    }
}

}  // namespace

BOOST_AUTO_TEST_CASE(no_point_lies_beyond_the_upper_end_on_the_detectors_own_grid) {
  const ProjectionSet scan = noise_scan(15, 7, 13, 3);
  attack(scan, make_grid(scan, {}), 1);
}

BOOST_AUTO_TEST_CASE(nor_on_grids_of_other_people) {
  // Spacings unlike along all axes, coarser and finer than pixels, off the axis, beyond what is covered.
  const ProjectionSet scan = noise_scan(16, 6, 12, 5);
  const std::vector<Grid> grids{{{9, 7, 4}, {-4.3, -4.1, -2.2}, {0.93, 1.21, 1.07}, "pixel"},
                                {{13, 8, 9}, {-2.9, -3.3, -2.1}, {0.41, 0.77, 0.43}, "pixel"},
                                {{5, 5, 3}, {-6.2, -6.6, -3.4}, {2.5, 2.7, 2.1}, "pixel"}};
  unsigned seed = 10;
  for (const Grid& grid : grids) attack(scan, grid, seed++);
}

BOOST_AUTO_TEST_CASE(nor_of_cone_beam) {
  ConeShape shape;
  shape.views = 16;
  shape.rows = 12;
  shape.columns = 14;
  const ProjectionSet scan = noisy_cone(shape);
  attack(scan, {{7, 6, 4}, {-3.4, -3.1, -1.9}, {1.02, 1.1, 0.97}, "pixel"}, 21);
}

BOOST_AUTO_TEST_CASE(nor_where_the_tolerance_alone_decides_how_fine_gold_is) {
  const ProjectionSet scan = noise_scan(15, 7, 13, 4);
  const Grid grid = make_grid(scan, {});
  const ExactField exact(scan, {});
  const Volume v = volume_on(grid, exact, true, 0, 1);
  const Dense truth = dense_error(v, Between::linear, exact, CertifiedRegion(scan));
  AuditOptions options;
  options.as_is = true;
  for (const double factor : {0.5, 1.05, 3.0}) {
    options.within = factor * truth.largest;
    const AuditFigures f = audit(device(), scan, v, options).as_is;
    BOOST_REQUIRE(f.upper.has_value());
    BOOST_TEST(truth.largest <= *f.upper);
    BOOST_TEST((*f.upper <= *options.within) == (factor > 1));
    BOOST_TEST((f.lower > *options.within) == (factor < 1));
  }
}
