// FDK on the device against its formulas and against F in double precision.
#define BOOST_TEST_MODULE reconstruct_cone
#include "host/field/fdk/reconstruct_cone.hpp"

#include <boost/test/unit_test.hpp>

#include <complex>
#include <random>

#include "host/field/fbp/cosine_series.hpp"
#include "host/field/fdk/cone_back_project.hpp"
#include "host/field/fdk/cone_points.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "tests/reference/fdk.hpp"
#include "tests/support/cone_scans.hpp"
#include "tests/support/device.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/d2vr.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/simulate.hpp"

using namespace vdvr;
using namespace vdvr::testing;

namespace {

constexpr double pi = std::numbers::pi;

struct Compared {
  std::vector<Vec3> points;
  std::vector<double> values;
  double largest = 0;
};

// Covered samples of a volume, every `step`-th of them.
Compared covered_samples(const Volume& volume, const ExactField& exact, std::size_t step) {
  Compared out;
  const Index3 n = volume.grid.samples();
  std::size_t met = 0;
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const Vec3 p = volume.grid.position({x, y, z});
        if (!exact.covered(p) || met++ % step != 0) continue;
        out.points.push_back(p);
        out.values.push_back(
            static_cast<double>(volume.samples[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)]));
        out.largest = std::max(out.largest, std::abs(out.values.back()));
      }
  return out;
}

Volume reconstructed(const ProjectionSet& scan, const Grid& grid, int upsampling) {
  Device device;
  ReconstructOptions options;
  options.upsampling = upsampling;
  return reconstruct(device, scan, grid, options);
}

// What fp32 may err, of samples whose value changes by at most `slope` times a view's largest from pixel to
// pixel: the filter's products (samples of 1/2, and a kernel whose magnitudes add to 1/2), the sum over
// views, and positions, which err by 14 u for each column of the block and 2 u, along both axes.
double rounding(const FilteredScan& filtered, double nearest, double slope) {
  double sum = 0;
  for (const double q : filtered.view_max) sum += q / (nearest * nearest);
  const double reach = static_cast<double>(std::max(filtered.geometry.columns, filtered.geometry.rows));
  return tolerance::fp32_sum(filtered.geometry.views() + 40, sum) +
         pi * tolerance::fp32_sum(filtered.geometry.columns + 2, 0.25) / (nearest * nearest) +
         2 * slope * sum * (14 * reach + 2) * tolerance::unit_roundoff;
}
// Between neighbours of opposite sign; and, of the series between them, by Bernstein.
constexpr double slope_of_pixels = 2;
double slope_of_series(const FilteredScan& filtered) {
  return pi * cosine_gain(filtered.geometry.columns) * cosine_gain(filtered.geometry.rows);
}

// The sum of the amplitudes of a filtered view's waves, which are products of cosines.
double amplitudes(const FilteredScan& scan, std::int64_t view) {
  const std::int64_t U = scan.geometry.columns, V = scan.geometry.rows;
  double sum = 0;
  for (std::int64_t m = 0; m < U; ++m)
    for (std::int64_t l = 0; l < V; ++l) {
      double a = 0;
      for (std::int64_t u = 0; u < U; ++u)
        for (std::int64_t v = 0; v < V; ++v)
          a +=
              static_cast<double>(scan.samples[static_cast<std::size_t>((view * U + u) * V + v)]) *
              std::cos(pi * static_cast<double>(m) * (static_cast<double>(u) + 0.5) /
                       static_cast<double>(U)) *
              std::cos(pi * static_cast<double>(l) * (static_cast<double>(v) + 0.5) / static_cast<double>(V));
      sum += std::abs(a) * (m > 0 ? 2 : 1) * (l > 0 ? 2 : 1) / static_cast<double>(U * V);
    }
  return sum;
}

