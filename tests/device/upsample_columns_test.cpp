#define BOOST_TEST_MODULE upsample_columns
#include "host/field/fbp/upsample_columns.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numeric>

#include "host/certify/bounds/projection_bounds.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;

namespace {

struct Case {
  std::int64_t columns, rows, views;
  int rate;
  double margin;
};

double uniform(std::uint64_t n) {
  n = (n ^ (n >> 31)) * 0x9e3779b97f4a7c15u;
  n = (n ^ (n >> 29)) * 0xbf58476d1ce4e5b9u;
  return static_cast<double>((n ^ (n >> 32)) >> 11) * 0x1p-52 - 1;
}

// Rows of noise, the highest frequency, a single spike, the signs that interpolation grows most, and zeros.
double sample(const Case& c, std::int64_t k, std::int64_t u, std::int64_t v) {
  switch (v % 5) {
    case 0:
      return uniform(static_cast<std::uint64_t>((k * c.columns + u) * c.rows + v));
    case 1:
      return u % 2 == 0 ? 1 : -1;
    case 2:
      return u == (7 * v + 3 * k) % c.columns ? 1 : 0;
    case 3:
      return (u % 2 == 0) == (2 * u < c.columns) ? 1 : -1;
    default:
      return 0;
  }
}

FilteredScan scan_of(const Case& c) {
  FilteredScan scan;
  scan.geometry.rows = c.rows;
  scan.geometry.columns = c.columns;
  scan.geometry.theta_rad.assign(static_cast<std::size_t>(c.views), 0.0);
  for (std::int64_t k = 0; k < c.views; ++k) {
    double largest = 0;
    for (std::int64_t u = 0; u < c.columns; ++u)
      for (std::int64_t v = 0; v < c.rows; ++v) {
        scan.samples.push_back(static_cast<float>(sample(c, k, u, v)));
        largest = std::max(largest, std::abs(static_cast<double>(scan.samples.back())));
      }
    scan.view_max.push_back(largest);
  }
  return scan;
}

// Every row against its cosine series, summed directly in double precision: relative to the bound.
void check(const Case& c) {
  Device device;
  opencl::State& state = device.state();
  const FilteredScan scan = scan_of(c);
  Upsampler upsampler(state, scan, ColumnMethod::accurate);
  const UpsampledColumns columns = upsampled_columns(c.columns, c.rate, c.margin);
  BOOST_REQUIRE(upsampler.transforms(columns) == ColumnUpsampling::is_possible(state));
  std::vector<double> rows(static_cast<std::size_t>(c.rows));
  std::iota(rows.begin(), rows.end(), 0.0);
  const UpsampledSlab slab = upsampler(columns, rows);
  const std::vector<float> values = slab.values.to_host();

  std::vector<double> positions;
  for (std::int64_t j = 0; j < columns.count; ++j) positions.push_back(columns.position(j));
  const std::vector<double> matrix = resampling_matrix(c.columns, positions, 0, 1, c.rate);
  double worst = 0;
  for (std::int64_t k = 0; k < c.views; ++k)
    for (std::int64_t v = 0; v < c.rows; ++v) {
      // Rows share transforms: what one errs by goes with the largest of its view.
      const double largest = scan.view_max[static_cast<std::size_t>(k)];
      double sup = 0, error = 0;
      std::vector<double> exact(positions.size(), 0.0);
      for (std::int64_t u = 0; u < c.columns; ++u) {
        const double q = scan.samples[static_cast<std::size_t>((k * c.columns + u) * c.rows + v)];
        for (std::size_t j = 0; j < exact.size(); ++j)
          exact[j] += matrix[j * static_cast<std::size_t>(c.columns) + static_cast<std::size_t>(u)] * q;
      }
      for (std::size_t j = 0; j < exact.size(); ++j) {
        const std::size_t chunk = static_cast<std::size_t>(v / 16 * c.views + k);
        const double value = values[(chunk * exact.size() + j) * 16 + static_cast<std::size_t>(v % 16)];
        BOOST_REQUIRE(std::isfinite(value));
        error = std::max(error, std::abs(value - exact[j]));
        sup = std::max(sup, std::abs(exact[j]));
      }
      // The reference's own sum, in double precision.
      const double reference = static_cast<double>(c.columns + 40) * 0x1p-53 * upsampler.gain_u() * largest;
      const double bound = column_error(upsampler, c.columns, columns, largest, sup) + reference;
      worst = std::max(worst, error / bound);
    }
  BOOST_TEST(worst <= 1.0, c.columns << " columns, " << c.rows << " rows, rate " << c.rate << ": " << worst);
}

}  // namespace

BOOST_AUTO_TEST_CASE(finer_columns_are_those_of_the_series) {
  for (const std::int64_t columns : {1, 2, 3, 4, 5, 10, 11, 21, 42, 43, 64, 65, 100, 171})
    for (const int rate : {2, 4, 8, 16, 32}) check({columns, 5, 2, rate, 2.6});
}

BOOST_AUTO_TEST_CASE(rows_fill_no_vector) {
  for (const std::int64_t rows : {1, 7, 16, 17, 33}) check({37, rows, 3, 8, 0});
}

BOOST_AUTO_TEST_CASE(columns_beyond_the_detector_are_mirrored) {
  for (const double margin : {0.0, 0.3, 7.0, 30.0, 100.0})
    for (const int rate : {2, 8, 16}) check({19, 5, 1, rate, margin});
}

BOOST_AUTO_TEST_CASE(wide_detectors_lose_nothing) {
  check({1024, 5, 2, 8, 3});
  check({1500, 5, 2, 8, 3});
}

// The bound is that of one rounding, which a product of fp32 cannot keep.
BOOST_AUTO_TEST_CASE(values_are_rounded_once) {
  Device device;
  if (!ColumnUpsampling::is_possible(device.state())) return;
  for (const std::int64_t n : {16, 257, 2048}) {
    const FilteredScan scan = scan_of({n, 1, 1, 8, 0});
    Upsampler upsampler(device.state(), scan, ColumnMethod::accurate);
    BOOST_TEST(column_error(upsampler, n, upsampled_columns(n, 8, 0), 1, 1) <= 1.05 * 0x1p-24);
  }
}

// cosine_gain against the matrix itself, at positions that it does not sample.
BOOST_AUTO_TEST_CASE(gain_is_that_of_the_worst_position) {
  for (const std::int64_t n : {1, 2, 3, 8, 21, 64}) {
    std::vector<double> positions;
    for (double p = -0.5; p < static_cast<double>(n); p += 0.037) positions.push_back(p);
    const std::vector<double> matrix = resampling_matrix(n, positions, 0, 1, 0);
    double largest = 0;
    for (std::size_t p = 0; p < positions.size(); ++p) {
      double sum = 0;
      for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i)
        sum += std::abs(matrix[p * static_cast<std::size_t>(n) + i]);
      largest = std::max(largest, sum);
    }
    BOOST_TEST(largest <= tolerance::bound(cosine_gain(n)));
    BOOST_TEST(cosine_gain(n) <= 1.03 * largest);
  }
}
