// Re-projection residuals: integrals of F against quadrature of ExactField, each bound against the hardest
// case of its own, chords against the covered region, and scans that F explains or does not.
#define BOOST_TEST_MODULE residual
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <numbers>
#include <random>

#include "host/verify/residual/bounds_along.hpp"
#include "host/verify/residual/primitives.hpp"
#include "host/verify/residual/row_integrals.hpp"
#include "tests/reference/line_integral.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/residual.hpp"

using namespace vdvr;
namespace support = vdvr::testing;

namespace {

constexpr double pi = std::numbers::pi;

/// Uneven gaps, a pair that coincides but for rounding, views from behind, an axis off the middle.
ProjectionSet awkward_scan(unsigned seed) {
  ProjectionSet scan = support::noise_scan(9, 1, 23, seed);
  scan.geometry.theta_rad = {0.1, 0.45, 0.45 + 1e-9, 0.9, 1.3, 1.3 + 2e-4, 1.9, 0.1 + pi, 2.8};
  scan.geometry.center = 10.3;
  scan.geometry.pitch_u = 0.7;
  return scan;
}

CoveredChords chords_of(const ProjectionSet& scan) { return covered_chords(scan.geometry); }

void check_against_quadrature(const ProjectionSet& scan, const FieldOptions& field,
                              std::uint64_t table_bytes) {
  const ExactField exact(scan, field);
  const CoveredChords chords = chords_of(scan);
  const RowIntegrals rows = row_integrals(scan, field, chords, table_bytes);
  const auto columns = static_cast<std::size_t>(scan.geometry.columns);
  std::size_t compared = 0;
  for (std::size_t j = 0; j < scan.geometry.theta_rad.size(); ++j)
    for (std::size_t i = 0; i < columns; i += 2) {
      const std::size_t ray = j * columns + i;
      if (!(chords.first[ray] < chords.last[ray])) continue;
      // Frequencies are at most pi a column: on panels of a quarter of one, five points leave less than
      // rounding.
      const int panels = 1 + static_cast<int>(4 * chords.length(ray) / scan.geometry.pitch_u);
      const double theta = scan.geometry.theta_rad[j];
      std::vector<Vec3> points;
      std::vector<double> at_points;
      const auto collect = [&](double s) {
        points.push_back(reference::on_ray(theta, chords.u[ray], 0, s));
        return 0.0;
      };
      reference::gauss5(collect, chords.first[ray], chords.last[ray], panels);
      at_points = exact.at(points);
      std::size_t next = 0;
      double largest = 0;
      const double quadrature = reference::gauss5(
          [&](double) {
            largest = std::max(largest, std::abs(at_points[next]));
            return at_points[next++];
          },
          chords.first[ray], chords.last[ray], panels);
      const double slack =
          chords.length(ray) * (exact.rounding() + tolerance::fp64_sum(5 * panels + 64, largest));
      BOOST_TEST(std::abs(rows.integral[ray] - quadrature) <= rows.error[ray] + slack,
                 "view " << j << ", column " << i << ": " << rows.integral[ray] << " against " << quadrature
                         << ", error " << rows.error[ray]);
      // A bound that is larger than what fp32 data can tell would be of no use.
      BOOST_TEST(rows.error[ray] <= tolerance::unit_roundoff * chords.length(ray) * 8);
      ++compared;
    }
  BOOST_TEST(compared > 50u);
}

}  // namespace

BOOST_AUTO_TEST_CASE(integrals_of_the_hardest_field_are_those_of_quadrature) {
  FieldOptions field;
  check_against_quadrature(awkward_scan(1), field, std::uint64_t{1} << 30);
  field.filter = RampWindow::hann;
  check_against_quadrature(awkward_scan(2), field, 1);  // one view at a time
}

BOOST_AUTO_TEST_CASE(means_of_the_highest_frequency_err_by_no_more_than_their_bounds) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> part(0, 1);
  for (const std::int64_t n : {2, 7, 32, 129}) {
    const PrimitiveMaker make(n);
    std::vector<double> a(static_cast<std::size_t>(n));
    a.front() = 0.3;
    a.back() = 1;
    const Primitive primitive = make(a);
    const long double omega =
        std::numbers::pi_v<long double> * static_cast<long double>(n - 1) / static_cast<long double>(n);
    for (int trial = 0; trial < 20000; ++trial) {
      const double from = -0.5 + static_cast<double>(n) * part(random),
                   wanted = from + std::pow(2.0, -16 + 24 * part(random)) * (trial % 2 == 0 ? 1 : -1),
                   to = std::clamp(wanted, -0.5, static_cast<double>(n) - 0.5);
      if (from == to) continue;
      const long double width = static_cast<long double>(to) - static_cast<long double>(from),
                        middle =
                            0.5L * (static_cast<long double>(to) + static_cast<long double>(from)) + 0.5L,
                        half = 0.5L * omega * width,
                        exact = 0.3L + std::cos(omega * middle) * std::sin(half) / half;
      const double error =
          std::abs(static_cast<double>(static_cast<long double>(primitive.mean(from, to)) - exact));
      // Places are rounded too; row_integrals charges that.
      const double places = 0x1p-53 * 8 * static_cast<double>(n) * primitive.slope;
      BOOST_TEST(error <= primitive.anywhere + places);
      if (std::abs(to - from) >= kNarrow) BOOST_TEST(error <= primitive.apart / std::abs(to - from) + places);
    }
  }
}