// What 16 taps of 256 places, and linear between them, make of waves up to pi / 2 an entry.
struct PointTaps {
  double error = 0, gain = 0;
};
PointTaps taps_at_points() {
  PointTaps out;
  for (int i = 0; i < 256; ++i) {
    const auto low = taps_between_half_columns(i / 256.0, 16),
               high = taps_between_half_columns((i + 1) / 256.0, 16);
    for (const double part : {0.0, 0.25, 0.5, 0.75}) {
      double gain = 0;
      for (std::size_t t = 0; t < low.size(); ++t) gain += std::abs((1 - part) * low[t] + part * high[t]);
      out.gain = std::max(out.gain, gain);
      for (double w = 0; w <= pi / 2; w += pi / 128) {
        std::complex<double> sum = 0;
        for (std::size_t t = 0; t < low.size(); ++t)
          sum += ((1 - part) * low[t] + part * high[t]) * std::polar(1.0, w * (static_cast<double>(t) - 7));
        out.error = std::max(out.error, std::abs(sum - std::polar(1.0, w * (i + part) / 256)));
      }
    }
  }
  return out;
}

}  // namespace

BOOST_AUTO_TEST_CASE(points_anywhere_have_the_field) {
  const PointTaps taps = taps_at_points();
  // What the header says of them.
  BOOST_TEST((1 + taps.gain) * taps.error < 1e-4);
  constexpr std::uint64_t narrow_memory = std::uint64_t{3} << 18;
  ConeShape plain, few_rows, leaning, displaced;
  few_rows.rows = 9;
  leaning.in_plane_deg = 2;
  leaning.out_of_plane_deg = -3;
  leaning.arc_deg = 260;
  displaced.shift = 4;
  displaced.rows = 33;
  for (const ConeShape& shape : {plain, few_rows, leaning, displaced}) {
    const ProjectionSet scan = noisy_cone(shape);
    const ExactField exact(scan, {});
    Device device;
    const FilteredScan filtered = filter_cone(device.state(), scan, {});
    std::vector<Vec3> points;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> across(-12, 12), along(-12, 12);
    for (int i = 0; i < 4000; ++i)
      if (const Vec3 p{across(random), across(random), along(random)}; exact.covered(p)) points.push_back(p);
    BOOST_REQUIRE(points.size() > 100u);
    const std::vector<double> truth = exact.at(points);
    const std::vector<float> found = cone_at_points(device.state(), ScanInUnits(scan), {}, points, {});
    const double nearest = 1 - 18 / shape.source_to_axis;
    double waves = 0;
    for (std::int64_t k = 0; k < shape.views; ++k) waves += amplitudes(filtered, k) / (nearest * nearest);
    const double allowed = (1 + taps.gain) * taps.error * waves +
                           tolerance::fp32_sum(40, taps.gain * taps.gain * waves) +
                           rounding(filtered, nearest, slope_of_series(filtered));
    double worst = 0, largest = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      worst = std::max(worst, std::abs(static_cast<double>(found[i]) - truth[i]));
      largest = std::max(largest, std::abs(truth[i]));
    }
    BOOST_TEST(worst <= allowed);
    // The bugs that are seeded here (a row off) move values by most of the largest.
    constexpr double telling = 0.05;
    BOOST_TEST(allowed < telling * largest);
    // Fewer views at once than eight: the same bits.
    BOOST_TEST(ConeTables(device.state(), filtered, 2, {6, -6, shape.rows + 6, false}).bytes(8) >
               narrow_memory / 2);
    Device narrow("", narrow_memory);
    BOOST_TEST((cone_at_points(narrow.state(), ScanInUnits(scan), {}, points, {}) == found));
  }
}

