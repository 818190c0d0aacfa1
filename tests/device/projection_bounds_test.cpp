#define BOOST_TEST_MODULE projection_bounds
#include "host/certify/bounds/projection_bounds.hpp"

#include <boost/test/unit_test.hpp>
#include <functional>
#include <numbers>
#include <random>

#include "host/certify/bounds/amplitude_bounds.hpp"
#include "host/certify/bounds/paper_bounds.hpp"
#include "host/certify/bounds/column_taps.hpp"
#include "host/certify/gold/gold_batch.hpp"
#include "host/certify/gold/gold_stream.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "tests/reference/cosine_series.hpp"
#include "tests/reference/ramp_filter.hpp"
#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/reconstruct.hpp"

using namespace vdvr;
using vdvr::testing::empty_scan;
using vdvr::testing::noise_scan;

namespace {

struct NamedScan {
  std::string name;
  ProjectionSet scan;
};

ProjectionSet filled(std::int64_t views, std::int64_t rows, std::int64_t columns,
                     const std::function<double(std::int64_t, std::int64_t, std::int64_t)>& f) {
  ProjectionSet scan = empty_scan(views, rows, columns);
  std::size_t i = 0;
  for (std::int64_t k = 0; k < views; ++k)
    for (std::int64_t v = 0; v < rows; ++v)
      for (std::int64_t u = 0; u < columns; ++u) scan.data[i++] = static_cast<float>(f(k, v, u));
  return scan;
}

// Waves of the mirror extension: every sample set is band-limited by definition, these are its pure
// frequencies.
NamedScan wave(std::int64_t m, std::int64_t l) {
  constexpr std::int64_t U = 24, V = 5;
  return {"wave " + std::to_string(m) + ", " + std::to_string(l),
          filled(11, V, U, [&](std::int64_t, std::int64_t v, std::int64_t u) {
            return std::cos(reference::frequency(static_cast<std::size_t>(m), U) *
                            (static_cast<double>(u) + 0.5)) *
                   std::cos(reference::frequency(static_cast<std::size_t>(l), V) *
                            (static_cast<double>(v) + 0.5));
          })};
}

std::vector<NamedScan> scans() {
  std::vector<NamedScan> all{{"noise", noise_scan(13, 7, 27)},
                             {"one row", noise_scan(11, 1, 24, 2)},
                             {"two rows", noise_scan(12, 2, 25, 3)},
                             {"many views", noise_scan(19, 4, 33, 4)}};
  for (const auto& [m, l] : {std::pair<int, int>{3, 0}, {12, 2}, {23, 4}}) all.push_back(wave(m, l));
  all.push_back({"spike", filled(11, 5, 25, [](auto k, auto v, auto u) {
                   return k == 4 && v == 2 && u == 13 ? 1.0 : 0.0;
                 })});
  all.push_back({"constant", filled(11, 3, 24, [](auto, auto, auto) { return 1.0; })});
  all.push_back({"checkerboard",
                 filled(13, 6, 24, [](auto, auto v, auto u) { return (u + v) % 2 == 0 ? 1.0 : -1.0; })});
  return all;
}

// A few cells around a point well off the axis, spacing unlike the pitch.
Grid small_grid(const ParallelGeometry& g, const Index3& cells) {
  GridOptions options;
  options.size = g.rows == 1 ? Index3{cells[0], cells[1], 1} : cells;
  options.spacing = 0.9;
  options.origin = Vec3{1.1, -3.7, g.rows == 1 ? -0.45 : -0.9 * static_cast<double>(cells[2]) / 2};
  return make_grid(g, options);
}

// What one test needs of the chain, on one shared device.
struct Chain {
  explicit Chain(const ProjectionSet& given)
      : scan(given),
        exact(scan, {}),
        filtered(filter_projections(state(), scan, {})),
        upsampler(state(), filtered) {
    sups = field_sups(state(), upsampler, filtered);
  }
  static opencl::State& state() { return support::device().state(); }
  ProjectionSet scan;
  ExactField exact;
  FilteredScan filtered;
  Upsampler upsampler;
  FieldSups sups;
};

struct Node {
  Vec3 position;
  float gold;
  Slack slack;
};

// Every node of every closed brick, brick by brick. side: nodes of a brick per axis x, y, z.
struct BrickNodes {
  Index3 side{0, 0, 0};
  std::vector<Node> nodes;
};
struct Stream {
  double arithmetic = 0, projection = 0;
  std::vector<BrickNodes> bricks;
};
Stream stream_nodes(Chain& chain, const Grid& grid, int granularity, const Rates& rates) {
  GoldStream stream(Chain::state(), chain.filtered, chain.sups,
                    {grid, granularity, rates.gold, rates.upsampling, rates.interpolation, {}});
  Stream out{stream.arithmetic(), stream.projection(), {}};
  Index3 n{};
  for (std::size_t a = 0; a < 3; ++a) n[a] = (grid.cells[a] + granularity - 1) / granularity;
  stream.run(
      std::vector<std::uint8_t>(static_cast<std::size_t>(n[0] * n[1] * n[2]), 1),
      [&](GoldStream::Batch& batch) {
        for (const std::int64_t id : batch.bricks()) {
          const Index3 brick{id % n[0], id / n[0] % n[1], id / n[0] / n[1]};
          BrickNodes nodes;
          batch.for_each_node(id, [&](const Index3& i, float gold, const Slack& slack) {
            Vec3 at{};
            for (std::size_t a = 0; a < 3; ++a) {
              nodes.side[a] = std::max(nodes.side[a], i[a] + 1);
              at[a] = grid.origin[a] +
                      (static_cast<double>(brick[a] * granularity) + static_cast<double>(i[a]) / rates.gold) *
                          grid.spacing[a];
            }
            nodes.nodes.push_back({at, gold, slack});
          });
          out.bricks.push_back(std::move(nodes));
        }
      },
      {}, "test");
  return out;
}

double trilinear(const std::array<double, 8>& corner, const Vec3& f) {
  double sum = 0;
  for (std::size_t c = 0; c < 8; ++c)
    sum +=
        corner[c] * ((c & 1) ? f[0] : 1 - f[0]) * ((c & 2) ? f[1] : 1 - f[1]) * ((c & 4) ? f[2] : 1 - f[2]);
  return sum;
}

// sup over views of a derivative on a lattice `dense` times the detector's, summed over views.
double dense_sups(const ProjectionSet& scan, int order_u, int order_v, int dense) {
  const auto filtered = reference::ramp_filtered(scan);
  const auto U = static_cast<std::size_t>(scan.geometry.columns),
             V = static_cast<std::size_t>(scan.geometry.rows);
  double total = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(scan.geometry.views()); ++k) {
    double sup = 0;
    std::vector<std::vector<double>> along_v;
    for (std::size_t u = 0; u < U; ++u)
      along_v.push_back(reference::cosine_coefficients(std::span(filtered).subspan((k * U + u) * V, V)));
    for (std::size_t j = 0; j <= V * static_cast<std::size_t>(dense); ++j) {
      std::vector<double> row;
      for (const auto& a : along_v)
        row.push_back(reference::cosine_series(a, static_cast<double>(j) / dense - 0.5, order_v,
                                               scan.geometry.pitch_v));
      const auto coefficients = reference::cosine_coefficients(row);
      for (std::size_t i = 0; i <= U * static_cast<std::size_t>(dense); ++i)
        sup = std::max(sup,
                       std::abs(reference::cosine_series(coefficients, static_cast<double>(i) / dense - 0.5,
                                                         order_u, scan.geometry.pitch_u)));
    }
    total += sup;
  }
  return total;
}