BOOST_AUTO_TEST_CASE(chords_end_where_coverage_ends) {
  const ProjectionSet scan = awkward_scan(3);
  const ExactField exact(scan, {});
  const CoveredChords chords = chords_of(scan);
  const auto columns = static_cast<std::size_t>(scan.geometry.columns);
  const double beyond = 1e-6;  // far above the slack of covered(), 1e-9 of a column
  for (std::size_t ray = 0; ray < chords.first.size(); ++ray) {
    const double theta = scan.geometry.theta_rad[ray / columns], u = chords.u[ray];
    if (!(chords.first[ray] < chords.last[ray])) {
      for (double s = -40; s < 40; s += 0.5) BOOST_TEST(!exact.covered(reference::on_ray(theta, u, 0, s)));
      continue;
    }
    for (const double s : {chords.first[ray], chords.last[ray]})
      BOOST_TEST(exact.covered(reference::on_ray(theta, u, 0, s)));
    BOOST_TEST(!exact.covered(reference::on_ray(theta, u, 0, chords.first[ray] - beyond)));
    BOOST_TEST(!exact.covered(reference::on_ray(theta, u, 0, chords.last[ray] + beyond)));
  }
}

namespace {

/// A grid of bricks whose bounds differ, some untested, around the axis.
struct Bounds {
  MixedVolume volume;
  std::vector<float> values;
};
Bounds some_bounds(double value_from, double value_to) {
  Bounds out;
  out.volume.grid.cells = {22, 24, 8};
  out.volume.grid.origin = {-10.25, -12.5, -4};
  std::mt19937 random(9);
  std::uniform_real_distribution<float> value(static_cast<float>(value_from), static_cast<float>(value_to));
  const Index3 n = out.volume.bricks();
  for (std::int64_t i = 0; i < n[0] * n[1] * n[2]; ++i)
    out.values.push_back(i % 7 == 0 ? std::numeric_limits<float>::infinity() : value(random));
  return out;
}

}  // namespace

BOOST_AUTO_TEST_CASE(bounds_along_a_chord_are_those_of_its_bricks) {
  const Bounds b = some_bounds(0.1, 1);
  const Index3 n = b.volume.bricks();
  for (const double z : {-4.0, -0.5, 0.0, 3.0}) {
    const BoundsAlong along(b.volume, b.values, z);
    const auto bound_at = [&](const reference::Point& p) {
      std::array<double, 2> brick{(p[0] + 10.25) / 4, (p[1] + 12.5) / 4};
      if (brick[0] < 0 || brick[0] > 22.0 / 4 || brick[1] < 0 || brick[1] > 6) return 0.0;
      double most = 0;
      for (std::int64_t bz = 0; bz < n[2]; ++bz)
        if (4 * static_cast<double>(bz) <= z + 4 && z + 4 <= 4 * static_cast<double>(bz + 1)) {
          const auto x = std::min(n[0] - 1, static_cast<std::int64_t>(brick[0])),
                     y = std::min(n[1] - 1, static_cast<std::int64_t>(brick[1]));
          const float e = b.values[static_cast<std::size_t>((bz * n[1] + y) * n[0] + x)];
          if (std::isfinite(e)) most = std::max(most, static_cast<double>(e));
        }
      return most;
    };
    for (const double theta : {0.0, 0.3, pi / 2, 2.5})
      for (const double u : {-7.3, 0.1, 6.4}) {
        constexpr int steps = 20000;
        const double first = -16, last = 15,
                     reference = reference::midpoint(
                         [&](double s) { return bound_at(reference::on_ray(theta, u, z, s)); }, first, last,
                         steps),
                     // A step at each of at most 16 faces, of bounds below 1.
            slack = 16 * (last - first) / steps;
        BOOST_TEST(std::abs(along(std::cos(theta), std::sin(theta), u, first, last) - reference) <= slack);
      }
  }
}

