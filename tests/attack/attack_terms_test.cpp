#define BOOST_TEST_MODULE attack_terms
#include <boost/test/unit_test.hpp>

#include <random>

#include "host/certify/bounds/amplitude_bounds.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/attack_scans.hpp"
#include "tests/support/exact_columns.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"

// The terms before gold one by one, each where it dominates: sups, amplitudes, filter, upsampling, summation,
// position. Without slack.
using namespace vdvr;
using namespace vdvr::attacks;

namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

struct Arithmetic {
  double error = 0, bound = 0;
};

// The largest |computed - exact| over a block of columns at one detector row, both with the same
// interpolation; `truth` are the samples that exact arithmetic starts from.
Arithmetic measure(const FilteredScan& filtered, std::span<const float> truth, int upsampling,
                   Interpolation interpolation, const ColumnBlocks& blocks, double row) {
  opencl::State& state = device().state();
  Upsampler upsampler(state, filtered);
  const FieldSups sups = field_sups(state, upsampler, filtered);
  const UpsampledColumns columns = upsampled_columns(filtered.geometry.columns, upsampling, 3);
  const UpsampledSlab slab = upsampler(columns, std::array{row});
  const opencl::DeviceArray<float> out(
      state, static_cast<std::uint64_t>(blocks.nx * blocks.ny * column_stride(1)), "columns");
  back_project(state, filtered.geometry, slab, blocks, interpolation,
               const_cast<opencl::DeviceArray<float>&>(out));
  const auto host = out.to_host();
  const ExactColumns exact(filtered.geometry, columns, truth, row);
  Arithmetic a;
  a.bound = arithmetic_bound(upsampler, filtered, sups, columns, blocks, interpolation);
  for (std::int64_t y = 0; y < blocks.ny; ++y)
    for (std::int64_t x = 0; x < blocks.nx; ++x) {
      const double e =
          exact.back_projected(blocks.first[0][0] + static_cast<double>(x) * blocks.step_x,
                               blocks.first[0][1] + static_cast<double>(y) * blocks.step_y, interpolation);
      a.error = std::max(a.error,
                         std::abs(static_cast<double>(host[at((y * blocks.nx + x) * column_stride(1))]) - e));
    }
  return a;
}

void expect(const Arithmetic& a, const std::string& what) {
  BOOST_TEST_MESSAGE("  " << what << ": error / bound " << a.error / a.bound);
  BOOST_TEST(a.error <= tolerance::bound(a.bound), what << ": error " << a.error << ", bound " << a.bound);
}

// The sum over views of the largest error of a filtered sample, against direct convolution in double
// precision.
double filter_error(const FilteredScan& filtered, const ProjectionSet& scan) {
  constexpr double pi = std::numbers::pi;
  const ParallelGeometry& g = scan.geometry;
  const auto kernel = [&](std::size_t d) {
    if (d == 0) return 1 / (4 * g.pitch_u);
    return d % 2 == 1 ? -1 / (pi * pi * static_cast<double>(d * d) * g.pitch_u) : 0.0;
  };
  const ViewWeights weights = view_weights(g.theta_rad);
  double total = 0;
  for (std::size_t k = 0; k < at(g.views()); ++k) {
    double worst = 0;
    for (std::size_t v = 0; v < at(g.rows); ++v)
      for (std::size_t u = 0; u < at(g.columns); ++u) {
        double sum = 0;
        for (std::size_t m = 0; m < at(g.columns); ++m)
          sum += kernel(u > m ? u - m : m - u) *
                 static_cast<double>(scan.data[(k * at(g.rows) + v) * at(g.columns) + m]);
        const auto device = static_cast<double>(filtered.samples[(k * at(g.columns) + u) * at(g.rows) + v]);
        const double error = std::abs(sum * weights.weight[k] - device);
        if (!(error <= worst)) worst = error;
      }
    total += worst;
  }
  return total;
}

}  // namespace

