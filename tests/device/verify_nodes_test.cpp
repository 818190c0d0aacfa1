// F as verify makes it, held to F in double precision at every node, within what it charges.
#define BOOST_TEST_MODULE verify_nodes
#include "host/verify/witness/nodes.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;
using vdvr::testing::empty_scan;
using vdvr::testing::noise_scan;

namespace {

std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

Grid grid_of(const Index3& cells, const Vec3& spacing) {
  Grid grid;
  grid.cells = cells;
  grid.spacing = spacing;
  for (std::size_t a = 0; a < 3; ++a)
    grid.origin[a] = -0.5 * static_cast<double>(cells[a]) * spacing[a] + 0.07;
  return grid;
}

/// Nodes around a box of the grid, as many as gold of these rates needs.
VerifyNodes::Part part_of(const VerifyNodes::Part& shape, const Index3& first, const Index3& end, int rate) {
  VerifyNodes::Part p = shape;
  const std::int64_t around = rate > p.across ? VerifyNodes::Part{}.reach() : 2;
  p.first_x = first[0] * p.across - around;
  p.first_y = first[1] * p.across - around;
  p.nx = (end[0] - first[0]) * p.across + 1 + 2 * around;
  p.ny = (end[1] - first[1]) * p.across + 1 + 2 * around;
  if (!p.rows) {
    const std::int64_t beyond = rate > p.along ? VerifyNodes::Part{}.reach() : 2;
    p.first_z = first[2] * p.along - beyond;
    p.nz = (end[2] - first[2]) * p.along + 1 + 2 * beyond;
  }
  p.tiles.assign(at(VerifyNodes::tiles_across(p.nx) * VerifyNodes::tiles_across(p.ny)), 1);
  return p;
}

/// Only the tiles of `part` that hold a node of `inner`, which lies in it.
VerifyNodes::Part narrowed(VerifyNodes::Part part, const VerifyNodes::Part& inner) {
  constexpr std::int64_t side = VDVR_VERIFY_TILE;
  const std::int64_t across = VerifyNodes::tiles_across(part.nx), x = inner.first_x - part.first_x,
                     y = inner.first_y - part.first_y;
  for (std::int64_t t = 0; t < std::ssize(part.tiles); ++t) {
    const std::int64_t tx = t % across, ty = t / across;
    part.tiles[at(t)] =
        tx >= x / side && tx <= (x + inner.nx - 1) / side && ty >= y / side && ty <= (y + inner.ny - 1) / side
            ? 1
            : 0;
  }
  return part;
}

struct Gold {
  std::int64_t n = 0, nz = 0, z_padded = 0;
  std::vector<float> values;
  [[nodiscard]] float value(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return values[at((y * n + x) * z_padded + z)];
  }
};

/// Gold of the box, with two nodes around.
Gold gold_of(opencl::State& state, VerifyNodes& nodes, const Index3& first, const Index3& end, int rate) {
  Gold g;
  g.n = std::max(end[0] - first[0], end[1] - first[1]) * rate + 5;
  g.nz = (end[2] - first[2]) * rate + 5;
  g.z_padded = (g.nz + 15) / 16 * 16;
  const opencl::DeviceArray<float> values(state, at(g.n * g.n * g.z_padded + 64), "gold");
  const std::array<std::int64_t, 2> corner{first[0] * rate - 2, first[1] * rate - 2};
  nodes.gold({rate, std::span(&corner, 1), g.n, first[2] * rate - 2, g.z_padded}, values);
  g.values = values.to_host();
  return g;
}

FieldBounds bounds_of(const ExactField& exact, const VerifyNodes& nodes, const VerifyNodes::Part& part,
                      const Grid& grid, int rate) {
  Vec3 h = grid.spacing;
  for (double& x : h) x /= rate;
  return field_bounds(view_sups(exact.coefficients(), exact.geometry(), {}), exact.rounding(),
                      exact.geometry(), h, nodes.path(part, rate));
}

/// What the table of docs/error-bounds.md, section 10, counts of a node, in units of u S: a place's columns,
/// interpolation between them, a view's sum, the product along z; twelve weights along each axis that has
/// fewer nodes than gold, and what these err.
double counted(const NodePath& p) {
  const bool across = p.across.made(), along = !p.rows && p.along.made();
  const double L = across ? 1.624 : 1, along_z = along ? 1.624 : 1, d = std::numbers::pi / p.density,
               column = (4 * p.reach + 6) * d + 27, row = 28 + 1.01 * static_cast<double>(10 + p.calls),
               product = p.rows || along ? 1.01 * 20 : 0;
  const double passes = across || along ? 155 + 13.2 * (1.624 * 1.624 + 1.624) : 0;
  return L * L * along_z * (column + p.gain * (row + product)) + passes;
}

/// What six-point interpolation errs of white noise behind the ramp, in the mean over places, as a share of
/// F's own mean square's root: its spectrum goes with w, its sixth derivative with w^7, so that the sixth
/// derivative is (3 / 15)^(1/2) of what a wave at Nyquist has; the product of distances to six points is .71
/// of its largest. Views err independently of each other, as they are added up in F.
double interpolation_of_noise(double density) {
  return 225.0 / 64 / 720 * std::pow(std::numbers::pi / density, 6) * std::sqrt(3.0 / 15) * 0.71;
}

/// The largest error at a node, as a share of the bound. Every node of the box is looked at.
double worst_share(opencl::State& state, const ProjectionSet& scan, const Grid& grid,
                   const VerifyNodes::Part& shape, const std::vector<int>& rates, bool noise) {
  const ExactField exact(scan, {});
  const double side = std::hypot(grid.spacing[0], grid.spacing[1]);
  VerifyNodes nodes(state, exact, grid, 1, 12 * side);
  const VerifyNodes::Part part = part_of(shape, {0, 0, 0}, grid.cells, rates.back());
  nodes.make(part);
  double worst = 0;
  for (const int rate : rates) {
    const Gold gold = gold_of(state, nodes, {0, 0, 0}, grid.cells, rate);
    const double bound = bounds_of(exact, nodes, part, grid, rate).arithmetic + exact.rounding();
    std::vector<Vec3> points;
    std::vector<double> values;
    for (std::int64_t z = 0; z < grid.cells[2] * rate + 5; z += 3)
      for (std::int64_t y = 0; y < grid.cells[1] * rate + 5; ++y)
        for (std::int64_t x = 0; x < grid.cells[0] * rate + 5; ++x) {
          const Index3 node{x - 2, y - 2, z - 2};
          Vec3 p{};
          for (std::size_t a = 0; a < 3; ++a)
            p[a] = grid.origin[a] + static_cast<double>(node[a]) / rate * grid.spacing[a];
          points.push_back(p);
          values.push_back(static_cast<double>(gold.value(x, y, z)));
        }
    const auto F = exact.at(points);
    const SupsByView sups = view_sups(exact.coefficients(), exact.geometry(), {});
    const double S = std::accumulate(sups.value.begin(), sups.value.end(), 0.0);
    // A bound that counts more than its table would hide a fault.
    BOOST_TEST(bound <=
               1.01 * tolerance::unit_roundoff * counted(nodes.path(part, rate)) * S + 8 * exact.rounding());
    double squares = 0, largest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      squares += F[i] * F[i];
      largest = std::max(largest, std::abs(values[i] - F[i]));
      const double share = std::abs(values[i] - F[i]) / bound;
      if (!(share <= tolerance::bound(1.0)))
        BOOST_ERROR("rate " << rate << " at " << points[i][0] << ", " << points[i][1] << ", " << points[i][2]
                            << ": " << values[i] << " for " << F[i] << ", bound " << bound);
      worst = std::max(worst, share);
    }
    // The largest of many errors is above their mean.
    if (noise)
      BOOST_TEST(largest >= interpolation_of_noise(nodes.path(part, rate).density) *
                                std::sqrt(squares / static_cast<double>(F.size())));
  }
  return worst;
}

}  // namespace