namespace {

/// Bounds of one value all over a grid that holds the covered region.
std::pair<MixedVolume, Certificate> certified_to(const ProjectionSet& scan, double bound) {
  MixedVolume volume;
  volume.grid = make_grid(scan.geometry, {});
  const Index3 n = volume.bricks();
  Certificate certificate;
  certificate.brick_totals.assign(static_cast<std::size_t>(n[0] * n[1] * n[2]), static_cast<float>(bound));
  certificate.field.center = scan.geometry.center;
  return {volume, certificate};
}

ResidualSummary summary_for(const ProjectionSet& scan, double bound) {
  const auto [volume, certificate] = certified_to(scan, bound);
  return summary_of(residual(scan, volume, certificate, {}), scan);
}

ProjectionSet object_scan() { return support::simulated(shepp_logan(24), 64, 3, 90); }

}  // namespace

BOOST_AUTO_TEST_CASE(a_consistent_scan_is_explained_and_a_spoilt_one_is_not) {
  const ProjectionSet scan = object_scan();
  double largest = 0;
  for (const float p : scan.data) largest = std::max(largest, std::abs(static_cast<double>(p)));
  // A hundredth of the largest value along a typical chord: what a careful certificate allows.
  const double bound = 0.01 * largest / 48;
  const ResidualSummary whole = summary_for(scan, bound);
  BOOST_TEST(whole.compared == scan.size());
  BOOST_TEST(whole.beyond_interpolation < whole.compared / 100);
  BOOST_TEST(whole.rms < 0.01 * whole.measured_rms);
  const std::int64_t columns = scan.geometry.columns, row = columns, view = 3 * row;

  ProjectionSet moved = scan;
  constexpr std::int64_t spoilt = 31, shift = 4;
  for (std::int64_t v = 0; v < 3; ++v)
    for (std::int64_t i = columns - 1; i >= shift; --i)
      moved.data[static_cast<std::size_t>(spoilt * view + v * row + i)] =
          scan.data[static_cast<std::size_t>(spoilt * view + v * row + i - shift)];
  const ResidualSummary of_moved = summary_for(moved, bound);
  BOOST_TEST(of_moved.worst_view.index == spoilt);
  BOOST_TEST(of_moved.worst[0] == spoilt);
  BOOST_TEST(of_moved.worst_view.rms > 10 * of_moved.median_view_rms);
  BOOST_TEST(of_moved.worst_view.beyond > of_moved.worst_view.rays / 4);

  ProjectionSet spark = scan;
  constexpr std::int64_t hot = 20;
  spark.data[static_cast<std::size_t>(spoilt * view + row + hot)] += static_cast<float>(0.3 * largest);
  const ResidualSummary of_spark = summary_for(spark, bound);
  BOOST_TEST(of_spark.worst == (std::array<std::int64_t, 3>{spoilt, 1, hot}),
             boost::test_tools::per_element());

  ProjectionSet off = scan;
  off.geometry.center += 1.5;
  const ResidualSummary of_off = summary_for(off, bound);
  BOOST_TEST(of_off.beyond_interpolation > of_off.compared / 10);
  BOOST_TEST(of_off.rms > 10 * whole.rms);
}

BOOST_AUTO_TEST_CASE(rays_beside_the_covered_region_are_not_compared) {
  ProjectionSet scan = support::noise_scan(24, 2, 32, 4);
  scan.geometry.center = 11;  // covered is what lies within 11.5 columns of it, of 20 on the other side
  const auto [volume, certificate] = certified_to(scan, 0.1);
  ResidualOptions options;
  options.first_row = 1;
  const Residual r = residual(scan, volume, certificate, options);
  BOOST_TEST(r.rows == 1);
  const std::size_t inside = r.index(3, 1, 11), beside = r.index(3, 1, 31);
  BOOST_TEST(r.lo[inside] <= r.hi[inside]);
  BOOST_TEST(std::isnan(r.lo[beside]));
  BOOST_TEST(!r.beyond_interpolation(beside));
}

BOOST_AUTO_TEST_CASE(what_has_no_residual_is_refused) {
  ProjectionSet scan = support::noise_scan(8, 2, 16);
  auto [volume, certificate] = certified_to(scan, 0.1);
  ResidualOptions options;
  options.first_row = 2;
  BOOST_CHECK_THROW(residual(scan, volume, certificate, options), InputError);
  options = {};
  options.max_memory_bytes = 1000;
  BOOST_CHECK_THROW(residual(scan, volume, certificate, options), ResourceError);
  certificate.window = {0.0, 1.0};
  BOOST_CHECK_THROW(residual(scan, volume, certificate, {}), InputError);
  certificate.window.reset();
  certificate.brick_totals.clear();
  BOOST_CHECK_THROW(residual(scan, volume, certificate, {}), InputError);
  std::tie(volume, certificate) = certified_to(scan, 0.1);
  scan.cone = ConeGeometry{};
  BOOST_CHECK_THROW(residual(scan, volume, certificate, {}), InputError);
}
