#define BOOST_TEST_MODULE reconstruct
#include "vdvr/expert/reconstruct.hpp"

#include <boost/test/unit_test.hpp>

#include "host/field/fbp/filter_projections.hpp"
#include "host/field/fbp/ramp_kernel.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/simulate.hpp"

using namespace vdvr;
using vdvr::testing::noise_scan;

namespace {

// The largest |F_computed - F| over the grid's covered samples.
double worst_error(const ProjectionSet& scan, const Grid& grid, const ReconstructOptions& options) {
  Device device;
  const Volume volume = reconstruct(device, scan, grid, options);
  const ExactField exact(scan, options.field);
  std::vector<Vec3> points;
  std::vector<double> computed;
  const Index3 n = grid.samples();
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const Vec3 p = grid.position({x, y, z});
        if (!exact.covered(p)) continue;
        points.push_back(p);
        computed.push_back(
            static_cast<double>(volume.samples[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)]));
      }
  const auto truth = exact.at(points);
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) worst = std::max(worst, std::abs(truth[i] - computed[i]));
  return worst;
}

// White noise in [-1/2, 1/2], filtered: every view contributes at most the kernel's absolute sum.
double field_scale(const ProjectionSet& scan, const FieldOptions& field) {
  const auto g = ramp_kernel(field, scan.geometry.pitch_u, scan.geometry.columns);
  double sum = g[0];
  for (std::size_t i = 1; i < g.size(); ++i) sum += 2 * std::abs(g[i]);
  return std::numbers::pi * 0.5 * sum;
}

}  // namespace

BOOST_AUTO_TEST_CASE(cubic_at_high_rate_reaches_the_exact_field) {
  for (const auto& [columns, rows] : {std::pair<int, int>{33, 9}, {40, 1}, {29, 2}}) {
    const ProjectionSet scan = noise_scan(19, rows, columns);
    GridOptions options;
    options.spacing = 0.77;
    const Grid grid = make_grid(scan.geometry, options);
    // 3/128 (pi/32)^4 per view is the cubic's own error on a wave at Nyquist; noise holds such waves.
    const double interpolation = 3.0 / 128 * std::pow(std::numbers::pi / 32, 4) * field_scale(scan, {});
    const double rounding = tolerance::fp32_sum(200, field_scale(scan, {}));
    BOOST_TEST(worst_error(scan, grid, {{}, 32, Interpolation::cubic}) <= interpolation + rounding);
  }
}

BOOST_AUTO_TEST_CASE(linear_error_falls_by_four_per_doubling) {
  const ProjectionSet scan = noise_scan(19, 5, 33);
  const Grid grid = make_grid(scan.geometry, {});
  const double at8 = worst_error(scan, grid, {{}, 8, Interpolation::linear}),
               at16 = worst_error(scan, grid, {{}, 16, Interpolation::linear});
  BOOST_TEST(at16 < at8 / 3);
  BOOST_TEST(at16 > at8 / 5);
}

BOOST_AUTO_TEST_CASE(windows_and_cutoff_follow_the_definition) {
  const ProjectionSet scan = noise_scan(11, 3, 24);
  const Grid grid = make_grid(scan.geometry, {});
  for (const auto& [filter, name] : ramp_windows) {
    const FieldOptions field{filter, 0.8, {}};
    const double scale = field_scale(scan, field);
    BOOST_TEST(worst_error(scan, grid, {field, 32, Interpolation::cubic}) <=
               3.0 / 128 * std::pow(std::numbers::pi / 32, 4) * scale + tolerance::fp32_sum(200, scale));
  }
}

BOOST_AUTO_TEST_CASE(ram_lak_kernel_is_the_closed_form_and_quadrature_agrees) {
  const auto closed = ramp_kernel({}, 0.5, 16);
  // A cutoff a hair below 1 goes through the quadrature; its kernel differs by at most that hair's band.
  const auto quadrature = ramp_kernel({RampWindow::ram_lak, 1.0 - 0x1p-40, {}}, 0.5, 16);
  BOOST_TEST(closed[0] == 0.5);
  BOOST_TEST(closed[2] == 0.0);
  for (std::size_t i = 0; i < 16; ++i) BOOST_TEST(std::abs(closed[i] - quadrature[i]) <= 0x1p-38);
}

BOOST_AUTO_TEST_CASE(weights_add_to_pi_for_every_way_to_scan) {
  const auto sum = [](const ViewWeights& w) {
    double s = 0;
    for (const double v : w.weight) s += v;
    return s;
  };
  const double eps = tolerance::fp64_sum(1000, 8);
  for (const double arc : {180.0, 360.0})
    for (const int n : {7, 90, 181}) {
      const auto scan = vdvr::testing::empty_scan(n, 1, 8, arc);
      BOOST_TEST(std::abs(sum(view_weights(scan.geometry.theta_rad)) - std::numbers::pi) <= eps);
    }
  auto both_ends = vdvr::testing::empty_scan(90, 1, 8).geometry.theta_rad;
  both_ends.push_back(std::numbers::pi);
  const ViewWeights w = view_weights(both_ends);
  BOOST_TEST(std::abs(sum(w) - std::numbers::pi) <= eps);
  BOOST_TEST(w.grouped_views == 2);
  BOOST_TEST(std::abs(w.weight.front() - 0.5 * w.weight[1]) <= eps);
}