BOOST_AUTO_TEST_CASE(sups_hold_where_a_peak_lies_between_their_samples) {
  // field_sups samples 4 times denser than the detector: a peak in the middle of those columns is what it
  // misses most.
  for (const int upsampling : {4, 8, 16})
    for (const std::size_t low : {1u, 12u, 20u, 23u})
      for (const double sign : {1.0, -1.0}) {
        const Scan scan = axis_peak(upsampling, low, sign, true);
        Chain chain(scan.data);
        const ParallelGeometry& g = scan.data.geometry;
        double value = 0, second = 0;
        const std::array place{g.center};
        for (const auto& [order, total] : {std::pair{0, &value}, {2, &second}}) {
          const auto weights = resampling_matrix(g.columns, place, order, g.pitch_u, 0);
          for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
            double sum = 0;  // the scan does not vary along v
            for (std::size_t u = 0; u < at(g.columns); ++u)
              sum += weights[u] *
                     static_cast<double>(chain.filtered.samples[(k * at(g.columns) + u) * at(g.rows)]);
            *total += std::abs(sum);
          }
        }
        BOOST_TEST(value <= tolerance::bound(chain.sups.value), scan.name << ", columns " << upsampling);
        BOOST_TEST(second <= tolerance::bound(chain.sups.second_u),
                   scan.name << ", columns " << upsampling << ": " << second << " > " << chain.sups.second_u);
      }
}

// Projections not upsampled at all: linear interpolation between the detector's own columns.
BOOST_AUTO_TEST_CASE(amplitude_bound_of_projections_holds_at_1x) {
  double closest = 0;
  for (std::size_t m = 0; m < 24; ++m)
    for (const std::size_t l : {0u, 1u, 3u}) {
      const Scan scan = wave(m, l, 2, 1);
      const ParallelGeometry& g = scan.data.geometry;
      const FilteredScan filtered = filter_projections(device().state(), scan.data, {});
      const double bound = amplitude_bounds(filtered, Grid{{1, 1, 1}}, {1}).projection[0].second;
      // The worst place of every view apart: rows at the detector's own and between, fractions of a column.
      double sum = 0;
      for (std::size_t k = 0; k < at(g.views()); ++k) {
        double worst = 0;
        for (const double row : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0})
          for (const double f : {0.25, 0.5, 0.75}) {
            const ExactColumns q(g, {1, 0, 0, g.columns}, filtered.samples, row),
                between(g, {1, f, 0, g.columns}, filtered.samples, row);
            for (std::int64_t n = 0; n + 1 < g.columns; ++n)
              worst = std::max(worst, std::abs((1 - f) * q(k, n) + f * q(k, n + 1) - between(k, n)));
          }
        sum += worst;
        if (k == 2) break;  // all views hold the same wave: three of them
      }
      sum *= static_cast<double>(g.views()) / 3;
      if (m > 0) closest = std::max(closest, sum / bound);
      // The views differ by the filter's rounding.
      BOOST_TEST(sum <= tolerance::bound(bound) + 8 * filtered.ramp_error,
                 scan.name << ": " << sum << " > " << bound);
    }
  BOOST_TEST_MESSAGE("  amplitude of projections at 1x: error / bound " << closest);
}

// Every way to filter, with its name.
struct Filtering {
  FilterMethod method;
  Precision precision;
  const char* name;
};
const Filtering filterings[] = {{FilterMethod::fourier, Precision::fp32, "FFT"},
                                {FilterMethod::product, Precision::fp32, "product"},
                                {FilterMethod::fourier, Precision::fp64, "FFT in double"},
                                {FilterMethod::product, Precision::fp64, "product in double"},
                                {FilterMethod::host, Precision::fp64, "host"}};

BOOST_AUTO_TEST_CASE(filter_error_is_never_above_what_is_charged) {
  for (const Filtering& f : filterings) {
    double closest = 0;
    for (const Scan& scan : awkward_scans()) {
      const FilteredScan filtered =
          filter_projections(device().state(), scan.data, {}, {}, f.method, f.precision);
      const double error = filter_error(filtered, scan.data);
      if (error > 0) closest = std::max(closest, error / filtered.ramp_error);
      BOOST_TEST(error <= tolerance::bound(filtered.ramp_error),
                 scan.name << ", " << f.name << ": " << error << " > " << filtered.ramp_error);
    }
    BOOST_TEST_MESSAGE("  filter, " << f.name << ": error / bound " << closest);
  }
}

