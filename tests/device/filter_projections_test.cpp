#define BOOST_TEST_MODULE filter_projections
#include "host/field/fbp/filter_projections.hpp"

#include <boost/test/unit_test.hpp>
#include <limits>

#include "host/base/opencl/fft.hpp"
#include "host/field/fbp/ramp_kernel.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "tests/reference/cosine_series.hpp"
#include "tests/reference/ramp_filter.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"

using namespace vdvr;
using vdvr::testing::noise_scan;

namespace {

// The sum over views of the largest error of a filtered sample: what FilteredScan::ramp_error bounds.
double summed_error(const FilteredScan& filtered, const std::vector<double>& exact) {
  const auto per_view = static_cast<std::size_t>(filtered.geometry.columns * filtered.geometry.rows);
  double sum = 0;
  for (std::size_t first = 0; first < exact.size(); first += per_view) {
    double worst = 0;
    for (std::size_t i = first; i < first + per_view; ++i)
      worst = std::max(worst, std::abs(static_cast<double>(filtered.samples[i]) - exact[i]));
    sum += worst;
  }
  return sum;
}

// The ramp with any window, by its definition: direct convolution in double precision.
std::vector<double> convolved(const ProjectionSet& scan, const FieldOptions& field) {
  const ParallelGeometry& g = scan.geometry;
  const auto U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);
  const std::vector<double> kernel = ramp_kernel(field, g.pitch_u, g.columns),
                            weights = view_weights(g.theta_rad).weight;
  std::vector<double> out(scan.data.size());
  for (std::size_t k = 0; k < weights.size(); ++k)
    for (std::size_t v = 0; v < V; ++v)
      for (std::size_t u = 0; u < U; ++u)
        for (std::size_t m = 0; m < U; ++m)
          out[(k * U + u) * V + v] += weights[k] * kernel[u > m ? u - m : m - u] *
                                      static_cast<double>(scan.data[(k * V + v) * U + m]);
  return out;
}

// What rounding each sample once, to fp32, may do in all, 2^-126 for what may be flushed included.
double one_rounding(const FilteredScan& filtered) {
  double sum = 0;
  for (const double m : filtered.view_max) sum += m * 0x1p-24 / (1 - 0x1p-24) + 0x1p-126;
  return sum;
}

void check_ramp(const ProjectionSet& scan) {
  Device device;
  const std::vector<double> exact = reference::ramp_filtered(scan);
  for (const FilterMethod method : {FilterMethod::fourier, FilterMethod::product, FilterMethod::host})
    for (const Precision precision : {Precision::fp32, Precision::fp64}) {
      const FilteredScan filtered = filter_projections(device.state(), scan, {}, {}, method, precision);
      BOOST_REQUIRE(filtered.samples.size() == scan.data.size());
      BOOST_TEST(summed_error(filtered, exact) <= tolerance::bound(filtered.ramp_error));
      // What double precision rounds before is less than a hundredth of that.
      if (precision == Precision::fp64) BOOST_TEST(filtered.ramp_error <= 1.01 * one_rounding(filtered));
    }
}

// Row z of a slab read back: values[row / 16][view][column][16].
struct HostSlab {
  explicit HostSlab(const UpsampledSlab& slab)
      : values(slab.values.to_host()), columns(slab.columns.count), views(slab.views) {}
  [[nodiscard]] float at(std::int64_t k, std::int64_t z, std::int64_t n) const {
    return values[static_cast<std::size_t>(((z / 16 * views + k) * columns + n) * 16 + z % 16)];
  }
  std::vector<float> values;
  std::int64_t columns, views;
};

struct Slab {
  int rate;
  double margin;
  std::vector<double> rows;
  int order_u = 0, order_v = 0, lattice = 0;
};