BOOST_AUTO_TEST_CASE(nodes_lie_a_quarter_of_a_pixel_apart_at_most) {
  ParallelGeometry g;
  g.pitch_u = 0.5;
  const auto across = [&](double x, double y) { return nodes_across(grid_of({1, 1, 1}, {x, y, 1}), g); };
  BOOST_TEST(across(0.5, 0.5) == 4);
  BOOST_TEST(across(0.5, 0.51) == 8);
  BOOST_TEST(across(0.35, 0.2) == 4);
  BOOST_TEST(across(0.1, 0.1) == 1);
  BOOST_TEST(across(4.0, 1.0) == 32);
}

BOOST_AUTO_TEST_CASE(F_is_within_its_bound_at_every_node) {
  struct Case {
    const char* name;
    ProjectionSet scan;
    Vec3 spacing;
  };
  const std::vector<Case> cases{{"pixels", noise_scan(13, 6, 21, 3), {1, 1, 1}},
                                {"below the pitch", noise_scan(11, 7, 18, 4), {0.7, 0.6, 0.5}},
                                {"above the pitch", noise_scan(9, 19, 23, 5), {1.9, 2, 1.7}},
                                {"one row", noise_scan(12, 1, 19, 6), {1, 1, 1}},
                                {"two rows", noise_scan(40, 2, 20, 7), {0.9, 0.9, 0.4}},
                                {"beyond the detector", noise_scan(9, 4, 5, 8), {2, 2, 1}}};
  for (const Case& c : cases) {
    const Grid grid = grid_of({3, 2, c.scan.geometry.rows == 1 ? 1 : 2}, c.spacing);
    const int across = nodes_across(grid, c.scan.geometry);
    for (const bool rows : {true, false}) {
      VerifyNodes::Part shape;
      shape.across = across;
      shape.rows = rows;
      while (!rows && !(c.spacing[2] / shape.along <= 0.25)) shape.along *= 2;
      const int base = std::max(across, shape.along);
      const double worst =
          worst_share(support::device().state(), c.scan, grid, shape, {base, 2 * base}, true);
      BOOST_TEST_MESSAGE(c.name << (rows ? ", rows" : ", heights") << ": " << 100 * worst
                                << " % of the bound");
    }
  }
}