BOOST_AUTO_TEST_CASE(scans_beyond_the_range_of_fp32_are_refused_or_bounded) {
  for (const Filtering& f : filterings)
    for (const double scale : {1e-40, 1e38, 3e38}) {
      ProjectionSet scan = noise(geometry(11, 4, 24), 6, scale);
      scan.geometry.pitch_u = scale > 1e38 ? 0.01 : 1;  // filtered samples 25 times as large as the scan's
      try {
        const FilteredScan filtered =
            filter_projections(device().state(), scan, {}, {}, f.method, f.precision);
        const double error = filter_error(filtered, scan);
        BOOST_TEST(error <= tolerance::bound(filtered.ramp_error),
                   "noise of " << scale << ", " << f.name << ": " << error << " > " << filtered.ramp_error);
      } catch (const InputError&) {
        BOOST_TEST(true);  // refused
      }
    }
}

// Computed gold against the same interpolation of the same filtered samples, in double precision.
BOOST_AUTO_TEST_CASE(arithmetic_covers_gold_of_awkward_scans) {
  double closest = 0;
  int turn = 0;
  for (const Scan& scan : awkward_scans()) {
    FilteredScan filtered = filter_projections(device().state(), scan.data, {});
    filtered.ramp_error = 0;                        // what is tested starts from the filtered samples
    if (filtered.view_max[0] < 0x1p-100) continue;  // attacked with the filter
    for (const Interpolation filter : all_filters) {
      const int upsampling = filter == Interpolation::six_taps ? 8 : 2 << (turn++ % 4);
      const ColumnBlocks block{3, 3, 0.37, 0.41, {{scan.target[0] - 0.5, scan.target[1] - 0.4}}, {}};
      const double row = scan.target[2] / scan.data.geometry.pitch_v +
                         0.5 * static_cast<double>(scan.data.geometry.rows - 1);
      const Arithmetic a = measure(filtered, filtered.samples, upsampling, filter, block, row);
      if (a.error > 0) closest = std::max(closest, a.error / a.bound);
      BOOST_TEST(a.error <= tolerance::bound(a.bound), scan.name << ", " << text_of(filter) << " "
                                                                 << upsampling << ": error " << a.error
                                                                 << ", bound " << a.bound);
    }
  }
  BOOST_TEST_MESSAGE("  gold of awkward scans: error / bound " << closest);
}

BOOST_AUTO_TEST_CASE(arithmetic_covers_errors_of_the_filtered_samples) {
  // Every sample wrong by e, with the signs that add up where the error is read.
  const ParallelGeometry g = geometry(5, 4, 24);
  const double e = 0x1p-10;
  for (const int upsampling : {2, 8})
    for (const Interpolation filter : all_filters)
      for (const double row : {1.5, 0.5, 3.4}) {
        if (!serves(upsampling, filter)) continue;
        const double place = middle_of_column(g.center, upsampling) + 0.5 / upsampling;  // on a column
        const auto wu = resampling_matrix(g.columns, std::array{place}, 0, 1, 0),
                   wv = resampling_matrix(g.rows, std::array{row}, 0, 1, 0);
        ParallelGeometry used = g;
        used.center = place;
        const FilteredScan right = given_samples(used, [](auto k, auto v, auto u) {
          return std::cos(static_cast<double>(7 * k + 3 * v + 5 * u));
        });
        FilteredScan wrong = given_samples(used, [&](std::size_t k, std::size_t v, std::size_t u) {
          return static_cast<double>(right.samples[(k * at(g.columns) + u) * at(g.rows) + v]) +
                 e * (wu[u] * wv[v] < 0 ? -1.0 : 1.0);
        });
        double largest = 0;
        for (std::size_t i = 0; i < wrong.samples.size(); ++i)
          largest = std::max(largest, std::abs(static_cast<double>(wrong.samples[i]) -
                                               static_cast<double>(right.samples[i])));
        wrong.ramp_error = largest * static_cast<double>(g.views());
        expect(measure(wrong, right.samples, upsampling, filter, {1, 1, 1, 1, {{0, 0}}, {}}, row),
               "filter, " + std::string(text_of(filter)) + " " + std::to_string(upsampling) + ", row " +
                   std::to_string(row));
      }
}