// Each element against the product of double-precision matrices. Two dot products, whose operands and results
// round once more: relative to the sum of magnitudes that the element adds up.
void check_slab(const ProjectionSet& scan, const Slab& wanted) {
  Device device;
  const FilteredScan filtered = filter_projections(device.state(), scan, {});
  Upsampler upsampler(device.state(), filtered);
  const ParallelGeometry& g = scan.geometry;
  const UpsampledColumns columns = upsampled_columns(g.columns, wanted.rate, wanted.margin);
  const UpsampledSlab slab = upsampler(columns, wanted.rows, wanted.order_u, wanted.order_v, wanted.lattice);
  const HostSlab host(slab);
  BOOST_REQUIRE(slab.rows == static_cast<std::int64_t>(wanted.rows.size()));
  const auto U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);

  // Impulse responses along each axis, from the reference series alone.
  const auto matrix = [](std::size_t n, const std::vector<double>& x, int order, double pitch) {
    std::vector<double> m;
    for (std::size_t i = 0; i < n; ++i) {
      std::vector<double> impulse(n, 0.0);
      impulse[i] = 1;
      const auto a = reference::cosine_coefficients(impulse);
      for (const double p : x) m.push_back(reference::cosine_series(a, p, order, pitch));
    }
    return m;  // [i][position]
  };
  std::vector<double> x;
  for (std::int64_t j = 0; j < columns.count; ++j) x.push_back(columns.position(j));
  const auto along_u = matrix(U, x, wanted.order_u, g.pitch_u),
             along_v = matrix(V, wanted.rows, wanted.order_v, g.pitch_v);

  double worst = 0;  // error / tolerance
  for (std::size_t k = 0; k < static_cast<std::size_t>(g.views()); ++k)
    for (std::size_t z = 0; z < wanted.rows.size(); ++z) {
      std::vector<double> row(U), magnitude(U);
      for (std::size_t u = 0; u < U; ++u)
        for (std::size_t v = 0; v < V; ++v) {
          const double term = along_v[v * wanted.rows.size() + z] *
                              static_cast<double>(filtered.samples[(k * U + u) * V + v]);
          row[u] += term;
          magnitude[u] += std::abs(term);
        }
      for (std::size_t n = 0; n < x.size(); ++n) {
        double sum = 0, size = 0;
        for (std::size_t u = 0; u < U; ++u) {
          sum += along_u[u * x.size() + n] * row[u];
          size += std::abs(along_u[u * x.size() + n]) * magnitude[u];
        }
        const double error =
            std::abs(static_cast<double>(host.at(static_cast<std::int64_t>(k), static_cast<std::int64_t>(z),
                                                 static_cast<std::int64_t>(n))) -
                     sum);
        worst = std::max(worst, error / tolerance::fp32_sum(g.columns + g.rows + 4, size));
      }
    }
  BOOST_TEST(worst <= 1.0);
}

std::vector<double> odd_rows(std::int64_t rows, int count) {
  std::vector<double> z;
  for (int i = 0; i < count; ++i)
    z.push_back(-0.9 + static_cast<double>(i) * (static_cast<double>(rows) + 0.7) / count);
  return z;
}

}  // namespace

BOOST_AUTO_TEST_CASE(ramp_filter_stays_within_its_bounds_at_odd_prime_and_one_row_sizes) {
  for (const auto& [views, rows, columns] :
       {std::array{3, 1, 2}, {5, 2, 17}, {7, 3, 31}, {4, 5, 64}, {2, 1, 97}, {3, 7, 129}, {1, 3, 37}})
    check_ramp(noise_scan(views, rows, columns));
}

BOOST_AUTO_TEST_CASE(ramp_filter_knows_the_pitch) {
  ProjectionSet scan = noise_scan(5, 3, 29);
  scan.geometry.pitch_u = 0.1;
  scan.geometry.pitch_v = 2;
  check_ramp(scan);
}

BOOST_AUTO_TEST_CASE(ramp_filter_in_several_chunks_of_views_gives_every_view) {
  check_ramp(noise_scan(80, 600, 33));
}

BOOST_AUTO_TEST_CASE(ramp_filter_keeps_the_dynamic_range_of_a_spike_on_an_offset) {
  ProjectionSet scan = vdvr::testing::empty_scan(3, 2, 41);
  std::fill(scan.data.begin(), scan.data.end(), 1000.0f);
  scan.data[7] = -5000.0f;
  check_ramp(scan);
}

BOOST_AUTO_TEST_CASE(a_device_that_ends_takes_the_plans_of_no_other_with_it) {
  const ProjectionSet scan = noise_scan(3, 2, 37);
  const auto filtered = [&](Device& device) {
    return filter_projections(device.state(), scan, {}, {}, FilterMethod::fourier).samples;
  };
  Device stays, moved;
  const SampleArray before = filtered(stays);
  for (int i = 0; i < 3; ++i) {
    Device ends;
    BOOST_TEST((filtered(ends) == before));
    BOOST_TEST((filtered(stays) == before));
    // A device that another is moved over ends too.
    BOOST_TEST((filtered(moved) == before));
    moved = Device();
  }
  BOOST_TEST((filtered(stays) == before));
}