// Each wave of a small detector by itself.
BOOST_AUTO_TEST_CASE(no_wave_of_a_small_detector_exceeds_the_bound) {
  const Grid grid = grid_of({2, 2, 2}, {1, 1, 1});
  VerifyNodes::Part shape;
  shape.across = 4;
  for (std::int64_t m = 0; m < 9; ++m)
    for (std::int64_t l = 0; l < 4; ++l) {
      ProjectionSet scan = empty_scan(7, 4, 9);
      for (std::int64_t k = 0; k < 7; ++k)
        for (std::int64_t v = 0; v < 4; ++v)
          for (std::int64_t i = 0; i < 9; ++i)
            scan.data[at((k * 4 + v) * 9 + i)] = static_cast<float>(
                std::cos(std::numbers::pi * static_cast<double>(m) * (static_cast<double>(i) + 0.5) / 9) *
                std::cos(std::numbers::pi * static_cast<double>(l) * (static_cast<double>(v) + 0.5) / 4));
      BOOST_TEST(worst_share(support::device().state(), scan, grid, shape, {4, 8, 16}, false) > 0,
                 m << ", " << l);
    }
}

// Positions count from tiles, so that they differ where tiles begin elsewhere: by what position is charged.
BOOST_AUTO_TEST_CASE(a_block_in_the_whole_is_the_block_alone) {
  const ProjectionSet scan = noise_scan(13, 6, 21, 8);
  const ExactField exact(scan, {});
  const Grid grid = grid_of({8, 8, 4}, {1, 1, 1});
  VerifyNodes nodes(support::device().state(), exact, grid, 1, 12);
  for (const bool rows : {true, false}) {
    VerifyNodes::Part shape;
    shape.across = 4;
    shape.rows = rows;
    shape.along = rows ? 1 : 4;
    for (const int rate : {4, 8}) {
      // The box begins a multiple of a tile's side from the whole's first node: the same tiles.
      const Index3 first{2, 4, 0}, end{4, 6, 4};
      const VerifyNodes::Part whole = part_of(shape, {0, 0, 0}, grid.cells, rate);
      nodes.make(whole);
      const Gold in_whole = gold_of(support::device().state(), nodes, first, end, rate);
      const VerifyNodes::Part own = part_of(shape, first, end, rate);
      nodes.make(own);
      const Gold alone = gold_of(support::device().state(), nodes, first, end, rate);
      const VerifyNodes::Part few = narrowed(whole, own);
      BOOST_TEST(nodes.bytes_of(few) < nodes.bytes_of(whole));
      nodes.make(few);
      const Gold of_few = gold_of(support::device().state(), nodes, first, end, rate);
      BOOST_TEST(in_whole.n == alone.n);
      std::int64_t different = 0, different_of_few = 0;
      for (std::int64_t y = 0; y < alone.n; ++y)
        for (std::int64_t x = 0; x < alone.n; ++x)
          for (std::int64_t z = 0; z < alone.nz; ++z) {
            different += in_whole.value(x, y, z) != alone.value(x, y, z) ? 1 : 0;
            different_of_few += in_whole.value(x, y, z) != of_few.value(x, y, z) ? 1 : 0;
          }
      BOOST_TEST(different == 0, "rate " << rate << (rows ? ", rows" : ", heights"));
      BOOST_TEST(different_of_few == 0, "rate " << rate << (rows ? ", rows" : ", heights"));
    }
  }
}
