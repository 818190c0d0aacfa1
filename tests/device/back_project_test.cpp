#define BOOST_TEST_MODULE back_project
#include "host/field/fbp/back_project.hpp"

#include <boost/test/unit_test.hpp>

#include "host/base/opencl/kernel.hpp"
#include "host/certify/bounds/projection_bounds.hpp"
#include "host/certify/bounds/column_taps.hpp"
#include "tests/reference/back_project.hpp"
#include "tests/reference/cosine_series.hpp"
#include "tests/reference/ramp_filter.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;
using vdvr::testing::noise_scan;

namespace {

reference::UpsampledViews read_back(const UpsampledSlab& slab) {
  reference::UpsampledViews q{slab.columns, slab.views, slab.rows, {}};
  const auto values = slab.values.to_host();
  for (std::int64_t k = 0; k < slab.views; ++k)
    for (std::int64_t n = 0; n < slab.columns.count; ++n)
      for (std::int64_t z = 0; z < slab.rows; ++z)
        q.values.push_back(static_cast<double>(values[static_cast<std::size_t>(
            ((z / 16 * slab.views + k) * slab.columns.count + n) * 16 + z % 16)]));
  return q;
}

constexpr Interpolation all_filters[] = {Interpolation::linear, Interpolation::cubic,
                                         Interpolation::six_taps};

int taps_of(Interpolation filter) {
  return filter == Interpolation::six_taps ? 6 : filter == Interpolation::cubic ? 4 : 2;
}

std::vector<double> rows_of(std::int64_t rows, std::int64_t count) {
  std::vector<double> z;
  for (std::int64_t i = 0; i < count; ++i)
    z.push_back(static_cast<double>(i * rows) / static_cast<double>(count) - 0.4);
  return z;
}

float sample_of(const std::vector<float>& out, const ColumnBlocks& blocks, std::int64_t rows, std::size_t b,
                std::int64_t y, std::int64_t x, std::int64_t z) {
  const std::int64_t column = (static_cast<std::int64_t>(b) * blocks.ny + y) * blocks.nx + x;
  return out[static_cast<std::size_t>(column * column_stride(rows) + z)];
}

// Calls visit(x, y in world units, z row, computed) for every sample of every block.
template <class Visit>
void for_each_sample(const std::vector<float>& out, const ColumnBlocks& blocks, std::int64_t rows,
                     Visit&& visit) {
  for (std::size_t b = 0; b < blocks.first.size(); ++b)
    for (std::int64_t y = 0; y < blocks.ny; ++y)
      for (std::int64_t x = 0; x < blocks.nx; ++x)
        for (std::int64_t z = 0; z < rows; ++z)
          visit(blocks.first[b][0] + static_cast<double>(x) * blocks.step_x,
                blocks.first[b][1] + static_cast<double>(y) * blocks.step_y, z,
                static_cast<double>(sample_of(out, blocks, rows, b, y, x, z)));
}

std::uint64_t floats_of(const ColumnBlocks& blocks, std::int64_t rows) {
  return blocks.first.size() * static_cast<std::uint64_t>(blocks.nx * blocks.ny * column_stride(rows));
}

// Device against the naive reference on the device's own slab.
void check_reference(const ProjectionSet& scan, int rate, Interpolation filter, const ColumnBlocks& blocks,
                     std::int64_t rows) {
  Device device;
  const FilteredScan filtered = filter_projections(device.state(), scan, {});
  Upsampler upsampler(device.state(), filtered);
  const UpsampledSlab slab =
      upsampler(upsampled_columns(scan.geometry.columns, rate, 2.0), rows_of(scan.geometry.rows, rows));
  opencl::DeviceArray<float> out(device.state(), floats_of(blocks, rows), "columns");
  back_project(device.state(), filtered.geometry, slab, blocks, filter, out);
  const auto q = read_back(slab);
  // A fused multiply-add per weight and view; cubic weights round up to 8 times themselves.
  // Those of six are known as a sum (column_taps.hpp), of samples that do not exceed the largest.
  const std::int64_t roundings = taps_of(filter) * slab.views + 8;
  const double weights = filter == Interpolation::six_taps ? six_tap_facts().rounding : 0;
  const double position = position_error(filtered.geometry, slab.columns, blocks);
  std::int64_t compared = 0, wrong = 0;
  for_each_sample(out.to_host(), blocks, rows, [&](double x, double y, std::int64_t z, double computed) {
    const auto expected = reference::back_project(q, filtered.geometry, x, y, z, filter);
    if (!expected.inside) return;
    ++compared;
    if (!(std::abs(computed - expected.value) <= tolerance::fp32_sum(roundings, expected.magnitude) +
                                                     position * expected.slope + expected.jump +
                                                     weights * expected.largest))
      ++wrong;
  });
  BOOST_TEST(wrong == 0);
  BOOST_TEST(compared > 0);
}

// Double precision from the projections on: convolution, cosine series at the upsampled columns and rows.
reference::UpsampledViews exact_views(const ProjectionSet& scan, const UpsampledColumns& columns,
                                      const std::vector<double>& rows) {
  const auto U = static_cast<std::size_t>(scan.geometry.columns),
             V = static_cast<std::size_t>(scan.geometry.rows);
  const auto filtered = reference::ramp_filtered(scan);
  reference::UpsampledViews q{columns, scan.geometry.views(), static_cast<std::int64_t>(rows.size()), {}};
  for (std::size_t k = 0; k < static_cast<std::size_t>(q.views); ++k) {
    std::vector<std::vector<double>> at_row(rows.size(), std::vector<double>(U));
    for (std::size_t u = 0; u < U; ++u) {
      const auto a = reference::cosine_coefficients(std::span(filtered).subspan((k * U + u) * V, V));
      for (std::size_t z = 0; z < rows.size(); ++z) at_row[z][u] = reference::cosine_series(a, rows[z]);
    }
    for (auto& row : at_row) row = reference::cosine_coefficients(row);
    for (std::int64_t n = 0; n < columns.count; ++n)
      for (const auto& row : at_row) q.values.push_back(reference::cosine_series(row, columns.position(n)));
  }
  return q;
}

std::vector<float> with_tuning(opencl::State& state, const ParallelGeometry& g, const UpsampledSlab& slab,
                               const ColumnBlocks& blocks, Interpolation filter, const ColumnTuning& tuning) {
  opencl::DeviceArray<float> out(state, floats_of(blocks, slab.rows), "columns");
  out.fill(0.0f);
  back_project(state, g, slab, blocks, filter, out, tuning);
  return out.to_host();
}

}  // namespace

