#define BOOST_TEST_MODULE attack_terms
#include <boost/test/unit_test.hpp>

#include <random>

#include "host/reconstruct_field.hpp"
#include "host/sampler_terms.hpp"
#include "host/view_weights.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/support/attack_chain.hpp"
#include "tests/support/attack_scans.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

// The terms of the certificate one by one, each where it dominates: sups, filter, upsampling, summation,
// position, sampler, the covered region's edge, and stored fields measured end to end. Without slack.
using namespace vdvr;
using namespace vdvr::attacks;

namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

// Filtered samples as if measured without error: what is tested is what comes after the filter.
FilteredScan given_samples(const ParallelGeometry& g, const Value& q) {
  FilteredScan f;
  f.geometry = g;
  f.view_max.assign(g.theta_rad.size(), 0.0);
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k)
    for (std::size_t u = 0; u < at(g.columns); ++u)
      for (std::size_t v = 0; v < at(g.rows); ++v) {
        f.samples.push_back(static_cast<float>(q(k, v, u)));
        f.view_max[k] = std::max(f.view_max[k], std::abs(static_cast<double>(f.samples.back())));
      }
  return f;
}

// q_k on upsampled column n and at a detector row, in double precision, from samples [view][u][v].
struct ExactColumns {
  ParallelGeometry g;
  UpsampledColumns columns;
  std::vector<double> samples;
  std::vector<double> row_weights;  // of the one detector row in use
  ExactColumns(const ParallelGeometry& geometry, const UpsampledColumns& c, const std::vector<float>& s,
               double row)
      : g(geometry),
        columns(c),
        samples(s.begin(), s.end()),
        row_weights(resampling_matrix(g.rows, std::array{row}, 0, g.pitch_v, 0)) {}
  double operator()(std::size_t k, std::int64_t n) const {
    const auto weights = resampling_matrix(g.columns, std::array{columns.position(n)}, 0, g.pitch_u, 0);
    double sum = 0;
    for (std::size_t u = 0; u < at(g.columns); ++u)
      for (std::size_t v = 0; v < at(g.rows); ++v)
        sum += weights[u] * row_weights[v] * samples[(k * at(g.columns) + u) * at(g.rows) + v];
    return sum;
  }
  // The interpolant, linear or Lagrange's cubic, at a world point.
  double back_projected(double x, double y, bool cubic) const {
    double sum = 0;
    for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
      const double t = x * std::cos(g.theta_rad[k]) + y * std::sin(g.theta_rad[k]);
      const double s = columns.column_of(t / g.pitch_u + g.center);
      const auto n = static_cast<std::int64_t>(std::floor(s));
      const double f = s - static_cast<double>(n);
      if (!cubic) {
        sum += (1 - f) * (*this)(k, n) + f * (*this)(k, n + 1);
        continue;
      }
      sum += -f * (1 - f) * (2 - f) / 6 * (*this)(k, n - 1) +
             (1 + f) * (1 - f) * (2 - f) / 2 * (*this)(k, n) + (1 + f) * f * (2 - f) / 2 * (*this)(k, n + 1) -
             (1 + f) * f * (1 - f) / 6 * (*this)(k, n + 2);
    }
    return sum;
  }
};

struct Arithmetic {
  double error = 0, bound = 0;
};

// The largest |computed - exact| over a block of columns at one detector row, both with the same
// interpolation; `truth` are the samples that exact arithmetic starts from.
Arithmetic measure(const FilteredScan& filtered, const std::vector<float>& truth, int upsampling,
                   const std::string& u_filter, const ColumnBlocks& blocks, double row) {
  opencl::State& state = device().state();
  Upsampler upsampler(state, filtered);
  const FieldSups sups = field_sups(state, upsampler, filtered);
  const UpsampledColumns columns = upsampled_columns(filtered.geometry.columns, upsampling, 3);
  const UpsampledSlab slab = upsampler(columns, std::array{row});
  const opencl::DeviceArray<float> out(
      state, static_cast<std::uint64_t>(blocks.nx * blocks.ny * column_stride(1)), "columns");
  back_project(state, filtered.geometry, slab, blocks, u_filter,
               const_cast<opencl::DeviceArray<float>&>(out));
  const auto host = out.to_host();
  const ExactColumns exact(filtered.geometry, columns, truth, row);
  Arithmetic a;
  a.bound = arithmetic_bound(upsampler, filtered, sups, columns, blocks, u_filter);
  for (std::int64_t y = 0; y < blocks.ny; ++y)
    for (std::int64_t x = 0; x < blocks.nx; ++x) {
      const double e = exact.back_projected(blocks.first[0][0] + static_cast<double>(x) * blocks.step_x,
                                            blocks.first[0][1] + static_cast<double>(y) * blocks.step_y,
                                            u_filter == "cubic");
      a.error = std::max(a.error,
                         std::abs(static_cast<double>(host[at((y * blocks.nx + x) * column_stride(1))]) - e));
    }
  return a;
}

