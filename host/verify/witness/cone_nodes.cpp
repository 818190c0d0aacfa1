// Double precision on the host up to the tables and the numbers of blocks, fp32 on the device from there on.
#include "host/verify/witness/cone_nodes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/opencl/work_groups.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/verify/witness/cosine_sums.hpp"
#include "host/verify/witness/lagrange.hpp"
#include "shared/verify_cone.h"
#include "shared/verify_nodes.h"
#include "vdvr/error.hpp"
#include "vdvr/expert/cone_geometry.hpp"

namespace vdvr {

static_assert(sizeof(VdvrVerifyCone) == 36);

namespace {

using std::numbers::pi;
constexpr std::int64_t tile_nodes = VDVR_VERIFY_TILE;  // nodes of its side
constexpr std::int64_t block = VDVR_VERIFY_CONE_BLOCK;
constexpr std::int64_t points_before =
    cone_points / 2 - 1;                // points that a polynomial takes before the place
constexpr std::int64_t most_rows = 64;  // summed at a time, so that their lines stay in cache
constexpr std::uint64_t most_numbers = std::uint64_t{16} << 20;  // bytes of a launch
// Half of a block, in nodes.
constexpr Vec3 half_block{0.5 * (tile_nodes - 1), 0.5 * (tile_nodes - 1), 0.5 * (block - 1)};

/// As kernels/verify/witness/verify_cone.cl reads it.
struct ViewNumbers {
  cl_float4 u, v, lambda;
  cl_int4 whole;
};
static_assert(sizeof(ViewNumbers) == 64);

std::int64_t up_to(std::int64_t n, std::int64_t multiple) { return (n + multiple - 1) / multiple * multiple; }

// At a point, the frequency along an axis of the fastest wave that a view can add, radians for each unit of
// length.
double band_at(const ViewMatrix& m, const Vec3& point, std::size_t axis, bool rows) {
  const Vec3 seen = projected(m, point);
  return pi *
         (std::abs(m[0][axis] - seen[0] * m[2][axis]) +
          (rows ? std::abs(m[1][axis] - seen[1] * m[2][axis]) : 0.0)) /
         seen[2];
}

}  // namespace

// Bounds do not rest on this: they follow from the spacing that is chosen.
ConeNodeRates cone_node_rates(const ExactField& field, const Coverage& coverage, const Vec3& spacing) {
  constexpr int directions = 64;
  Vec3 band{};
  for (int d = 0; d < directions; ++d)
    for (const double z : {coverage.heights().first, coverage.heights().second}) {
      const double phi = 2 * pi * d / directions, r = coverage.inner_radius();
      for (const ViewMatrix& m : field.views())
        for (std::size_t a = 0; a < 3; ++a)
          band[a] = std::max(
              band[a], band_at(m, {r * std::cos(phi), r * std::sin(phi), z}, a, field.geometry().rows > 1));
    }
  const auto rate = [](double radians) {
    int n = 1;
    while (n < (1 << 24) && !(radians / n <= pi / 4)) n *= 2;
    return n;
  };
  return {rate(std::max(band[0] * spacing[0], band[1] * spacing[1])), rate(band[2] * spacing[2])};
}

VerifyConeNodes::VerifyConeNodes(opencl::State& state, const ExactField& field, const Coverage& coverage,
                                 double unit, double furthest)
    : state_(state),
      field_(field),
      coverage_(coverage),
      unit_(unit),
      furthest_(furthest),
      upright_(std::all_of(field.views().begin(), field.views().end(),
                           [](const ViewMatrix& m) { return m[0][2] == 0 && m[2][2] == 0; })) {}

/// Which part of the detector's plane the nodes see, in places of the table: place n lies n / cone_density -
/// 1/2 pixels from the middle of pixel 0.
struct VerifyConeNodes::Window {
  std::int64_t first_column = 0, columns = 0, first_row = 0, rows = 0;
  double magnitude = 0;  // largest sum of magnitudes of what a place is made of
};

VerifyConeNodes::Window VerifyConeNodes::window_of(const Nodes& wanted,
                                                   const std::vector<cl_int2>& tiles) const {
  constexpr double density = cone_density;
  Vec3 low{HUGE_VAL, HUGE_VAL, 0}, high{-HUGE_VAL, -HUGE_VAL, 0};
  double magnitude = 0;
  std::mutex lock;
  parallel_for(field_.geometry().views(), {}, "", [&](std::int64_t k) {
    const ViewMatrix& m = field_.views()[at(k)];
    Vec3 least{HUGE_VAL, HUGE_VAL, HUGE_VAL}, most{-HUGE_VAL, -HUGE_VAL, 0};
    double largest = 0;
    for (const cl_int2& t : tiles)
      for (int corner = 0; corner < 8; ++corner) {
        const std::array<double, 3> node{
            static_cast<double>(t.s[0] + ((corner & 1) != 0 ? tile_nodes - 1 : 0)),
            static_cast<double>(t.s[1] + ((corner & 2) != 0 ? tile_nodes - 1 : 0)),
            (corner & 4) != 0 ? static_cast<double>(wanted.heights - 1) : 0.0};
        Vec3 p{};
        for (std::size_t a = 0; a < 3; ++a) p[a] = wanted.first[a] + node[a] * wanted.spacing[a];
        const Vec3 seen = projected(m, p);
        // A ratio of affine functions is largest and least at corners.
        for (std::size_t a = 0; a < 2; ++a) {
          least[a] = std::min(least[a], seen[a]);
          most[a] = std::max(most[a], seen[a]);
          double sum = std::abs(m[a][3]) + std::abs(seen[a] * m[2][3]);
          for (std::size_t e = 0; e < 3; ++e)
            sum += (std::abs(m[a][e]) + std::abs(seen[a] * m[2][e])) * std::abs(p[e]);
          largest = std::max(largest, density * (sum / std::abs(seen[2]) + 1));
        }
        least[2] = std::min(least[2], seen[2]);
      }
    const std::lock_guard guard(lock);
    if (!(least[2] > 0))
      throw InputError(fmt::format(
          "cone beam: nodes around the covered region reach the plane of the source of view {}", k));
    for (std::size_t a = 0; a < 2; ++a) {
      low[a] = std::min(low[a], least[a]);
      high[a] = std::max(high[a], most[a]);
    }
    magnitude = std::max(magnitude, largest);
  });
  // One place more on either side than the points need: fp32 may take the place beside.
  const auto first = [&](std::size_t a) {
    return static_cast<std::int64_t>(std::floor((low[a] + 0.5) * density)) - points_before - 1;
  };
  const auto end = [&](std::size_t a) {
    return static_cast<std::int64_t>(std::floor((high[a] + 0.5) * density)) + cone_points - points_before + 1;
  };
  return {first(0), end(0) - first(0), first(1), up_to(end(1) - first(1), cosine_sums::lanes), magnitude};
}

/// Some views at the places of a window, on the host and on the device: [view][column][row].
struct VerifyConeNodes::Table {
  Table(opencl::State& of, const Window& of_places, std::int64_t at_once)
      : state(of), window(of_places), views(at_once), counted(of, bytes(), "dense filtered projections") {
    host.resize(at(views * per_view()));
    device = opencl::DeviceArray<float>(state, count(views * per_view()), "dense filtered projections");
  }
  ~Table() = default;
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  [[nodiscard]] std::int64_t per_view() const { return window.columns * window.rows; }
  [[nodiscard]] std::uint64_t bytes() const { return sizeof(float) * count(views * per_view()); }