BOOST_AUTO_TEST_CASE(back_project_matches_reference_over_odd_extents) {
  for (const Interpolation filter : all_filters)
    for (const auto& [views, rows, columns] : {std::array{1, 1, 9}, {7, 3, 31}, {19, 5, 24}})
      for (const auto& [nx, ny, nz] :
           {std::array<std::int64_t, 3>{1, 1, 1}, {3, 5, 17}, {13, 2, 33}, {7, 9, 48}})
        check_reference(
            noise_scan(views, rows, columns), 4, filter,
            {nx,
             ny,
             0.31,
             0.47,
             {{-0.5 * static_cast<double>(nx - 1) * 0.31, -0.5 * static_cast<double>(ny - 1) * 0.47}}},
            nz);
}

BOOST_AUTO_TEST_CASE(several_blocks_match_reference_wherever_they_lie) {
  const ProjectionSet scan = noise_scan(11, 3, 27);
  for (const Interpolation filter : all_filters)
    check_reference(scan, 8, filter, {5, 7, 0.25, 0.25, {{0, 0}, {-9.3, 2.1}, {4.0, -8.7}, {1e-3, 5.5}}}, 9);
}

BOOST_AUTO_TEST_CASE(blocks_beyond_the_detector_match_where_all_views_are_hit_and_stay_finite) {
  const ProjectionSet scan = noise_scan(6, 2, 15);
  for (const Interpolation filter : all_filters) {
    const ColumnBlocks blocks{33, 29, 1.0, 1.0, {{-16, -14}, {-4, -40}}};
    check_reference(scan, 2, filter, blocks, 5);
    Device device;
    const FilteredScan filtered = filter_projections(device.state(), scan, {});
    Upsampler upsampler(device.state(), filtered);
    const UpsampledSlab slab = upsampler(upsampled_columns(15, 2, 0.0), rows_of(2, 5));
    opencl::DeviceArray<float> out(device.state(), floats_of(blocks, 5), "columns");
    back_project(device.state(), filtered.geometry, slab, blocks, filter, out);
    bool finite = true;
    for_each_sample(out.to_host(), blocks, 5,
                    [&](double, double, std::int64_t, double v) { finite = finite && std::isfinite(v); });
    BOOST_TEST(finite);
  }
}

BOOST_AUTO_TEST_CASE(off_centre_axis_and_pitch_follow_the_geometry) {
  ProjectionSet scan = noise_scan(9, 3, 25);
  scan.geometry.center = 10.3;
  scan.geometry.pitch_u = 0.1;
  for (const Interpolation filter : all_filters)
    check_reference(scan, 4, filter, {9, 9, 0.03, 0.05, {{-0.13, -0.22}, {0.2, 0.3}}}, 6);
}