void expect(const Arithmetic& a, const std::string& what) {
  BOOST_TEST_MESSAGE("  " << what << ": error / bound " << a.error / a.bound);
  BOOST_TEST(a.error <= tolerance::bound(a.bound), what << ": error " << a.error << ", bound " << a.bound);
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

BOOST_AUTO_TEST_CASE(filter_error_is_never_above_what_is_charged) {
  for (const Scan& scan : awkward_scans()) {
    FilteredScan filtered = filter_projections(device().state(), scan.data, {});
    const double a_priori = filtered.ramp_error;
    measure_filter_error(filtered, scan.data, {});
    const ParallelGeometry& g = scan.data.geometry;
    const ExactField exact(scan.data, {});
    // Filtered samples of all views at once, at every pixel of the axis' column: F there is their sum.
    std::vector<double> q(at(g.views()), 0.0);
    double total = 0;
    const auto kernel = [&](std::size_t d) {
      constexpr double pi = std::numbers::pi;
      return d == 0       ? 1 / (4 * g.pitch_u)
             : d % 2 == 1 ? -1 / (pi * pi * static_cast<double>(d * d) * g.pitch_u)
                          : 0.0;
    };
    const ViewWeights weights = view_weights(g.theta_rad);
    for (std::size_t k = 0; k < at(g.views()); ++k) {
      double worst = 0;
      for (std::size_t v = 0; v < at(g.rows); ++v)
        for (std::size_t u = 0; u < at(g.columns); ++u) {
          double sum = 0;
          for (std::size_t m = 0; m < at(g.columns); ++m)
            sum += kernel(u > m ? u - m : m - u) *
                   static_cast<double>(scan.data.data[(k * at(g.rows) + v) * at(g.columns) + m]);
          worst = std::max(
              worst,
              std::abs(sum * weights.weight[k] -
                       static_cast<double>(filtered.samples[(k * at(g.columns) + u) * at(g.rows) + v])));
        }
      total += worst;
    }
    BOOST_TEST(total <= tolerance::bound(filtered.ramp_error),
               scan.name << ", measured: " << total << " > " << filtered.ramp_error);
    BOOST_TEST(total <= tolerance::bound(a_priori),
               scan.name << ", a priori: " << total << " > " << a_priori);
  }
}

BOOST_AUTO_TEST_CASE(arithmetic_covers_errors_of_the_filtered_samples) {
  // Every sample wrong by e, with the signs that add up where the error is read.
  const ParallelGeometry g = geometry(5, 4, 24);
  const double e = 0x1p-10;
  for (const int upsampling : {2, 8})
    for (const char* filter : {"linear", "cubic"})
      for (const double row : {1.5, 0.5, 3.4}) {
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
               "filter, " + std::string(filter) + " " + std::to_string(upsampling) + ", row " +
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
      a.bound = arithmetic_bound(upsampler, f, FieldSups{}, columns, {1, 1, 1, 1, {{0, 0}}, {}}, "linear");
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
  // Equal terms: while the sum stays between two powers of two, every addition rounds the same way.
  constexpr std::int64_t views = 8192;
  ParallelGeometry g = geometry(views, 1, 8);
  g.center = 4 - 0.5;  // on a column of every rate: the second term of each view is 0
  for (const char* filter : {"linear", "cubic"})
    for (const double term : {1.9999, 1.75, 1.3337, 1.2501, 1.0626}) {
      const FilteredScan f = given_samples(
          g, [&](auto, auto, auto) { return term / static_cast<double>(views) * (1 + 0x1p-13); });
      expect(measure(f, f.samples, 2, filter, {1, 1, 0.01, 0.01, {{0, 0}}, {}}, 0),
             std::string("summation of ") + std::to_string(views) + " views, " + filter + ", " +
                 std::to_string(term));
    }
}

BOOST_AUTO_TEST_CASE(arithmetic_covers_positions_far_from_the_block_corner) {
  // A wide block at the detector's Nyquist frequency: a position that is wrong by a rounding costs the whole
  // slope.
  constexpr std::int64_t columns = 2048;
  ParallelGeometry g = geometry(2, 1, columns);
  g.theta_rad = {0.1234, 1.3};
  for (const char* filter : {"linear", "cubic"})
    for (const std::size_t m : {2047u, 1500u}) {
      const FilteredScan f = given_samples(g, [&](auto, auto, std::size_t u) {
        return std::sin(reference::frequency(m, columns) * (static_cast<double>(u) + 0.5) + 0.1);
      });
      expect(measure(f, f.samples, 2, filter, {40, 40, 34.987, 33.311, {{-680.1, -650.3}}, {}}, 0),
             std::string("position, ") + filter + ", wave " + std::to_string(m));
    }
}

BOOST_AUTO_TEST_CASE(buffer_sampler_stays_within_its_term) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  double closest = 0;
  for (const std::int64_t cells : {5, 67, 1025, 4097})
    for (const bool steep : {false, true}) {
      Grid grid;
      grid.cells = {cells, 3, 2};
      grid.spacing = {0.7, 1.1, 0.9};
      grid.origin = {-0.35 * static_cast<double>(cells), 2.2, -7.7};
      MixedVolume v = support::random_mixed(grid, 4, 4, {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {0, 0, 2}}, 11);
      // A comb has the largest slope there is, everywhere.
      const auto comb = [&](std::vector<float>& s) {
        for (std::size_t i = 0; i < s.size(); ++i) s[i] = i % 2 == 0 ? 1.0f : -1.0f;
      };
      if (steep) {
        comb(v.base);
        for (auto& [level, tile] : v.tiles) comb(tile);
      }
      const double bound = sampler_terms(field_slopes(v), grid, SamplerProbe{}, 1).buffer.value;
      for (int i = 0; i < 4000; ++i) {
        Vec3 cell{}, p{};
        for (std::size_t a = 0; a < 3; ++a) {
          cell[a] = unit(random) * static_cast<double>(grid.cells[a]);
          // Mostly at the far end, where a coordinate rounds most.
          if (a == 0 && i % 4 != 0) cell[a] = static_cast<double>(cells) - unit(random) * 0.999;
          p[a] = grid.origin[a] + cell[a] * grid.spacing[a];
          cell[a] = (p[a] - grid.origin[a]) / grid.spacing[a];
        }
        // The brick that answers is the sampler's; at faces, where bricks disagree, the coordinate decides.
        const double truth = reference::field_of_brick(v, brick_at(v, p), cell);
        const double error = std::abs(static_cast<double>(sample_at(v, p)) - truth);
        closest = std::max(closest, error / bound);
        BOOST_TEST(error <= tolerance::bound(bound), cells << " cells, at cell " << cell[0] << ", " << cell[1]
                                                           << ", " << cell[2] << ": error " << error
                                                           << ", bound " << bound);
      }
    }
  BOOST_TEST_MESSAGE("  sampler: error / bound " << closest);
}

BOOST_AUTO_TEST_CASE(every_gold_cell_with_a_covered_point_is_tested) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const std::int64_t rows : {4, 1}) {
    const Scan scan{"edge", noise(geometry(rows == 1 ? 44 : 11, rows, 24), 21), {}, 0};
    Chain chain(scan.data);
    for (const int gold : {2, 4, 8})
      for (int i = 0; i < 24; ++i) {
        // On the rim of the covered disk, and at the first and last row.
        const double angle = 0.26 * i, r = 12;
        const double z = rows == 1 ? 0.0 : i % 3 == 0 ? 1.5 : i % 3 == 1 ? -1.5 : 0.1;
        const Rates rates{8, "cubic", gold};
        const Lattice l =
            stream_lattice(chain,
                           grid_at(scan.data.geometry, {r * std::cos(angle), r * std::sin(angle), z}, 0.9,
                                   gold, Place::cell),
                           rates);
        std::int64_t missed = 0, covered = 0;
        for (std::int64_t cz = 0; cz + 1 < l.nodes[2]; ++cz)
          for (std::int64_t y = 0; y + 1 < l.nodes[1]; ++y)
            for (std::int64_t x = 0; x + 1 < l.nodes[0]; ++x) {
              // Near the corners, where a sliver of the cell may be covered; one row covers a plane only.
              const auto near = [&] {
                const double f = 0.02 * unit(random);
                return random() % 2 == 0 ? f : 1 - f;
              };
              Vec3 p = l.position(x, y, cz);
              for (std::size_t a = 0; a < 3; ++a) p[a] += near() * l.grid.spacing[a] / gold;
              if (rows == 1 && l.position(x, y, cz)[2] <= 0 && l.position(x, y, cz + 1)[2] >= 0) p[2] = 0;
              if (!chain.exact.covered(p)) continue;
              ++covered;
              for (std::int64_t c = 0; c < 8; ++c)
                if (!(l.slack[l.at(x + (c & 1), y + (c >> 1 & 1), cz + (c >> 2))] >= 0)) {
                  ++missed;
                  break;
                }
            }
        BOOST_TEST(missed == 0, missed << " of " << covered << " gold cells with a covered point have an "
                                       << "untested corner; gold " << gold << ", angle " << angle << ", z "
                                       << z);
      }
  }
}