// The largest |computed - F| over covered samples of a reconstruction straight from the upsampled columns,
// less the arithmetic bound: interpolation in u alone.
double interpolation_error(Chain& chain, Grid grid, const Rates& rates) {
  for (std::size_t a = 0; a < 3; ++a) {
    grid.cells[a] *= rates.gold;
    grid.spacing[a] /= rates.gold;
  }
  const Index3 n = grid.samples();
  const Volume made = reconstruct_field(Chain::state(), chain.filtered, chain.upsampler, grid,
                                        rates.upsampling, rates.interpolation, {});
  std::vector<Vec3> points;
  std::vector<double> computed;
  for (std::int64_t z = 0, i = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x, ++i)
        if (const Vec3 p = grid.position({x, y, z}); chain.exact.covered(p)) {
          points.push_back(p);
          computed.push_back(static_cast<double>(made.samples[static_cast<std::size_t>(i)]));
        }
  const auto F = chain.exact.at(points);
  double worst = 0;
  for (std::size_t i = 0; i < F.size(); ++i) worst = std::max(worst, std::abs(computed[i] - F[i]));
  return worst - arithmetic_bound(chain.upsampler, chain.filtered, chain.sups,
                                  columns_for(chain.filtered.geometry, grid, rates.upsampling),
                                  {n[0], n[1], grid.spacing[0], grid.spacing[1], {}, {}},
                                  rates.interpolation);
}