BOOST_AUTO_TEST_CASE(arithmetic_covers_the_product_along_rows_alone) {
  // At rate 1 the product along columns is the identity: with no sups given, what is charged is the product
  // along rows.
  for (const std::int64_t rows : {2, 7, 33, 129, 513}) {
    const ParallelGeometry g = geometry(1, rows, 2);
    for (const unsigned seed : {1u, 2u, 3u}) {
      std::mt19937 random(seed);
      const FilteredScan f = given_samples(
          g, [&](auto, auto, auto) { return 1 + 0x1p-12 * static_cast<double>(random() % 4096); });
      Upsampler upsampler(device().state(), f);
      const UpsampledColumns columns = upsampled_columns(g.columns, 2, 0),
                             own = upsampled_columns(g.columns, 1, 0);
      std::vector<double> positions;
      for (int i = 0; i < 16; ++i)
        positions.push_back(static_cast<double>(rows - 1) * (0.031 + 0.06 * static_cast<double>(i)));
      const UpsampledSlab slab = upsampler(own, positions);
      const auto host = slab.values.to_host();
      Arithmetic a;
      a.bound = arithmetic_bound(upsampler, f, FieldSups{}, columns, {1, 1, 1, 1, {{0, 0}}, {}},
                                 Interpolation::linear);
      for (std::size_t z = 0; z < 16; ++z) {
        const ExactColumns exact(g, own, f.samples, positions[z]);
        for (std::int64_t n = 0; n < own.count; ++n)
          a.error = std::max(a.error, std::abs(static_cast<double>(host[at(n) * 16 + z]) - exact(0, n)));
      }
      expect(a, "product along " + std::to_string(rows) + " rows");
    }
  }
}

BOOST_AUTO_TEST_CASE(arithmetic_covers_long_biased_sums) {
  // Equal terms: while the sum stays between two powers of two, every addition rounds the same way. Of 65536
  // views it is the sums of runs whose addition counts.
  for (const std::int64_t views : {8192, 65536}) {
    ParallelGeometry g = geometry(views, 1, 8);
    g.center = 4 - 0.5;  // on a column of every rate: the second term of each view is 0
    for (const Interpolation filter : all_filters)
      for (const double term : {1.9999, 1.75, 1.3337, 1.2501, 1.0626}) {
        if (views > 8192 && term != 1.75) continue;
        const FilteredScan f = given_samples(
            g, [&](auto, auto, auto) { return term / static_cast<double>(views) * (1 + 0x1p-13); });
        const int upsampling = filter == Interpolation::six_taps ? 8 : 2;
        expect(measure(f, f.samples, upsampling, filter, {1, 1, 0.01, 0.01, {{0, 0}}, {}}, 0),
               std::string("summation of ") + std::to_string(views) + " views, " + text_of(filter) + ", " +
                   std::to_string(term));
      }
  }
}

BOOST_AUTO_TEST_CASE(arithmetic_covers_positions_far_from_the_block_corner) {
  // A wide block at the detector's Nyquist frequency: a position that is wrong by a rounding costs the whole
  // slope.
  constexpr std::int64_t columns = 2048;
  ParallelGeometry g = geometry(2, 1, columns);
  g.theta_rad = {0.1234, 1.3};
  for (const Interpolation filter : all_filters)
    for (const std::size_t m : {2047u, 1500u}) {
      const FilteredScan f = given_samples(g, [&](auto, auto, std::size_t u) {
        return std::sin(reference::frequency(m, columns) * (static_cast<double>(u) + 0.5) + 0.1);
      });
      expect(measure(f, f.samples, filter == Interpolation::six_taps ? 8 : 2, filter,
                     {40, 40, 34.987, 33.311, {{-680.1, -650.3}}, {}}, 0),
             std::string("position, ") + text_of(filter) + ", wave " + std::to_string(m));
    }
}