BOOST_AUTO_TEST_CASE(measured_totals_bound_stored_fields_everywhere) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::int64_t fields = 0;
  double closest = 0;
  std::vector<Scan> scans{axis_peak(4, 12, 1, true), axis_peak(8, 20, -1, false), wave(17, 2, 8, 1)};
  for (const Scan& s : awkward_scans())
    if (scans.size() < 20) scans.push_back(s);
  for (const Scan& scan : scans) {
    Chain chain(scan.data);
    for (const Rates& rates : {Rates{4, "linear", 4}, {8, "cubic", 8}, {16, "linear", 2}}) {
      Grid grid = grid_at(scan.data.geometry, scan.target, 0.8, rates.gold, Place::cell);
      grid.cells = {4, 4, 2};
      GoldStream stream(device().state(), chain.filtered, chain.upsampler, chain.sups,
                        {grid, 2, rates.gold, rates.upsampling, rates.u_filter, {}});
      const int top = rates.gold == 2 ? 1 : 2;
      const auto t = static_cast<std::uint8_t>(top);
      for (int kind = 0; kind < 4; ++kind, ++fields) {
        // F itself at the stored samples; F with an offset, either sign; F with noise.
        const double size = kind == 0 ? 0 : 0.02 * chain.sups.value;
        MixedVolume v = support::sampled_mixed(
            grid, 2, rates.gold, {{0, 0, 0}, {1, 1, 1}, {t, t, t}, {1, 0, t}}, static_cast<unsigned>(fields),
            [&](double x, double y, double z) {
              const Vec3 p{grid.origin[0] + x * grid.spacing[0], grid.origin[1] + y * grid.spacing[1],
                           grid.origin[2] + z * grid.spacing[2]};
              const double change = kind == 1 ? 1 : kind == 2 ? -1 : 2 * unit(random) - 1;
              return chain.exact.at(std::span(&p, 1))[0] + size * change;
            });
        const std::vector<std::uint8_t> all(v.level.size(), 1);
        const opencl::DeviceArray<std::uint8_t> selected(device().state(), std::span<const std::uint8_t>(all),
                                                         "all bricks");
        const DeviceField field(device().state(), v);
        const double others =
            stream.arithmetic() + sampler_terms(field_slopes(v), grid, SamplerProbe{}, 1).buffer.value;
        std::vector<double> total(v.level.size(), -1.0);
        stream.run(
            all,
            [&](GoldStream::Batch& batch) {
              for (const BrickMeasure& m : batch.measure(field, 1.0f, selected))
                total[at(m.brick)] = static_cast<double>(m.total);
            },
            {}, "measure");
        std::vector<Vec3> points;
        for (int i = 0; i < 300; ++i) {
          Vec3 p{};
          for (std::size_t a = 0; a < 3; ++a)
            p[a] =
                grid.origin[a] +
                grid.spacing[a] *
                    (i < 100 ? (std::floor(unit(random) * static_cast<double>(grid.cells[a] * rates.gold)) +
                                0.5) /
                                   rates.gold
                             : unit(random) * static_cast<double>(grid.cells[a]));
          if (chain.exact.covered(p)) points.push_back(p);
        }
        const auto F = chain.exact.at(points);
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Index3 b = brick_at(v, points[i]), n = v.bricks();
          const double bound = total[at((b[2] * n[1] + b[1]) * n[0] + b[0])] + others,
                       error = std::abs(static_cast<double>(sample_at(v, points[i])) - F[i]);
          if (error > 0) closest = std::max(closest, error / bound);
          BOOST_TEST(error <= tolerance::bound(bound), scan.name << ", " << rates.name() << ", kind " << kind
                                                                 << ": |V - F| " << error << ", certified "
                                                                 << bound);
        }
      }
    }
  }
  BOOST_TEST_MESSAGE("  " << fields << " stored fields: |V - F| / certified " << closest);
}