BOOST_AUTO_TEST_CASE(half_acquisition_whose_rows_nobody_weighted_is_refused) {
  auto scan = vdvr::testing::empty_scan(90, 1, 64, 360);
  scan.geometry.center = 5;
  BOOST_CHECK_THROW(check_scan(scan.geometry), InputError);
}

BOOST_AUTO_TEST_CASE(small_memory_gives_the_same_volume) {
  const ProjectionSet scan = noise_scan(12, 40, 24);
  const Grid grid = make_grid(scan.geometry, {});
  Device large, small("", std::uint64_t{24} << 20);
  const Volume a = reconstruct(large, scan, grid, {}), b = reconstruct(small, scan, grid, {});
  double worst = 0;
  for (std::size_t i = 0; i < a.samples.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>(a.samples[i]) - static_cast<double>(b.samples[i])));
  BOOST_TEST(worst <= tolerance::fp32_sum(200, field_scale(scan, {})));
  BOOST_TEST(small.peak_memory() <= (std::uint64_t{24} << 20));
}

BOOST_AUTO_TEST_CASE(planes_one_slab_after_the_other_are_the_volume) {
  ProjectionSet scan = noise_scan(12, 300, 24);
  // Nanometres in metres are computed in other units.
  for (const double pitch : {1.0, 1e-9}) {
    scan.geometry.pitch_u = scan.geometry.pitch_v = pitch;
    const Grid grid = make_grid(scan.geometry, {});
    Device device("", std::uint64_t{24} << 20);
    const Volume whole = reconstruct(device, scan, grid, {});
    std::vector<float> planes;
    std::int64_t slabs = 0;
    const std::int64_t plane = grid.samples()[0] * grid.samples()[1];
    reconstruct_planes(device, scan, grid, {}, [&](std::int64_t first, std::span<const float> next) {
      BOOST_TEST(first * plane == static_cast<std::int64_t>(planes.size()));
      planes.insert(planes.end(), next.begin(), next.end());
      ++slabs;
    });
    BOOST_TEST(slabs > 1);
    // A slab of another height is rounded alike: its rows are products by themselves.
    BOOST_TEST((planes == whole.samples));
    BOOST_TEST(device.peak_memory() <= (std::uint64_t{24} << 20));
  }
}

// Of a scan in scratch only a slab's rows are filtered where the grid's heights are the detector's, and all
// of them, into scratch, where they are not.
BOOST_AUTO_TEST_CASE(scan_in_scratch_gives_the_same_volume) {
  const ProjectionSet scan = noise_scan(12, 300, 24);
  ProjectionSet stored = scan;
  // A disk, which a temporary folder need not be.
  stored.data =
      SampleArray(scan.data.size(), std::make_shared<Scratch>(".", std::uint64_t{1} << 20), "a scan");
  std::copy(scan.data.begin(), scan.data.end(), stored.data.begin());
  for (const double height : {0.0, 0.25})
    for (const int upsampling : {1, 8}) {
      Grid grid = make_grid(scan.geometry, {});
      grid.origin[2] += (20 + height) * grid.spacing[2];
      grid.cells[2] = 270;  // more than a slab
      ReconstructOptions options;
      options.upsampling = upsampling;
      Device device("", std::uint64_t{24} << 20);
      const Volume a = reconstruct(device, scan, grid, options),
                   b = reconstruct(device, stored, grid, options);
      double worst = 0;
      for (std::size_t i = 0; i < a.samples.size(); ++i)
        worst =
            std::max(worst, std::abs(static_cast<double>(a.samples[i]) - static_cast<double>(b.samples[i])));
      BOOST_TEST(worst <= tolerance::fp32_sum(400, field_scale(scan, {})));
    }
}

// The acceptance of the project's contract: half a percent of the density, the same at any pitch.
BOOST_AUTO_TEST_CASE(sphere_keeps_its_density_inside_and_nothing_outside_at_any_pitch) {
  constexpr double half_a_percent = 0.005;
  for (const double pitch : {1.0, 0.1}) {
    SimulateOptions options;
    options.angles = 120;
    options.columns = options.rows = 65;
    options.pitch_u = options.pitch_v = pitch;
    const ProjectionSet scan = simulate(sphere(20 * pitch, 1), options);
    Device device;
    const Grid grid = make_grid(scan.geometry, {});
    const Volume volume = reconstruct(device, scan, grid, {});
    double inside = 0, outside = 0;
    std::int64_t inside_count = 0, outside_count = 0;
    const Index3 n = grid.samples();
    for (std::int64_t z = 0; z < n[2]; ++z)
      for (std::int64_t y = 0; y < n[1]; ++y)
        for (std::int64_t x = 0; x < n[0]; ++x) {
          const Vec3 p = grid.position({x, y, z});
          const double radius = std::hypot(p[0], p[1], p[2]) / pitch;
          const double value =
              static_cast<double>(volume.samples[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)]);
          if (radius <= 16) {
            inside += value;
            ++inside_count;
          } else if (radius >= 24 && radius <= 30) {
            outside += value;
            ++outside_count;
          }
        }
    BOOST_TEST(std::abs(inside / static_cast<double>(inside_count) - 1) <= half_a_percent);
    BOOST_TEST(std::abs(outside / static_cast<double>(outside_count)) <= half_a_percent);
  }
}