// The largest |trilinear interpolation of F on spacing d0 / rate - F| over random points of random covered
// cells.
double trilinear_error(const Chain& chain, const Grid& grid, int rate, int cells, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vec3> points;
  std::vector<Vec3> fractions;
  for (int c = 0; c < cells; ++c) {
    Vec3 low{}, h{};
    for (std::size_t a = 0; a < 3; ++a) {
      h[a] = grid.spacing[a] / rate;
      low[a] = grid.origin[a] + std::floor(unit(random) * static_cast<double>(grid.cells[a] * rate)) * h[a];
    }
    for (std::size_t corner = 0; corner < 8; ++corner)
      points.push_back({low[0] + ((corner & 1) ? h[0] : 0), low[1] + ((corner & 2) ? h[1] : 0),
                        low[2] + ((corner & 4) ? h[2] : 0)});
    for (int i = 0; i < 4; ++i) {
      const Vec3 f = i == 0 ? Vec3{0.5, 0.5, 0.5} : Vec3{unit(random), unit(random), unit(random)};
      fractions.push_back(f);
      points.push_back({low[0] + f[0] * h[0], low[1] + f[1] * h[1], low[2] + f[2] * h[2]});
    }
  }
  const auto F = chain.exact.at(points);
  double worst = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(cells); ++c) {
    std::array<double, 8> corner{};
    for (std::size_t i = 0; i < 8; ++i) corner[i] = F[c * 12 + i];
    for (std::size_t i = 0; i < 4; ++i)
      worst = std::max(worst, std::abs(trilinear(corner, fractions[c * 4 + i]) - F[c * 12 + 8 + i]));
  }
  return worst;
}

const std::vector<Rates> all_rates{{2, Interpolation::linear, 4},   {4, Interpolation::linear, 4},
                                   {8, Interpolation::linear, 4},   {16, Interpolation::linear, 4},
                                   {2, Interpolation::cubic, 4},    {4, Interpolation::cubic, 4},
                                   {8, Interpolation::cubic, 4},    {16, Interpolation::cubic, 4},
                                   {8, Interpolation::six_taps, 4}, {16, Interpolation::six_taps, 4}};

}  // namespace

BOOST_AUTO_TEST_CASE(projection_bound_holds_at_gold_nodes) {
  for (const auto& [name, scan] : scans()) {
    Chain chain(scan);
    const Grid grid = small_grid(scan.geometry, {4, 4, 2});
    for (const Rates& rates : all_rates) {
      double closest = 0;
      std::int64_t violations = 0, nodes = 0;
      const Stream stream = stream_nodes(chain, grid, 4, rates);
      for (const BrickNodes& brick : stream.bricks) {
        std::vector<Vec3> points;
        for (const Node& node : brick.nodes) points.push_back(node.position);
        const auto exact = chain.exact.at(points);
        for (std::size_t i = 0; i < points.size(); ++i) {
          const double error = std::abs(static_cast<double>(brick.nodes[i].gold) - exact[i]),
                       bound = stream.projection + stream.arithmetic;
          ++nodes;
          if (!(error <= tolerance::bound(bound))) ++violations;
          closest = std::max(closest, error / bound);
        }
      }
      BOOST_TEST(nodes > 0);
      BOOST_TEST(violations == 0, name << ", " << text_of(rates.interpolation) << " " << rates.upsampling
                                       << ": " << violations << " of " << nodes
                                       << " nodes, error / bound up to " << closest);
    }
  }
}