BOOST_AUTO_TEST_CASE(arithmetic_bound_is_never_exceeded) {
  for (const Interpolation filter : all_filters)
    for (const int rate : {filter == Interpolation::six_taps ? 16 : 2, 8})
      for (const auto& [views, rows, columns] : {std::array{13, 1, 24}, {17, 6, 33}}) {
        const ProjectionSet scan = noise_scan(views, rows, columns, static_cast<unsigned>(views + rate));
        Device device;
        const FilteredScan filtered = filter_projections(device.state(), scan, {});
        Upsampler upsampler(device.state(), filtered);
        const UpsampledColumns upsampled = upsampled_columns(columns, rate, 1.0);
        const FieldSups sups = field_sups(device.state(), upsampler, filtered);
        const std::int64_t nz = 7;
        const auto z = rows_of(rows, nz);
        const ColumnBlocks blocks{21, 23, 0.5, 0.45, {{-5.1, -5.3}, {-9, 1}}};
        const UpsampledSlab slab = upsampler(upsampled, z);
        opencl::DeviceArray<float> out(device.state(), floats_of(blocks, nz), "columns");
        back_project(device.state(), filtered.geometry, slab, blocks, filter, out);
        const double bound = arithmetic_bound(upsampler, filtered, sups, upsampled, blocks, filter);
        const auto q = exact_views(scan, upsampled, z);
        double worst = 0;
        for_each_sample(out.to_host(), blocks, nz, [&](double x, double y, std::int64_t k, double computed) {
          const auto expected = reference::back_project(q, filtered.geometry, x, y, k, filter);
          if (expected.inside) worst = std::max(worst, std::abs(computed - expected.value));
        });
        BOOST_TEST(worst > 0);
        BOOST_TEST(worst <= tolerance::bound(bound));
      }
}

BOOST_AUTO_TEST_CASE(tuning_never_changes_the_result) {
  const ProjectionSet scan = noise_scan(13, 4, 23);
  Device device;
  const FilteredScan filtered = filter_projections(device.state(), scan, {});
  Upsampler upsampler(device.state(), filtered);
  const UpsampledSlab slab =
      upsampler(upsampled_columns(23, 4, 1.0), rows_of(4, 37));  // three vectors: an odd number
  const ColumnBlocks blocks{11, 7, 0.5, 0.6, {{-2.5, -2}, {1, -3}, {-6, 0.3}}};
  const auto q = read_back(slab);
  double magnitude = 0;
  for (const double v : q.values) magnitude = std::max(magnitude, std::abs(v));
  magnitude *= static_cast<double>(slab.views);
  // Twice what positions may do, of slopes in columns and of sums that are largest with six weights.
  // Positions are the same to the bit in all tilings, so that none finds itself on the other side of a
  // column.
  const ColumnTaps& six = six_tap_facts();
  const double moved = 2 * position_error(filtered.geometry, slab.columns, blocks) * magnitude;
  for (const Interpolation filter : all_filters) {
    const auto run = [&](const ColumnTuning& tuning) {
      return with_tuning(device.state(), filtered.geometry, slab, blocks, filter, tuning);
    };
    std::vector<std::vector<float>> all{run(column_tuning(device.info()))};
    for (const int lanes : {1, 4, 8, 16})
      for (const int tile : {1, 8})
        for (const int vectors : {1, 2})
          all.push_back(run({.lanes = lanes, .tile = tile, .vectors = vectors, .local = {1, 2, 2}}));
    for (const int tile : {1, 8})
      for (const int tiles : {2, 8})
        all.push_back(run({.lanes = 16, .tile = tile, .vectors = 2, .tiles = tiles, .local = {1, 1, 1}}));
    const auto& first = all.front();
    for (const auto& other : all) {
      double worst = 0;
      for (std::size_t b = 0; b < blocks.first.size(); ++b)
        for (std::int64_t y = 0; y < blocks.ny; ++y)
          for (std::int64_t x = 0; x < blocks.nx; ++x)
            for (std::int64_t z = 0; z < slab.rows; ++z)
              worst = std::max(
                  worst, std::abs(static_cast<double>(sample_of(first, blocks, slab.rows, b, y, x, z)) -
                                  static_cast<double>(sample_of(other, blocks, slab.rows, b, y, x, z))));
      const bool of_six = filter == Interpolation::six_taps;
      BOOST_TEST(worst <= tolerance::fp32_sum(taps_of(filter) * slab.views + 8, six.norm * magnitude) +
                              moved * (2 * six.slope + six.slope_sum) +
                              (of_six ? 2 * six.rounding * magnitude : 0.0));
    }
  }
}