BOOST_AUTO_TEST_CASE(good_length_is_the_smallest_of_its_kind) {
  // Even, because real transforms of even length are the ones clFFT packs.
  const auto good = [](std::int64_t n) {
    if (n % 2 == 1) return false;
    while (n % 2 == 0) n /= 2;
    return n == 1 || n == 3 || n == 5;
  };
  for (std::int64_t n = 1; n <= 5000; ++n) {
    std::int64_t smallest = n;
    while (!good(smallest)) ++smallest;
    BOOST_REQUIRE(fft::good_length(n) >= n);
    BOOST_REQUIRE(good(fft::good_length(n)));
    BOOST_REQUIRE(fft::good_length(n) == smallest);
  }
}

BOOST_AUTO_TEST_CASE(slab_of_values_is_the_cosine_series) {
  for (const auto& [views, rows, columns] : {std::array{3, 1, 13}, {2, 2, 7}, {5, 9, 33}, {4, 19, 40}}) {
    const ProjectionSet scan = noise_scan(views, rows, columns);
    for (const int rate : {1, 2, 8}) check_slab(scan, {rate, 0.6, odd_rows(rows, 21)});
  }
}

BOOST_AUTO_TEST_CASE(slab_of_whole_columns_and_rows_holds_the_samples_themselves) {
  const ProjectionSet scan = noise_scan(3, 21, 13);
  std::vector<double> upwards, backwards;
  for (int z = -5; z < 30; ++z) upwards.push_back(z);  // mirrored below the first row and above the last
  for (int z = 20; z >= 0; z -= 2) backwards.push_back(z);
  for (const auto& rows : {upwards, backwards}) {
    check_slab(scan, {1, 2.6, rows});
    Device device;
    const FilteredScan filtered = filter_projections(device.state(), scan, {});
    Upsampler upsampler(device.state(), filtered);
    const UpsampledColumns columns = upsampled_columns(13, 1, 2.6);
    const HostSlab slab(upsampler(columns, rows, 0, 0, 0, 1, 2));
    bool same = true;
    for (std::size_t z = 0; z < rows.size(); ++z)
      for (std::int64_t u = 0; u < 13; ++u)
        for (std::int64_t k = 0; k < 2 && rows[z] >= 0 && rows[z] < 21; ++k)
          same = same && slab.at(k, static_cast<std::int64_t>(z), u + columns.pad) ==
                             filtered.samples[static_cast<std::size_t>(((k + 1) * 13 + u) * 21 +
                                                                       static_cast<std::int64_t>(rows[z]))];
    BOOST_TEST(same);
  }
}

BOOST_AUTO_TEST_CASE(slab_of_derivatives_is_the_series_derived) {
  ProjectionSet scan = noise_scan(3, 7, 21);
  scan.geometry.pitch_u = 0.5;
  scan.geometry.pitch_v = 1.5;
  for (const auto& [u, v] : {std::array{2, 0}, {4, 0}, {0, 2}})
    check_slab(scan, {4, 1.25, odd_rows(7, 5), u, v});
}

BOOST_AUTO_TEST_CASE(rows_on_a_lattice_give_the_same_derivatives) {
  const ProjectionSet scan = noise_scan(2, 6, 11);
  std::vector<double> z;
  for (int j = -3; j <= 27; ++j) z.push_back(static_cast<double>(j) / 4);
  check_slab(scan, {2, 0, z, 0, 2, 4});
}

BOOST_AUTO_TEST_CASE(views_of_a_chunk_are_those_of_the_whole_slab) {
  // More than the 32 MiB that the upsampler takes at once.
  const ProjectionSet scan = noise_scan(140, 3, 33);
  Device device;
  const FilteredScan filtered = filter_projections(device.state(), scan, {});
  Upsampler upsampler(device.state(), filtered);
  const UpsampledColumns columns = upsampled_columns(33, 2, 0);
  const auto rows = odd_rows(3, 2000);
  const HostSlab whole(upsampler(columns, rows));
  for (const auto& [first, count] : {std::pair<int, int>{0, 1}, {120, 20}, {137, 3}}) {
    const HostSlab part(upsampler(columns, rows, 0, 0, 0, first, count));
    bool same = true;
    for (std::int64_t k = 0; k < count; ++k)
      for (std::int64_t z = 0; z < 2000; ++z)
        for (std::int64_t n = 0; n < columns.count; ++n)
          same = same && part.at(k, z, n) == whole.at(first + k, z, n);
    BOOST_TEST(same);
  }
}

