#define BOOST_TEST_MODULE attack_gold
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "host/base/system/casts.hpp"
#include "host/certify/kept/kept_gold.hpp"
#include "tests/reference/field_derivatives.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/attack_scans.hpp"
#include "tests/support/exact_columns.hpp"
#include "tests/support/tolerance.hpp"

// What interpolation between kept nodes charges, each part where it is as large as it can be made.
using namespace vdvr;
using namespace vdvr::attacks;

namespace {

Grid grid_in(const Index3& cells, const Vec3& spacing, const Vec3& origin) {
  Grid grid;
  grid.cells = cells;
  grid.spacing = spacing;
  grid.origin = origin;
  return grid;
}

// One node of gold.
double node_of(KeptGold& kept, const GoldLattice& lattice, const Index3& node) {
  const GoldBox box{node, {1, 1, 1}};
  kept.prepare(lattice, {box}, {});
  const std::int64_t stride = column_stride(1);
  opencl::DeviceArray<float> out(device().state(), count(stride), "a node");
  out.fill(0.0f);
  kept.fill(lattice, box, out, 0, stride);
  return static_cast<double>(out.to_host().front());
}

// Linear interpolation between columns errs most in their middles and not at all on them. A kept node
// lies 1.2 or 1.6 columns from the next (3-4-5): around a node on a column, midway between four of them,
// those of positive weight lie near middles and others near columns, and errors add to 1.2 of the largest.
struct Amplified {
  static constexpr std::int64_t U = 24;
  static constexpr int upsampling = 4;
  ParallelGeometry g = geometry(1, 1, U);
  FilteredScan filtered;
  explicit Amplified(double sign) {
    g.theta_rad = {std::atan2(0.8, 0.6)};
    constexpr std::size_t m = 3;
    g.center = middle_of_column(crest(m, U), upsampling) + 0.5 / upsampling;  // on a column
    filtered = given_samples(g, [&](auto, auto, std::size_t u) {
      return sign * std::cos(reference::frequency(m, U) * (static_cast<double>(u) + 0.5));
    });
  }
};

}  // namespace

BOOST_AUTO_TEST_CASE(errors_of_kept_nodes_grow_in_what_is_interpolated_and_no_more_than_is_charged) {
  for (const double sign : {1.0, -1.0}) {
    const Amplified a(sign);
    Upsampler upsampler(device().state(), a.filtered);
    const FieldSups sups = field_sups(device().state(), upsampler, a.filtered);
    // The axis is a node of 4x in the middle of four kept ones.
    const Grid grid = grid_in({10, 10, 1}, {1, 1, 1}, {-5.25, -5.25, -0.5});
    KeptGold kept(device().state(), a.filtered, sups, grid, 1, Amplified::upsampling, Interpolation::linear);
    const GoldLattice lattice = kept.lattice(grid, 4);
    BOOST_REQUIRE((lattice.phases[0] == 2 && lattice.phases[1] == 2));
    const ExactColumns exact(a.g, {1, a.g.center, 0, 1}, a.filtered.samples, 0);
    const double F = exact(0, 0), error = std::abs(node_of(kept, lattice, {21, 21, 0}) - F);
    const GoldErrors e = kept.errors(lattice), own = kept.errors({});
    BOOST_TEST_MESSAGE("  grown: " << error / own.interpolation << " of what a kept node errs by, "
                                   << error / e.interpolation << " of what is charged");
    // So the largest error of a kept node would be no bound.
    BOOST_TEST(error > own.interpolation + own.rounding);
    BOOST_TEST(error <= tolerance::bound(e.interpolation + e.rounding));
    BOOST_TEST(error >= 0.25 * e.interpolation);
  }
}