BOOST_AUTO_TEST_CASE(fdk_is_what_its_formulas_say) {
  for (const double distance : {40.0, 90.0, 400.0}) {
    ConeShape shape;
    shape.source_to_axis = distance;
    const ProjectionSet scan = noisy_cone(shape);
    GridOptions options;
    options.spacing = 0.9;
    const Grid grid = make_grid(scan, options);
    const ExactField exact(scan, {});
    const Compared ours = covered_samples(reconstructed(scan, grid, 1), exact, 7);
    const reference::Fdk theirs(scan, distance);
    Device device;
    const double allowed =
        rounding(filter_cone(device.state(), scan, {}), 1 - 13 / distance, slope_of_pixels);
    BOOST_REQUIRE(ours.points.size() > 200u);
    double worst = 0;
    for (std::size_t i = 0; i < ours.points.size(); ++i)
      worst = std::max(worst, std::abs(ours.values[i] - theirs.at(ours.points[i])));
    BOOST_TEST(worst <= allowed);
    // The bugs that are seeded here (a weight of distance, a run of rows) move values by more than this
    // share.
    constexpr double telling = 0.01;
    BOOST_TEST(allowed < telling * ours.largest);
  }
}

BOOST_AUTO_TEST_CASE(finer_tables_are_as_near_to_the_field_as_linear_interpolation_can_be) {
  ConeShape plain, tilted;
  tilted.in_plane_deg = 2;
  tilted.out_of_plane_deg = -3;
  for (const ConeShape& shape : {plain, tilted}) {
    const ProjectionSet scan = noisy_cone(shape);
    GridOptions options;
    options.spacing = 0.8;
    const Grid grid = make_grid(scan, options);
    const ExactField exact(scan, {});
    Device device;
    const FilteredScan filtered = filter_cone(device.state(), scan, {});
    const double gain = cosine_gain(filtered.geometry.columns) * cosine_gain(filtered.geometry.rows);
    double sum = 0;
    for (const double q : filtered.view_max) sum += gain * q;
    const double nearest = 1 - 13 / shape.source_to_axis;
    for (const int rate : {2, 8}) {
      const Compared ours = covered_samples(reconstructed(scan, grid, rate), exact, 29);
      const std::vector<double> truth = exact.at(ours.points);
      double worst = 0;
      for (std::size_t i = 0; i < truth.size(); ++i)
        worst = std::max(worst, std::abs(ours.values[i] - truth[i]));
      // An eighth of the second derivative along each axis; Bernstein: pi^2 of the largest value.
      const double linear = 2 * pi * pi / (8.0 * rate * rate) * sum / (nearest * nearest);
      BOOST_TEST(worst <= linear + rounding(filtered, nearest, slope_of_series(filtered)));
    }
  }
}

BOOST_AUTO_TEST_CASE(a_source_far_away_gives_the_parallel_field) {
  ConeShape shape;
  shape.source_to_axis = 1e6;
  const ProjectionSet cone = noisy_cone(shape);
  ProjectionSet parallel = noise_scan(shape.views, shape.rows, shape.columns, 1, 360);
  const ExactField a(cone, {}), b(parallel, {});
  std::vector<Vec3> points;
  for (int i = 0; i < 60; ++i)
    points.push_back({9 * std::sin(i * 1.7), 8 * std::cos(i * 2.3), 8 * std::sin(i * 0.9)});
  const auto far = a.at(points), limit = b.at(points);
  double worst = 0, low = limit[0], high = limit[0];
  for (std::size_t i = 0; i < far.size(); ++i) {
    worst = std::max(worst, std::abs(far[i] - limit[i]));
    low = std::min(low, limit[i]);
    high = std::max(high, limit[i]);
  }
  // Columns move by t s / R and rows by z s / R, of values whose slope Bernstein bounds; 1 / lambda^2 is off
  // by 2 s / R; the cosine's weight by less than that squared.
  Device device;
  const FilteredScan filtered = filter_cone(device.state(), cone, {});
  double sum = 0;
  for (const double q : filtered.view_max) sum += q;
  const double r = std::hypot(9, 8), z = 8, R = shape.source_to_axis - r;
  BOOST_TEST(worst <= sum * (slope_of_series(filtered) * r * (r + z) + 3 * r) / R);
  // Views do not all err alike: docs/error-bounds.md, section 16, has a quarter of this of Shepp-Logan.
  constexpr double share_of_range = 1e-4;
  BOOST_TEST(worst <= share_of_range * (high - low));
}