// A window leaves no tap at zero, so that the product takes all of them: another kernel than the plain
// ramp's.
BOOST_AUTO_TEST_CASE(windowed_filters_err_no_more_than_their_bounds) {
  Device device;
  FieldOptions hann;
  hann.filter = RampWindow::hann;
  for (const auto& [columns, rows] : {std::pair<int, int>{1, 1}, {2, 3}, {33, 17}, {150, 5}}) {
    const ProjectionSet scan = noise_scan(3, rows, columns);
    const std::vector<double> exact = convolved(scan, hann);
    for (const FilterMethod method : {FilterMethod::fourier, FilterMethod::product, FilterMethod::host})
      for (const Precision precision : {Precision::fp32, Precision::fp64}) {
        const FilteredScan filtered = filter_projections(device.state(), scan, hann, {}, method, precision);
        BOOST_TEST(summed_error(filtered, exact) <= tolerance::bound(filtered.ramp_error));
      }
  }
}

// More multiply-adds than a direct convolution on the side would be let take, and rows longer than products
// are used for.
BOOST_AUTO_TEST_CASE(rows_are_rounded_once_at_every_size) {
  Device device;
  for (const auto& [rows, columns] : {std::pair<int, int>{256, 2048}, {100, 3200}}) {
    const FilteredScan filtered = filter_projections(device.state(), noise_scan(4, rows, columns), {});
    BOOST_TEST(filtered.ramp_error <= 1.01 * one_rounding(filtered));
  }
}

// Products are to the bit: a transform depends on which rows it takes together.
BOOST_AUTO_TEST_CASE(slab_straight_from_the_scan_is_that_of_the_filtered_scan) {
  Device device;
  for (const RampWindow filter : {RampWindow::ram_lak, RampWindow::hann})
    for (const auto& [columns, rows] : {std::pair<int, int>{1, 1}, {5, 3}, {40, 33}, {150, 18}}) {
      FieldOptions field;
      field.filter = filter;
      const ProjectionSet scan = noise_scan(7, rows, columns);
      const UpsampledColumns wanted = upsampled_columns(columns, 1, std::min(4, columns / 2));
      // Mirrored, reversed and repeated rows, and more of them than one vector takes.
      std::vector<double> positions;
      for (int z = -1; z <= rows; ++z) positions.push_back(z);
      for (int z = 0; z < 20; ++z) positions.push_back((7 * z) % rows);
      DirectFilter direct(device.state(), scan, field);
      const auto slab = direct(wanted, positions, {});
      // Columns are mirrored once at most.
      BOOST_REQUIRE(slab.has_value() == (wanted.pad <= columns));
      if (!slab) continue;
      const FilteredScan filtered =
          filter_projections(device.state(), scan, field, {}, FilterMethod::automatic, Precision::fp32);
      Upsampler upsampler(device.state(), filtered);
      const HostSlab expected(upsampler(wanted, positions)), computed(*slab);
      double off = 0;
      BOOST_REQUIRE(computed.values.size() == expected.values.size());
      for (std::size_t i = 0; i < computed.values.size(); ++i)
        off = std::max(off, static_cast<double>(std::abs(computed.values[i] - expected.values[i])));
      BOOST_TEST(off <= (device.info().is_cpu ? 0.0 : 2 * filtered.ramp_error));
    }
}

BOOST_AUTO_TEST_CASE(direct_filter_leaves_upsampling_to_others_and_refuses_overflow) {
  Device device;
  ProjectionSet scan = noise_scan(4, 6, 24);
  const std::vector<double> whole{0, 1, 2}, between{0, 0.5, 1};
  DirectFilter direct(device.state(), scan, {});
  BOOST_TEST(!direct(upsampled_columns(24, 2, 1), whole, {}).has_value());
  BOOST_TEST(!direct(upsampled_columns(24, 1, 1), between, {}).has_value());
  scan.geometry.pitch_u = 0.01;  // taps of 25
  for (const float bad : {std::numeric_limits<float>::max(), std::numeric_limits<float>::quiet_NaN()}) {
    scan.data[2 * 6 * 24 + 24 + 7] = bad;  // view 2, row 1
    scan.data[2 * 6 * 24 + 24 + 8] = -bad;
    BOOST_CHECK_EXCEPTION(
        DirectFilter(device.state(), scan, {})(upsampled_columns(24, 1, 1), whole, {}), InputError,
        [](const InputError& e) { return std::string(e.what()).find("view 2") != std::string::npos; });
  }
}