  opencl::State& state;
  Window window;
  std::int64_t views;  // at a time
  HostMemory counted;
  std::int64_t first_view = 0, filled = 0;
  std::vector<float> host;
  opencl::DeviceArray<float> device;
};

// Beyond the detector's edges the series is its own mirror image: cosines are even and periodic.
void VerifyConeNodes::fill(Table& table, std::int64_t first_view) const {
  const ParallelGeometry& g = field_.geometry();
  const std::int64_t U = g.columns, V = g.rows, last = cone_density * U;
  const Window& window = table.window;
  table.first_view = first_view;
  table.filled = std::min(table.views, g.views() - first_view);
  const auto cosine_u = cosine_sums::cosine_period(last),
             cosine_v = cosine_sums::cosine_period(cone_density * V);
  const auto mirrored = [&](std::int64_t n) {
    const std::int64_t m = std::abs(n) % (2 * last);
    return m > last ? 2 * last - m : m;
  };
  parallel_for(table.filled, {}, "", [&](std::int64_t k) {
    const double* a = field_.coefficients().data() + (first_view + k) * U * V;
    float* out = table.host.data() + k * table.per_view();
    for (std::int64_t first = 0; first < window.rows; first += most_rows) {
      const std::int64_t rows = std::min(most_rows, window.rows - first);
      std::vector<double> basis(at(V * rows)), line(at(U * rows));
      for (std::int64_t l = 0; l < V; ++l)
        for (std::int64_t r = 0; r < rows; ++r)
          basis[at(l * rows + r)] =
              cosine_v[at(l * std::abs(window.first_row + first + r) % (2 * cone_density * V))];
      cosine_sums::sum_rows(a, U, V, basis, rows, line);
      std::vector<float> dense(at((last + 1) * rows));
      cosine_sums::sum_columns(
          line, U, rows, cone_density, cosine_u,
          [&](std::int64_t n, std::int64_t r, const std::array<double, cosine_sums::lanes>& values) {
            for (std::int64_t i = 0; i < cosine_sums::lanes; ++i)
              dense[at(n * rows + r + i)] = static_cast<float>(values[at(i)] / unit_);
          });
      for (std::int64_t n = 0; n < window.columns; ++n)
        std::copy_n(dense.data() + mirrored(window.first_column + n) * rows, rows,
                    out + n * window.rows + first);
    }
  });
  table.device.write(std::span<const float>(table.host).first(at(table.filled * table.per_view())));
}

ConeNodeFacts VerifyConeNodes::make(const Nodes& wanted, const opencl::DeviceArray<float>& nodes) {
  const std::int64_t K = field_.geometry().views();
  ConeNodeFacts facts;
  const double side_x = tile_nodes * wanted.spacing[0], side_y = tile_nodes * wanted.spacing[1];
  std::vector<cl_int2> tiles;
  for (const auto& t : wanted.tiles) {
    const double x = wanted.first[0] + static_cast<double>(t[0]) * wanted.spacing[0] + 0.5 * side_x,
                 y = wanted.first[1] + static_cast<double>(t[1]) * wanted.spacing[1] + 0.5 * side_y;
    if (coverage_.margin(x, y) >= -furthest_ - 0.5 * std::hypot(side_x, side_y))
      tiles.push_back({{to_int(t[0]), to_int(t[1])}});
  }
  if (tiles.empty()) return facts;
  const Window window = window_of(wanted, tiles);
  // Sums within a call and sums of calls err alike.
  const auto even = std::clamp<std::int64_t>(std::llround(std::sqrt(static_cast<double>(K))), 8, 32);
  const std::uint64_t each = sizeof(float) * count(window.columns * window.rows),
                      share = std::min(state_.memory.left() / 4, state_.info.max_allocation);
  facts.together = std::clamp<std::int64_t>(static_cast<std::int64_t>(share / each), 1, std::min(even, K));
  facts.calls = (K + facts.together - 1) / facts.together;
  Table table(state_, window, facts.together);
  const opencl::DeviceArray<cl_int2> device_tiles(state_, std::span<const cl_int2>(tiles), "tiles of nodes");
  for (std::int64_t first = 0; first < K; first += facts.together) {
    fill(table, first);
    back_project(wanted, tiles, table, device_tiles, nodes, facts);
    opencl::finish(state_, "nodes of the field to verify against");  // before the table changes
  }
  const double host = 32 * 0x1p-53 * window.magnitude;
  for (double* place : {&facts.place_u, &facts.place_v}) *place = (*place + host) / cone_density;
  return facts;
}

namespace {

/// One of two places in the table about a block's middle, and how it errs in fp32.
struct Place {
  cl_float4 numbers{};
  int whole = 0;
  double error = 0;
};

// (n0 + sum_e n_e d_e) / (l0 + sum_e l_e d_e) less its value m in the middle is sum_e (n_e - m l_e) d_e over
// lambda. Numerator: five roundings of each term. Lambda: five, of terms `cancellation` as large as itself;
// its reciprocal 2.5 units in the last place, the product one. Then the sum with what is left of the middle.
Place place_of(const ViewMatrix& m, std::size_t axis, const Vec3& seen, const Vec3& spacing,
               double lambda_min, double cancellation, std::int64_t first) {
  Place out;
  double reach = 0;
  for (std::size_t e = 0; e < 3; ++e) {
    const double step = (m[axis][e] - seen[axis] * m[2][e]) * spacing[e] * cone_density;
    out.numbers.s[e] = static_cast<float>(step);
    reach += std::abs(step) * half_block[e] / lambda_min;
  }
  const double middle = (seen[axis] + 0.5) * cone_density, whole = std::floor(middle - reach) - 1;
  out.numbers.s[3] = static_cast<float>(middle - whole);
  out.whole = to_int(static_cast<std::int64_t>(whole) - first);
  out.error = 1.01 * half_ulp * (reach * (14 + 5 * cancellation) + 4);
  return out;
}

}  // namespace

void VerifyConeNodes::back_project(const Nodes& wanted, const std::vector<cl_int2>& tiles, const Table& table,
                                   const opencl::DeviceArray<cl_int2>& device_tiles,
                                   const opencl::DeviceArray<float>& nodes, ConeNodeFacts& facts) {
  const std::int64_t blocks = wanted.heights / block, of_tile = blocks * table.filled,
                     all = static_cast<std::int64_t>(tiles.size()),
                     together = std::max<std::int64_t>(
                         1, static_cast<std::int64_t>(most_numbers / sizeof(ViewNumbers)) / of_tile);
  const int lanes = opencl::lanes_of(state_.info, VDVR_VERIFY_CONE_HEIGHTS);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrVerifyCone> kernel(
      state_, "verify/witness/verify_cone", "verify_cone",
      {{"VDVR_UPRIGHT", upright_ ? "1" : "0"}, {"VDVR_LANES", std::to_string(lanes)}});
  std::mutex lock;
  for (std::int64_t first = 0; first < all; first += together) {
    const std::int64_t n = std::min(together, all - first);
    std::vector<ViewNumbers> numbers(at(n * of_tile));
    parallel_for(n, {}, "", [&](std::int64_t t) {
      ConeNodeFacts own;
      for (std::int64_t b = 0; b < blocks; ++b)
        for (std::int64_t k = 0; k < table.filled; ++k) {
          const ViewMatrix& m = field_.views()[at(table.first_view + k)];
          const std::array<double, 3> middle{static_cast<double>(tiles[at(first + t)].s[0]) + half_block[0],
                                             static_cast<double>(tiles[at(first + t)].s[1]) + half_block[1],
                                             static_cast<double>(b * block) + half_block[2]};
          Vec3 p{};
          for (std::size_t a = 0; a < 3; ++a) p[a] = wanted.first[a] + middle[a] * wanted.spacing[a];
          const Vec3 seen = projected(m, p);
          double growth = 0;
          ViewNumbers& out = numbers[at((t * blocks + b) * table.filled + k)];
          for (std::size_t e = 0; e < 3; ++e) {
            out.lambda.s[e] = static_cast<float>(m[2][e] * wanted.spacing[e]);
            growth += std::abs(m[2][e]) * wanted.spacing[e] * half_block[e];
          }
          out.lambda.s[3] = static_cast<float>(seen[2]);
          const double least = seen[2] - growth, cancellation = (seen[2] + growth) / least;
          const Place at_u = place_of(m, 0, seen, wanted.spacing, least, cancellation,
                                      table.window.first_column),
                      at_v =
                          place_of(m, 1, seen, wanted.spacing, least, cancellation, table.window.first_row);
          out.u = at_u.numbers;
          out.v = at_v.numbers;
          out.whole = {{at_u.whole, at_v.whole, 0, 0}};
          own.place_u = std::max(own.place_u, at_u.error);
          own.place_v = std::max(own.place_v, at_v.error);
          own.cancellation = std::max(own.cancellation, cancellation);
        }
      const std::lock_guard guard(lock);
      facts.place_u = std::max(facts.place_u, own.place_u);
      facts.place_v = std::max(facts.place_v, own.place_v);
      facts.cancellation = std::max(facts.cancellation, own.cancellation);
    });
    const opencl::DeviceArray<ViewNumbers> on_device(state_, std::span<const ViewNumbers>(numbers),
                                                     "view positions");
    const VdvrVerifyCone shape{.accumulate = table.first_view > 0 ? 1 : 0,
                               .views = to_int(table.filled),
                               .columns = to_int(table.window.columns),
                               .rows = to_int(table.window.rows),
                               .first_tile = to_int(first),
                               .tiles = to_int(n),
                               .blocks = to_int(blocks),
                               .nx = to_int(wanted.nx),
                               .all_heights = to_int(wanted.heights)};
    const std::int64_t groups = up_to(wanted.used, VDVR_VERIFY_CONE_HEIGHTS) / lanes;
    kernel(opencl::in_groups(state_.info, {count(groups), count(tile_nodes), count(n)},
                             {count(std::min<std::int64_t>(groups, 8)), count(tile_nodes), 1}),
           nodes.buffer(), table.device.buffer(), on_device.buffer(), device_tiles.buffer(), shape);
    opencl::finish(state_, "nodes of the field to verify against");  // before the numbers go
  }
}

}  // namespace vdvr