BOOST_AUTO_TEST_CASE(vectors_of_any_length_give_the_same) {
  for (const double tilt : {0.0, 2.0}) {
    ConeShape shape;
    // At the rim a third of a vector lies below what is covered.
    shape.rows = 40;
    shape.source_to_axis = 50;
    shape.in_plane_deg = tilt;
    const ProjectionSet scan = noisy_cone(shape);
    Device device;
    opencl::State& state = device.state();
    const FilteredScan filtered = filter_cone(state, scan, {});
    const Grid grid = make_grid(scan, {});
    const Index3 n = grid.samples();
    std::vector<std::vector<float>> results;
    for (const int rate : {1, 2}) {
      const ConeTable table = ConeTables(state, filtered, rate, {1, -1, shape.rows})(0, shape.views);
      const ConeBand band{&grid,
                          0,
                          n[1],
                          0,
                          n[2],
                          std::vector<std::array<std::int32_t, 2>>(static_cast<std::size_t>(n[0] * n[1]),
                                                                   {0, static_cast<std::int32_t>(n[2] - 1)})};
      std::vector<std::vector<float>> by_lanes;
      for (const int lanes : {1, 4, 8, 16}) {
        const std::int64_t stride = 16 * ((n[2] + 15) / 16 + 1);
        opencl::DeviceArray<float> out(state, static_cast<std::uint64_t>(n[0] * n[1] * stride), "out");
        out.fill(0.0f);
        cone_back_project(state, filtered, table, band, out, lanes);
        by_lanes.push_back(out.to_host());
      }
      const ConeCoverage coverage(filtered.views, filtered.geometry.columns, filtered.geometry.rows);
      const std::int64_t chunks = (n[2] + 15) / 16, stride = 16 * (chunks % 2 == 0 ? chunks + 1 : chunks);
      const double allowed =
          2 * rounding(filtered, 0.6, rate == 1 ? slope_of_pixels : slope_of_series(filtered));
      double worst = 0;
      for (std::int64_t y = 0; y < n[1]; ++y)
        for (std::int64_t x = 0; x < n[0]; ++x)
          for (std::int64_t z = 0; z < n[2]; ++z) {
            if (coverage.margin(grid.position({x, y, z})) < 0) continue;
            const auto i = static_cast<std::size_t>((y * n[0] + x) * stride + z);
            for (const auto& other : by_lanes)
              worst = std::max(worst,
                               std::abs(static_cast<double>(other[i]) - static_cast<double>(by_lanes[0][i])));
          }
      BOOST_TEST(worst <= allowed);
    }
  }
}

BOOST_AUTO_TEST_CASE(memory_decides_slabs_and_chunks_and_not_values) {
  ConeShape shape;
  shape.views = 60;
  const ProjectionSet scan = noisy_cone(shape);
  const Grid grid = make_grid(scan, {});
  ReconstructOptions options;
  options.upsampling = 2;
  const auto planes_of = [&](std::uint64_t limit) {
    Device device("", limit);
    std::vector<float> all;
    reconstruct_planes(device, scan, grid, options, [&](std::int64_t, std::span<const float> planes) {
      all.insert(all.end(), planes.begin(), planes.end());
    });
    return all;
  };
  const auto wide = planes_of(0), narrow = planes_of(std::uint64_t{3} << 20);
  BOOST_REQUIRE(wide.size() == narrow.size());
  double worst = 0, largest = 0;
  for (std::size_t i = 0; i < wide.size(); ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(wide[i]) - static_cast<double>(narrow[i])));
    largest = std::max(largest, std::abs(static_cast<double>(wide[i])));
  }
  Device device;
  const FilteredScan filtered = filter_cone(device.state(), scan, {});
  BOOST_TEST(worst <= 2 * rounding(filtered, 0.75, slope_of_series(filtered)));
  BOOST_TEST(largest > 0);
}