BOOST_AUTO_TEST_CASE(slack_bounds_trilinear_gold_inside_every_gold_cell) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const auto& [name, scan] : scans())
    for (const Rates& rates : {Rates{4, Interpolation::linear, 2},
                               {8, Interpolation::linear, 8},
                               {8, Interpolation::six_taps, 2},
                               {8, Interpolation::six_taps, 4},
                               {16, Interpolation::cubic, 8}}) {
      Chain chain(scan);
      double closest = 0;
      std::int64_t violations = 0, tested = 0;
      const Stream stream = stream_nodes(chain, small_grid(scan.geometry, {4, 4, 4}), 2, rates);
      for (const BrickNodes& brick : stream.bricks) {
        std::vector<Vec3> points;
        std::vector<double> gold;
        std::vector<std::array<double, 2>> bound;  // F above gold, below it
        for (std::int64_t z = 0; z + 1 < brick.side[2]; ++z)
          for (std::int64_t y = 0; y + 1 < brick.side[1]; ++y)
            for (std::int64_t x = 0; x + 1 < brick.side[0]; ++x) {
              if (unit(random) > 0.15) continue;
              std::array<double, 8> corner{};
              std::array<Vec3, 2> box{};
              double above = INFINITY, below = INFINITY;  // every corner's slack covers the cell
              for (std::size_t c = 0; c < 8; ++c) {
                const std::size_t i =
                    static_cast<std::size_t>(((z + static_cast<std::int64_t>(c >> 2)) * brick.side[1] + y +
                                              static_cast<std::int64_t>(c >> 1 & 1)) *
                                                 brick.side[0] +
                                             x + static_cast<std::int64_t>(c & 1));
                const Node& node = brick.nodes[i];
                corner[c] = static_cast<double>(node.gold);
                above = std::min(above, static_cast<double>(node.slack.above));
                below = std::min(below, static_cast<double>(node.slack.below));
                if (c == 0) box[0] = node.position;
                if (c == 7) box[1] = node.position;
              }
              if (above < 0) continue;  // beyond the covered region
              const Vec3 f{unit(random), unit(random), unit(random)};
              Vec3 p{};
              for (std::size_t a = 0; a < 3; ++a) p[a] = (1 - f[a]) * box[0][a] + f[a] * box[1][a];
              points.push_back(p);
              gold.push_back(trilinear(corner, f));
              bound.push_back({above + stream.arithmetic, below + stream.arithmetic});
            }
        const auto exact = chain.exact.at(points);
        for (std::size_t i = 0; i < points.size(); ++i) {
          ++tested;
          const double difference = exact[i] - gold[i], allowed = bound[i][difference > 0 ? 0 : 1];
          if (!(std::abs(difference) <= tolerance::bound(allowed))) ++violations;
          closest = std::max(closest, std::abs(difference) / allowed);
        }
      }
      if (scan.geometry.rows > 1) BOOST_TEST(tested > 0);
      BOOST_TEST(violations == 0, name << ", gold " << rates.gold << ": " << violations << " of " << tested
                                       << ", error / bound up to " << closest);
    }
}

BOOST_AUTO_TEST_CASE(sups_are_never_below_dense_sampling) {
  for (const auto& [name, scan] : scans()) {
    const Chain chain(scan);
    BOOST_TEST(dense_sups(scan, 0, 0, 7) <= tolerance::bound(chain.sups.value), name);
    BOOST_TEST(dense_sups(scan, 2, 0, 7) <= tolerance::bound(chain.sups.second_u), name);
    BOOST_TEST(dense_sups(scan, 0, 2, 7) <=
                   tolerance::bound(chain.sups.second_v) + tolerance::fp64_sum(1000, chain.sups.value),
               name);
  }
}