// Second differences of gold beside a node, made of computed nodes and of F: what T is charged for.
BOOST_AUTO_TEST_CASE(second_differences_err_by_no_more_than_is_charged) {
  double closest = 0;
  int turn = 0;
  for (const Scan& scan : awkward_scans()) {
    Chain chain(scan.data);
    if (chain.filtered.view_max[0] < 0x1p-100) continue;
    // The axis, or 1.1, -2.3, ..: an inner node of a small lattice.
    for (const Interpolation filter : all_filters)
      for (const int rate : {2, 4, 8}) {
        const int upsampling = filter == Interpolation::six_taps ? 8 : 2 << (turn++ % 4);
        const double spacing = turn % 3 == 0 ? 1.0 : turn % 3 == 1 ? 0.7 : 1.9;
        const Grid grid = grid_in(
            {3, 3, 1}, {spacing, spacing, spacing},
            {scan.target[0] - 1.3 * spacing, scan.target[1] - 1.6 * spacing, scan.target[2] - 0.4 * spacing});
        KeptGold kept(device().state(), chain.filtered, chain.sups, grid, 2 * spacing, upsampling, filter);
        const GoldLattice lattice = kept.lattice(grid, rate);
        const GoldErrors e = kept.errors(lattice);
        const GoldBox box{{rate, rate, 0}, {rate + 2, rate + 2, rate + 1}};
        kept.prepare(lattice, {box}, {});
        const std::int64_t stride = column_stride(box.nodes[2]);
        opencl::DeviceArray<float> out(device().state(), count(box.nodes[0] * box.nodes[1] * stride), "gold");
        out.fill(0.0f);
        kept.fill(lattice, box, out, 0, stride);
        const auto gold = out.to_host();
        std::vector<double> computed;
        std::vector<Vec3> points;
        for (std::int64_t z = 0; z < box.nodes[2]; ++z)
          for (std::int64_t y = 0; y < box.nodes[1]; ++y)
            for (std::int64_t x = 0; x < box.nodes[0]; ++x) {
              computed.push_back(static_cast<double>(gold[vdvr::at((y * box.nodes[0] + x) * stride + z)]));
              const Index3 i{x, y, z};
              Vec3 p{};
              for (std::size_t a = 0; a < 3; ++a)
                p[a] = grid.origin[a] + static_cast<double>(box.first[a] + i[a]) / rate * grid.spacing[a];
              points.push_back(p);
            }
        const auto F = chain.exact.at(points);
        // The ramp's error makes a band-limited field of its own: its second differences are at most those
        // that the spacings allow.
        double ramp = 0;
        for (std::size_t a = 0; a < 3; ++a) {
          const double pitch = a == 2 ? scan.data.geometry.pitch_v : scan.data.geometry.pitch_u;
          ramp += std::min(4.0, std::pow(std::numbers::pi * grid.spacing[a] / rate / pitch, 2)) / 8 * e.ramp;
        }
        const double bound = e.curved_interpolation + e.curved_rounding + ramp + 2 * chain.exact.rounding();
        const Index3& n = box.nodes;
        for (std::int64_t z = 1; z + 1 < n[2]; ++z)
          for (std::int64_t y = 1; y + 1 < n[1]; ++y)
            for (std::int64_t x = 1; x + 1 < n[0]; ++x) {
              double found = 0, truth = 0, worst = 0;
              const std::size_t c = vdvr::at((z * n[1] + y) * n[0] + x);
              // The signs that add up.
              for (const std::size_t step : {std::size_t{1}, vdvr::at(n[0]), vdvr::at(n[0] * n[1])}) {
                found = computed[c - step] + computed[c + step] - 2 * computed[c];
                truth = F[c - step] + F[c + step] - 2 * F[c];
                worst += std::abs(found - truth) / 8;
              }
              if (worst > 0) closest = std::max(closest, worst / bound);
              BOOST_TEST(worst <= tolerance::bound(bound), scan.name << ", " << text_of(filter) << " "
                                                                     << upsampling << ", " << rate
                                                                     << "x: " << worst << " > " << bound);
            }
      }
  }
  BOOST_TEST_MESSAGE("  second differences: error / bound " << closest);
  // An attack that comes nowhere near tests nothing. This one reaches a sixth: the bound charges the sups of
  // all views at once, and of noise only some add up.
  constexpr double weakest_attack = 0.1;
  BOOST_TEST(closest >= weakest_attack);
}

// Every filtered sample wrong by e, with the signs that add up at a node.
BOOST_AUTO_TEST_CASE(errors_of_filtered_samples_reach_gold_as_charged) {
  const double e = 0x1p-10;
  double closest = 0;
  for (const double row : {1.5, 0.5, 3.25})
    for (const int rate : {2, 4}) {
      ParallelGeometry g = geometry(5, 4, 24);
      const auto wu = resampling_matrix(g.columns, std::array{g.center}, 0, 1, 0),
                 wv = resampling_matrix(g.rows, std::array{row}, 0, 1, 0);
      const FilteredScan right = given_samples(
          g, [](auto k, auto v, auto u) { return std::cos(static_cast<double>(7 * k + 3 * v + 5 * u)); });
      const auto sample = [&](std::size_t k, std::size_t v, std::size_t u) { return (k * 24 + u) * 4 + v; };
      FilteredScan wrong = given_samples(g, [&](std::size_t k, std::size_t v, std::size_t u) {
        return static_cast<double>(right.samples[sample(k, v, u)]) + e * (wu[u] * wv[v] < 0 ? -1.0 : 1.0);
      });
      wrong.ramp_error = 5 * (e + tolerance::unit_roundoff * 2);  // the sum is rounded
      Upsampler upsampler(device().state(), wrong);
      const FieldSups sups = field_sups(device().state(), upsampler, wrong);
      const Grid grid = grid_in({4, 4, 1}, {1, 1, 1}, {-2, -2, row - 1.5});
      KeptGold kept(device().state(), wrong, sups, grid, 1, 8, Interpolation::six_taps);
      const GoldLattice lattice = kept.lattice(grid, rate);
      const ExactColumns exact(g, {1, g.center, 0, 1}, right.samples, row);
      double F = 0;
      for (std::size_t k = 0; k < 5; ++k) F += exact(k, 0);
      const GoldErrors errors = kept.errors(lattice);
      const double error = std::abs(node_of(kept, lattice, {2 * rate, 2 * rate, 0}) - F);
      closest = std::max(closest, error / (errors.interpolation + errors.rounding + errors.ramp));
      BOOST_TEST(error <= tolerance::bound(errors.interpolation + errors.rounding + errors.ramp));
      BOOST_TEST(error > errors.interpolation + errors.rounding);
    }
  BOOST_TEST_MESSAGE("  filtered samples: error / bound " << closest);
}