// A table has the rows that the planes see: all of the detector for all of the planes, few for one.
BOOST_AUTO_TEST_CASE(some_planes_have_the_samples_that_they_have_among_all) {
  std::vector<ConeShape> shapes;
  for (const auto& [name, orbit] : cone_orbits()) shapes.push_back(orbit);
  ConeShape tall{.views = 40, .rows = 90, .columns = 24, .source_to_axis = 50};
  shapes.push_back(tall);
  tall.in_plane_deg = 2;
  shapes.push_back(tall);
  for (const ConeShape& shape : shapes) {
    const ProjectionSet scan = noisy_cone(shape);
    const Grid grid = make_grid(scan, {});
    const Index3 n = grid.samples();
    Device device;
    const FilteredScan filtered = filter_cone(device.state(), scan, {});
    for (const int upsampling : {1, 2}) {
      const Volume all = reconstructed(scan, grid, upsampling);
      const double allowed =
          2 * rounding(filtered, 0.6, upsampling == 1 ? slope_of_pixels : slope_of_series(filtered));
      double worst = 0, largest = 0;
      for (const std::int64_t first : {std::int64_t{0}, n[2] / 3, n[2] / 2, n[2] - 6}) {
        Grid some = grid;
        some.cells[2] = first == n[2] / 3 ? 5 : 1;
        some.origin[2] = grid.position({0, 0, first})[2];
        const Volume planes = reconstructed(scan, some, upsampling);
        const auto offset = static_cast<std::size_t>(first * n[0] * n[1]);
        for (std::size_t i = 0; i < planes.samples.size(); ++i) {
          const auto expected = static_cast<double>(all.samples[offset + i]);
          worst = std::max(worst, std::abs(static_cast<double>(planes.samples[i]) - expected));
          largest = std::max(largest, std::abs(expected));
        }
      }
      BOOST_TEST(worst <= allowed);
      BOOST_TEST(largest > 5 * allowed);  // else rounding alone would hide samples that are missing
    }
  }
}

BOOST_AUTO_TEST_CASE(a_detector_upside_down_sees_the_same_object) {
  const ConeShape shape;
  const ProjectionSet scan = noisy_cone(shape);
  ProjectionSet turned = scan;
  const auto last = static_cast<double>(shape.rows - 1);
  for (ViewMatrix& m : turned.cone->views)
    for (std::size_t j = 0; j < 4; ++j) m[1][j] = last * m[2][j] - m[1][j];
  for (std::int64_t k = 0; k < shape.views; ++k)
    for (std::int64_t v = 0; v < shape.rows; ++v)
      for (std::int64_t u = 0; u < shape.columns; ++u)
        turned.data[static_cast<std::size_t>((k * shape.rows + v) * shape.columns + u)] =
            scan.data[static_cast<std::size_t>((k * shape.rows + shape.rows - 1 - v) * shape.columns + u)];
  const Grid grid = make_grid(scan, {});
  const Volume a = reconstructed(scan, grid, 1), b = reconstructed(turned, grid, 1);
  Device device;
  const double allowed = 2 * rounding(filter_cone(device.state(), scan, {}), 0.75, slope_of_pixels);
  double worst = 0;
  for (std::size_t i = 0; i < a.samples.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>(a.samples[i]) - static_cast<double>(b.samples[i])));
  BOOST_TEST(worst <= allowed);
}