// Of values alone, derivatives by Bernstein's inequality.
BOOST_AUTO_TEST_CASE(sups_of_values_alone_are_no_smaller) {
  for (const auto& [name, scan] : scans()) {
    Chain chain(scan);
    const FieldSups sups = value_sups(Chain::state(), chain.upsampler, chain.filtered);
    BOOST_TEST(
        std::abs(sups.value - chain.sups.value) <= tolerance::fp64_sum(4 * scan.geometry.views(), sups.value),
        name);
    BOOST_TEST(dense_sups(scan, 2, 0, 7) <= tolerance::bound(sups.second_u), name);
    BOOST_TEST(
        dense_sups(scan, 0, 2, 7) <= tolerance::bound(sups.second_v) + tolerance::fp64_sum(1000, sups.value),
        name);
  }
}

// The largest |q| of each view on the grid that sups are sampled on, by the series itself.
double sampled_sups(const FilteredScan& scan, int density) {
  const ParallelGeometry& g = scan.geometry;
  const auto places = [&](std::int64_t n) {
    std::vector<double> out;
    for (std::int64_t j = 0; j <= density * n; ++j) out.push_back(-0.5 + static_cast<double>(j) / density);
    return out;
  };
  const auto U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);
  const std::vector<double> u = places(g.columns), v = places(g.rows),
                            of_u = resampling_matrix(g.columns, u, 0, 1, density),
                            of_v = resampling_matrix(g.rows, v, 0, 1, density);
  double total = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(g.views()); ++k) {
    std::vector<double> columns(u.size() * V, 0.0);
    for (std::size_t j = 0; j < u.size(); ++j)
      for (std::size_t i = 0; i < U; ++i)
        for (std::size_t l = 0; l < V; ++l)
          columns[j * V + l] += of_u[j * U + i] * static_cast<double>(scan.samples[(k * U + i) * V + l]);
    double largest = 0;
    for (std::size_t j = 0; j < u.size(); ++j)
      for (std::size_t h = 0; h < v.size(); ++h) {
        double q = 0;
        for (std::size_t l = 0; l < V; ++l) q += of_v[h * V + l] * columns[j * V + l];
        largest = std::max(largest, std::abs(q));
      }
    total += largest;
  }
  return total;
}

// Where rows are many they go by transforms: the sup is that of the series, and what it is charged for
// rounding is small beside it.
BOOST_AUTO_TEST_CASE(sups_of_many_rows_are_those_of_the_series) {
  for (const auto& [views, rows, columns] :
       {std::tuple{3, 95, 9}, {3, 96, 9}, {2, 97, 33}, {2, 130, 17}, {1, 257, 4}, {1, 100, 65}}) {
    Chain chain(noise_scan(views + 1, rows, columns, 5));
    const double sampled = sampled_sups(chain.filtered, 4),
                 rise = std::pow(1 / std::cos(std::numbers::pi / 8), 2);
    const FieldSups sups = value_sups(Chain::state(), chain.upsampler, chain.filtered);
    BOOST_TEST(sampled * rise <= sups.value, rows << " rows");
    // A hundred roundings of what the series along both axes can make of the samples.
    double samples = 0;
    for (const double m : chain.filtered.view_max) samples += m;
    const double most = samples * lebesgue_constant(rows) * lebesgue_constant(columns);
    BOOST_TEST(sups.value <= sampled * rise + 100 * unit_roundoff * most, rows << " rows");
    BOOST_TEST(dense_sups(chain.scan, 0, 0, 5) <= sups.value, rows << " rows");
  }
}

BOOST_AUTO_TEST_CASE(sups_at_the_samples_alone_can_be_too_small) {
  // Why the paper's bounds are printed but never decide: its Eq. 5 is 1/8 of the sup, at rate 1.
  const Chain chain(noise_scan(13, 7, 27));
  const Bound by_paper = paper_projection_bounds(Chain::state(), chain.filtered, {1}, 1).front();
  BOOST_TEST(by_paper.value < std::pow(chain.scan.geometry.pitch_u, 2) / 8 * dense_sups(chain.scan, 2, 0, 7));
}