// Kept nodes as they are: between columns and with them, in one view or thousands.
BOOST_AUTO_TEST_CASE(kept_nodes_of_thousands_of_views_err_by_no_more_than_is_charged) {
  std::map<int, double> rounding_of_90;  // by rate, over S
  for (const std::int64_t views : {90, 24576}) {
    ParallelGeometry g = geometry(views, 2, 8);
    g.center = 3.4;
    double closest = 0;
    for (const double term : {1.9999, 1.75, 1.3337, 1.2501, 1.0626}) {
      // Equal terms: every run rounds the same way.
      const FilteredScan f = given_samples(
          g, [&](auto, auto, auto) { return term / static_cast<double>(views) * (1 + 0x1p-13); });
      Upsampler upsampler(device().state(), f);
      const FieldSups sups = field_sups(device().state(), upsampler, f);
      const Grid grid = grid_in({4, 4, 1}, {1, 1, 1}, {-2, -2, -0.5});
      KeptGold kept(device().state(), f, sups, grid, 1, 8, Interpolation::six_taps);
      for (const int rate : {2, 8}) {
        const GoldLattice lattice = kept.lattice(grid, rate);
        const GoldErrors e = kept.errors(lattice);
        // Rounding hardly grows with the views: 12 terms to a run, and what is lost between runs is kept.
        const double rounding = e.rounding / sups.value;
        if (views == 90) rounding_of_90[rate] = rounding;
        BOOST_TEST(rounding <= 1.1 * rounding_of_90[rate]);
        const double F = static_cast<double>(views) * static_cast<double>(f.samples[0]);
        for (const Index3& node : {Index3{2, 2, 0}, {3, 2, 1}, {3, 3, 1}, {1, 4, 0}}) {
          const double error = std::abs(node_of(kept, lattice, node) - F);
          closest = std::max(closest, error / (e.interpolation + e.rounding));
          BOOST_TEST(error <= tolerance::bound(e.interpolation + e.rounding),
                     views << " views of " << term << ": " << error);
        }
      }
    }
    BOOST_TEST_MESSAGE("  " << views << " views: error / bound " << closest);
  }
}

// The chain to a kept node, against the filtered samples' own field in double precision.
BOOST_AUTO_TEST_CASE(columns_interpolated_by_six_taps_err_by_no_more_than_the_chain_says) {
  double closest = 0;
  for (const auto& [views, columns] : {std::pair<std::int64_t, std::int64_t>{44, 24}, {3, 129}, {600, 9}})
    for (const unsigned seed : {1u, 2u}) {
      ParallelGeometry g = geometry(views, 1, columns);
      std::mt19937 random(seed);
      const FilteredScan f = given_samples(
          g, [&](auto, auto, auto) { return static_cast<double>(random()) / 4294967296.0 - 0.5; });
      opencl::State& state = device().state();
      Upsampler upsampler(state, f, ColumnMethod::accurate);
      const FieldSups sups = field_sups(state, upsampler, f);
      const UpsampledColumns upsampled = upsampled_columns(columns, 8, 3);
      const UpsampledSlab slab = upsampler(upsampled, std::array{0.0});
      const ColumnBlocks blocks{7, 5, 0.43, 0.51, {{-1.2, 0.3}}, {}};
      opencl::DeviceArray<float> out(state, count(blocks.nx * blocks.ny * column_stride(1)), "columns");
      back_project(state, g, slab, blocks, Interpolation::six_taps, out);
      const auto host = out.to_host();
      const ChainErrors e = chain_errors(upsampler, f, sups, upsampled, blocks, Interpolation::six_taps);
      const double bound = e.columns + e.summation + e.position + e.interpolation + e.underflow;
      const reference::FieldDerivatives exact(g, f.samples);
      constexpr std::array<std::array<int, 3>, 1> value{};
      for (std::int64_t y = 0; y < blocks.ny; y += 2)
        for (std::int64_t x = 0; x < blocks.nx; x += 2) {
          const Vec3 at{-1.2 + 0.43 * static_cast<double>(x), 0.3 + 0.51 * static_cast<double>(y), 0};
          const auto computed = static_cast<double>(host[vdvr::at((y * blocks.nx + x) * column_stride(1))]);
          const double error = std::abs(computed - exact.at(at, value)[0]);
          closest = std::max(closest, error / bound);
          BOOST_TEST(error <= tolerance::bound(bound), views << " views: " << error << " > " << bound);
        }
    }
  BOOST_TEST_MESSAGE("  chain to a kept node: error / bound " << closest);
}