// A displaced detector sees a ball in halves, and finds its density.
BOOST_AUTO_TEST_CASE(a_displaced_detector_is_read_where_its_columns_are) {
  SimulateOptions options;
  options.angles = 180;
  options.arc_deg = 360;
  options.columns = 32;
  options.rows = 24;
  options.band_limited = false;
  options.cone.emplace();
  options.cone->source_to_axis = options.cone->source_to_detector = 120;
  for (const double offset : {6.0, -6.0}) {
    options.cone->detector_offset = offset;
    const ProjectionSet scan = simulate(sphere(9), options);
    BOOST_TEST((scan.cone->redundancy == Redundancy::displaced));
    const Volume volume = reconstructed(scan, make_grid(scan, {}), 2);
    const Index3 n = volume.grid.samples();
    double sum = 0, count = 0;
    for (std::int64_t z = 0; z < n[2]; ++z)
      for (std::int64_t y = 0; y < n[1]; ++y)
        for (std::int64_t x = 0; x < n[0]; ++x) {
          const Vec3 p = volume.grid.position({x, y, z});
          if (std::hypot(p[0], p[1], p[2]) > 5) continue;
          sum += static_cast<double>(volume.samples[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)]);
          count += 1;
        }
    // FDK keeps the mean of a ball near the orbit's plane to a few thousandths (docs/geometry.md); the ramp's
    // sampling costs as much. A column's shift loses tenths.
    BOOST_TEST(count > 300);
    constexpr double percent = 0.01;
    BOOST_TEST(std::abs(sum / count - 1) <= percent);
  }
}

BOOST_AUTO_TEST_CASE(units_of_metres_change_nothing_but_units) {
  ConeShape shape;
  shape.in_plane_deg = 2;
  ProjectionSet scan = noisy_cone(shape), metres = scan;
  constexpr double scale = 0x1p-20;
  for (ViewMatrix& m : metres.cone->views)
    for (auto& row : m)
      for (std::size_t a = 0; a < 3; ++a) row[a] /= scale;
  metres.geometry = parallel_limit(*metres.cone, shape.columns, shape.rows, "m");
  const Volume a = reconstructed(scan, make_grid(scan, {}), 1),
               b = reconstructed(metres, make_grid(metres, {}), 1);
  BOOST_REQUIRE(a.samples.size() == b.samples.size());
  for (std::size_t i = 0; i < a.samples.size(); ++i)
    BOOST_REQUIRE(a.samples[i] == static_cast<float>(static_cast<double>(b.samples[i]) * scale));
}

BOOST_AUTO_TEST_CASE(covered_is_a_cylinder_with_two_cones_cut_into_it) {
  ConeShape shape;
  shape.views = 720;
  const ProjectionSet scan = noisy_cone(shape);
  const ExactField exact(noisy_cone(ConeShape{}), {});
  const ConeCoverage coverage = cone_coverage(scan, {});
  const double R = shape.source_to_axis, edge = 0.5 * static_cast<double>(shape.columns),
               top = 0.5 * static_cast<double>(shape.rows - 1);
  // The region adds a billionth of a pixel, of pitch 1 here, to the distance from a plane
  // (cone_coverage.cpp). Along z that is less than two of them, since planes rise by less than 45 degrees;
  // and of two heights it is twice. What is left is far more than rounding.
  constexpr double slack = 4e-9;
  // Of a full circle; with finitely many views the region reaches out by less than 1 - cos of half a gap.
  const double radius = R * std::sin(std::atan(edge / R)),
               more = radius * (1 / std::cos(pi / 720) - 1) + slack;
  BOOST_TEST(coverage.inner_radius() >= radius - slack);
  BOOST_TEST(coverage.inner_radius() <= radius + more);
  for (int i = 0; i < 200; ++i) {
    const double r = radius * i / 200, angle = i * 2.4;
    const auto [low, high] = coverage.heights(r * std::cos(angle), r * std::sin(angle), 0);
    const double height = top * (1 - r / R);
    BOOST_TEST(high >= height - slack);
    BOOST_TEST(high <= height + top * (r / R) * (1 - std::cos(pi / 720)) + slack);
    BOOST_TEST(std::abs(low + high) <= slack + top * (r / R) * (1 - std::cos(pi / 720)));
  }
}

BOOST_AUTO_TEST_CASE(what_is_for_parallel_beam_refuses_cone_beam) {
  const ProjectionSet scan = noisy_cone({});
  Device device;
  BOOST_CHECK_THROW(static_cast<void>(filter_projections(device.state(), scan, {})), InputError);
  BOOST_CHECK_THROW(D2vrField(device, scan, {}, {}), InputError);
}