BOOST_AUTO_TEST_CASE(global_bounds_hold_at_every_rate) {
  const std::vector<int> rates{2, 4, 8, 16};
  for (const auto& [name, scan] : scans()) {
    Chain chain(scan);
    const Grid grid = small_grid(scan.geometry, {4, 4, 4});
    const AmplitudeBounds amplitude = amplitude_bounds(chain.filtered, grid, rates);
    for (std::size_t r = 0; r < rates.size(); ++r) {
      const double linear = interpolation_error(chain, grid, {rates[r], Interpolation::linear, 2}),
                   cubic = interpolation_error(chain, grid, {rates[r], Interpolation::cubic, 2}),
                   six = rates[r] < 8
                             ? 0.0
                             : interpolation_error(chain, grid, {rates[r], Interpolation::six_taps, 2});
      const double du = scan.geometry.pitch_u / rates[r], wu = std::numbers::pi / scan.geometry.pitch_u;
      BOOST_TEST(amplitude.projection[r].first == rates[r]);
      BOOST_TEST(linear <= tolerance::bound(amplitude.projection[r].second), name << " " << rates[r]);
      BOOST_TEST(linear <= tolerance::bound(du * du / 8 * chain.sups.second_u), name << " " << rates[r]);
      BOOST_TEST(cubic <= tolerance::bound(3.0 / 128 * std::pow(du, 4) * wu * wu * chain.sups.second_u),
                 name << " " << rates[r]);
      BOOST_TEST(six <= tolerance::bound(six_tap_facts().sup * chain.sups.value), name << " " << rates[r]);
      // The filtered samples of the amplitude bound are those of fp32.
      const double rounding = chain.filtered.ramp_error * lebesgue_constant(scan.geometry.columns) *
                              lebesgue_constant(scan.geometry.rows);
      const double gold = trilinear_error(chain, grid, rates[r], 300, static_cast<unsigned>(r));
      const double h = grid.spacing[0] / rates[r], hz = grid.spacing[2] / rates[r];
      BOOST_TEST(gold <= tolerance::bound(amplitude.gold[r].second) + rounding, name << " " << rates[r]);
      BOOST_TEST(gold <= tolerance::bound((h * h * chain.sups.second_u + hz * hz * chain.sups.second_v) / 8),
                 name << " " << rates[r]);
    }
  }
}

// F = sum of waves cos(k.x + phase): the amplitude bound at rate 1 must hold for any spacing, also one
// coarser than the detector.
BOOST_AUTO_TEST_CASE(amplitude_bound_of_gold_holds_without_oversampling) {
  for (const auto& [name, scan] : scans()) {
    if (scan.geometry.rows == 1) continue;
    const Chain chain(scan);
    for (const double spacing : {0.7, 1.0, 1.4}) {
      GridOptions options;
      options.size = Index3{8, 8, 2};
      options.spacing = spacing;
      const Grid grid = make_grid(scan.geometry, options);
      const double rounding = chain.filtered.ramp_error * lebesgue_constant(scan.geometry.columns) *
                              lebesgue_constant(scan.geometry.rows);
      BOOST_TEST(trilinear_error(chain, grid, 1, 300, 5) <=
                     tolerance::bound(amplitude_bounds(chain.filtered, grid, {1}).gold[0].second) + rounding,
                 name << " spacing " << spacing);
    }
  }
}

BOOST_AUTO_TEST_CASE(lebesgue_constant_bounds_the_interpolation_gain) {
  for (const std::int64_t n : {1, 2, 3, 7, 24, 65}) {
    const UpsampledColumns columns = upsampled_columns(n, 16, 0);
    std::vector<double> x;
    for (std::int64_t j = 0; j < columns.count; ++j) x.push_back(columns.position(j));
    const auto matrix = resampling_matrix(n, x, 0, 1, 0);
    for (std::size_t p = 0; p < x.size(); ++p) {
      double gain = 0;
      for (std::int64_t i = 0; i < n; ++i)
        gain += std::abs(matrix[p * static_cast<std::size_t>(n) + static_cast<std::size_t>(i)]);
      BOOST_TEST(gain <= tolerance::bound(lebesgue_constant(n)));
    }
  }
}
