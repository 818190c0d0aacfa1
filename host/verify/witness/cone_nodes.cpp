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

// Where in the table `pixels` from the middle of pixel 0 are: columns lie half a place beside the detector's
// edge, rows on it.
double table_place(std::size_t axis, double pixels, double density) {
  return (pixels + 0.5) * density - (axis == 0 ? 0.5 : 0.0);
}

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

/// At the covered region's rim, radians that the fastest wave of any view turns by from cell to cell.
Vec3 fastest_wave(const ExactField& field, const Coverage& coverage, const Vec3& spacing) {
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
  for (std::size_t a = 0; a < 3; ++a) band[a] *= spacing[a];
  return band;
}

}  // namespace

// Bounds do not rest on these: they follow from the spacing that is chosen.
ConeNodeRates cone_node_rates(const ExactField& field, const Coverage& coverage, const Vec3& spacing) {
  const Vec3 wave = fastest_wave(field, coverage, spacing);
  const auto rate = [](double radians) {
    int n = 1;
    while (n < (1 << 24) && !(radians / n <= pi / 4)) n *= 2;
    return n;
  };
  return {rate(std::max(wave[0], wave[1])), rate(wave[2])};
}

ConeNodeRates sparse_node_rates(const ExactField& field, const Coverage& coverage, const Vec3& spacing) {
  constexpr double most_radians = 1.4;
  const Vec3 wave = fastest_wave(field, coverage, spacing);
  const auto rate = [](double radians) {
    return static_cast<int>(std::clamp(std::ceil(radians / most_radians), 1.0, double{1 << 24}));
  };
  return {rate(std::max(wave[0], wave[1])), rate(wave[2])};
}

VerifyConeNodes::VerifyConeNodes(opencl::State& state, const ExactField& field, const Coverage& coverage,
                                 double unit)
    : state_(state),
      field_(field),
      coverage_(coverage),
      along_u_(field.geometry().columns, cone_density),
      density_{static_cast<double>(along_u_.places()) / static_cast<double>(field.geometry().columns),
               static_cast<double>(cone_density)},
      unit_(unit),
      upright_(std::all_of(field.views().begin(), field.views().end(),
                           [](const ViewMatrix& m) { return m[0][2] == 0 && m[2][2] == 0; })) {}

/// Which part of the detector's plane the nodes see, in places of the table. Column n lies (n + 1/2) /
/// density - 1/2 pixels from the middle of pixel 0, row n at n / density - 1/2.
struct VerifyConeNodes::Window {
  std::int64_t first_column = 0, columns = 0, first_row = 0, rows = 0;
  double magnitude = 0;  // largest sum of magnitudes of what a place is made of
};

VerifyConeNodes::Window VerifyConeNodes::window_of(const Nodes& wanted,
                                                   const std::vector<cl_int2>& tiles) const {
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
          largest = std::max(largest, density_[0] * (sum / std::abs(seen[2]) + 1));
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
  // One place more on either side than the points need: fp32 may take the place beside. Of lines that lean
  // the rows beyond their ends are read too, and eight rows have the same columns.
  const std::int64_t beside = upright_ ? 1 : 2;
  const auto first = [&](std::size_t a) {
    return static_cast<std::int64_t>(std::floor(table_place(a, low[a], density_[a]))) - points_before -
           beside;
  };
  const auto end = [&](std::size_t a) {
    return static_cast<std::int64_t>(std::floor(table_place(a, high[a], density_[a]))) + cone_points -
           points_before + beside;
  };
  return {first(0), end(0) - first(0), first(1), up_to(end(1) - first(1), CosineTransform::together),
          magnitude};
}

/// Some views at the places of a window: [view][column][row].
struct VerifyConeNodes::Table {
  Table(opencl::State& of, const Window& of_places, std::int64_t at_once)
      : state(of), window(of_places), views(at_once), counted(of, bytes(), "dense filtered projections") {
    // Strips are read in whole vectors, beyond the last row too.
    device = opencl::DeviceArray<float>(state, count(views * per_view() + VDVR_VERIFY_CONE_STRIP),
                                        "dense filtered projections");
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
  opencl::DeviceArray<float> device;
};

// Beyond the detector's edges the series is its own mirror image: cosines are even and periodic.
void VerifyConeNodes::fill(Table& table, std::int64_t first_view) const {
  const ParallelGeometry& g = field_.geometry();
  const std::int64_t U = g.columns, V = g.rows, all = along_u_.places();
  const Window& window = table.window;
  table.first_view = first_view;
  table.filled = std::min(table.views, g.views() - first_view);
  const auto cosine_v = cosine_sums::cosine_period(cone_density * V);
  const auto mirrored = [&](std::int64_t n) {
    std::int64_t m = n % (2 * all);
    if (m < 0) m += 2 * all;
    return m >= all ? 2 * all - 1 - m : m;
  };
  const auto fill_view = [&](std::int64_t k, float* out) {
    const double* a = field_.coefficients().data() + (first_view + k) * U * V;
    std::vector<double> work;
    for (std::int64_t first = 0; first < window.rows; first += most_rows) {
      const std::int64_t rows = std::min(most_rows, window.rows - first);
      std::vector<double> basis(at(V * rows)), line(at(U * rows));
      for (std::int64_t l = 0; l < V; ++l)
        for (std::int64_t r = 0; r < rows; ++r)
          basis[at(l * rows + r)] =
              cosine_v[at(l * std::abs(window.first_row + first + r) % (2 * cone_density * V))];
      cosine_sums::sum_rows(a, U, V, basis, rows, line);
      std::vector<float> dense(at(all * rows));
      for (std::int64_t r = 0; r < rows; r += CosineTransform::together)
        along_u_.values(line.data() + r, rows, unit_, dense.data() + r, rows, work);
      for (std::int64_t n = 0; n < window.columns; ++n)
        std::copy_n(dense.data() + mirrored(window.first_column + n) * rows, rows,
                    out + n * window.rows + first);
    }
  };
  table.device.write_mapped([&](std::span<float> to) {
    parallel_for(table.filled, {}, "",
                 [&](std::int64_t k) { fill_view(k, to.data() + k * table.per_view()); });
  });
}

/// Wanted tiles that are not too far out, and of each which blocks of heights: [tile][block].
struct VerifyConeNodes::Tiles {
  std::vector<cl_int2> first;
  std::vector<std::uint8_t> blocks;
  std::vector<cl_uchar4> ranges;  // first and last x, then y
  std::vector<cl_int> slots;      // among all that are wanted
  opencl::DeviceArray<cl_int> device_slots;
  opencl::DeviceArray<cl_uchar4> device_ranges;
  opencl::DeviceArray<std::uint8_t> device_blocks;
};

ConeNodeFacts VerifyConeNodes::make(const Nodes& wanted, const opencl::DeviceArray<float>& nodes) {
  const std::int64_t K = field_.geometry().views();
  ConeNodeFacts facts;
  const double side_x = tile_nodes * wanted.spacing[0], side_y = tile_nodes * wanted.spacing[1];
  Tiles tiles;
  const std::int64_t blocks = wanted.heights / block;
  for (std::size_t i = 0; i < wanted.tiles.size(); ++i) {
    const auto& t = wanted.tiles[i];
    const double x = wanted.first[0] + static_cast<double>(t[0]) * wanted.spacing[0] + 0.5 * side_x,
                 y = wanted.first[1] + static_cast<double>(t[1]) * wanted.spacing[1] + 0.5 * side_y;
    if (coverage_.margin(x, y) < -wanted.furthest - 0.5 * std::hypot(side_x, side_y)) continue;
    tiles.first.push_back({{to_int(t[0]), to_int(t[1])}});
    tiles.slots.push_back(to_int(static_cast<std::int64_t>(i)));
    constexpr std::array<std::uint8_t, 4> whole{0, tile_nodes - 1, 0, tile_nodes - 1};
    const auto& range = wanted.ranges.empty() ? whole : wanted.ranges[i];
    tiles.ranges.push_back({{range[0], range[1], range[2], range[3]}});
    for (std::int64_t b = 0; b < blocks; ++b)
      tiles.blocks.push_back(wanted.blocks.empty() ? std::uint8_t{1} : wanted.blocks[i * at(blocks) + at(b)]);
  }
  if (tiles.first.empty()) return facts;
  const Window window = window_of(wanted, tiles.first);
  // Sums within a call and sums of calls err alike.
  const auto even = std::clamp<std::int64_t>(std::llround(std::sqrt(static_cast<double>(K))), 8, 32);
  const std::uint64_t each = sizeof(float) * count(window.columns * window.rows),
                      share = std::min(state_.memory.left() / 4, state_.info.max_allocation);
  facts.together = std::clamp<std::int64_t>(static_cast<std::int64_t>(share / each), 1, std::min(even, K));
  facts.calls = (K + facts.together - 1) / facts.together;
  Table table(state_, window, facts.together);
  tiles.device_slots = {state_, std::span<const cl_int>(tiles.slots), "tiles of nodes"};
  tiles.device_blocks = {state_, std::span<const std::uint8_t>(tiles.blocks), "heights of tiles of nodes"};
  tiles.device_ranges = {state_, std::span<const cl_uchar4>(tiles.ranges), "wanted nodes of tiles"};
  for (std::int64_t first = 0; first < K; first += facts.together) {
    fill(table, first);
    back_project(wanted, tiles, table, nodes, facts);
    opencl::finish(state_, "nodes of the field to verify against");  // before the table changes
  }
  const double host = 32 * 0x1p-53 * window.magnitude;
  facts.density_u = density_[0];
  facts.place_u = (facts.place_u + host) / density_[0];
  facts.place_v = (facts.place_v + host) / density_[1];
  return facts;
}

namespace {

/// One of two places in the table about a block's middle, and how it errs in fp32.
struct Place {
  cl_float4 numbers{};
  int whole = 0;
  double reach = 0, error = 0;
};

// (n0 + sum_e n_e d_e) / (l0 + sum_e l_e d_e) less its value m in the middle is sum_e (n_e - m l_e) d_e over
// lambda. Numerator: four roundings of a term at most. Lambda: l0 once, its steps' terms three times at most,
// two sums; with l0 and the steps' terms `cancellation` times lambda, the latter `growth`. Its reciprocal
// once, after a step of Newton's. Then what is left of the middle, and the sum with it, up to twice the reach
// and two places more.
Place place_of(const ViewMatrix& m, std::size_t axis, const Vec3& seen, const Vec3& spacing,
               double lambda_min, double cancellation, double growth, std::int64_t first, double density) {
  Place out;
  for (std::size_t e = 0; e < 3; ++e) {
    const double step = (m[axis][e] - seen[axis] * m[2][e]) * spacing[e] * density;
    out.numbers.s[e] = static_cast<float>(step);
    out.reach += std::abs(step) * half_block[e] / lambda_min;
  }
  const double middle = table_place(axis, seen[axis], density), whole = std::floor(middle - out.reach) - 1;
  out.numbers.s[3] = static_cast<float>(middle - whole);
  out.whole = to_int(static_cast<std::int64_t>(whole) - first);
  out.error = 1.01 * half_ulp * (out.reach * (10 + cancellation + 4 * growth) + 5);
  return out;
}

/// The views of a launch: what they err, and what strips along the lines of columns of nodes would need.
struct Launch {
  ConeNodeFacts facts;
  double row_step = 0;  // rows of the table from a height to the next one
  double lean = 0;      // columns of the table a row
  double place_u = 0;   // what places along u err where rows are interpolated along such lines

  void add(const Launch& other) {
    facts.place_u = std::max(facts.place_u, other.facts.place_u);
    facts.place_v = std::max(facts.place_v, other.facts.place_v);
    facts.cancellation = std::max(facts.cancellation, other.facts.cancellation);
    row_step = std::max(row_step, other.row_step);
    lean = std::max(lean, other.lean);
    place_u = std::max(place_u, other.place_u);
  }
};

// Places on eight rows lie at most half a place beyond the two points that their middle lies between
// (docs/error-bounds.md).
constexpr double most_lean = 0.12;

// X of z at a node is the middle's less lambda's step times the way there. Both round by (12 + cancellation +
// 4 growth) of their magnitudes, which are three times X_v at most; their quotient three times more.
void look_along(const Place& u, const Place& v, double lambda_step, double lambda_min, double cancellation,
                double growth, Launch& out) {
  const double along_u = std::abs(static_cast<double>(u.numbers.s[2])) + lambda_step * u.reach,
               of_v = std::abs(static_cast<double>(v.numbers.s[2])), along_v = of_v + lambda_step * v.reach,
               least = of_v - lambda_step * v.reach;
  out.row_step = std::max(out.row_step, along_v / lambda_min * (lambda_step > 0 ? cancellation : 1));
  const double lean = least > 0.5 * of_v ? along_u / least : HUGE_VAL;
  out.lean = std::max(out.lean, lean);
  constexpr double rows = VDVR_VERIFY_CONE_STRIP;
  const double slope = 4 * (12 + cancellation + 4 * growth) + 3,
               along = u.error + lean * v.error +
                       1.01 * half_ulp * (lean * ((rows + 8) * slope + 2 * rows) + 2 * u.reach + 8);
  // Eight rows err by it each; and where the height's own place is wrong the line is.
  out.place_u = std::max(out.place_u, sum_of_cone_weights * along + lean * v.error);
}

/// One view's numbers about a block's middle, which are taken into account.
ViewNumbers numbers_about(const ViewMatrix& m, const Vec3& middle, const Vec3& spacing,
                          std::int64_t first_column, std::int64_t first_row,
                          const std::array<double, 2>& density, Launch& launch) {
  const Vec3 seen = projected(m, middle);
  double growth = 0;
  ViewNumbers out{};
  for (std::size_t e = 0; e < 3; ++e) {
    out.lambda.s[e] = static_cast<float>(m[2][e] * spacing[e]);
    growth += std::abs(m[2][e]) * spacing[e] * half_block[e];
  }
  out.lambda.s[3] = static_cast<float>(seen[2]);
  const double least = seen[2] - growth, cancellation = (seen[2] + growth) / least;
  const Place at_u = place_of(m, 0, seen, spacing, least, cancellation, growth / least, first_column,
                              density[0]),
              at_v =
                  place_of(m, 1, seen, spacing, least, cancellation, growth / least, first_row, density[1]);
  out.u = at_u.numbers;
  out.v = at_v.numbers;
  out.whole = {{at_u.whole, at_v.whole, 0, 0}};
  launch.facts.place_u = std::max(launch.facts.place_u, at_u.error);
  launch.facts.place_v = std::max(launch.facts.place_v, at_v.error);
  launch.facts.cancellation = std::max(launch.facts.cancellation, cancellation);
  look_along(at_u, at_v, std::abs(m[2][2]) * spacing[2], least, cancellation, growth / least, launch);
  return out;
}

}  // namespace

void VerifyConeNodes::back_project(const Nodes& wanted, const Tiles& tiles, const Table& table,
                                   const opencl::DeviceArray<float>& nodes, ConeNodeFacts& facts) {
  const std::int64_t blocks = wanted.heights / block, of_tile = blocks * table.filled,
                     all = static_cast<std::int64_t>(tiles.first.size()),
                     together = std::max<std::int64_t>(
                         1, static_cast<std::int64_t>(most_numbers / sizeof(ViewNumbers)) / of_tile);
  const int lanes = opencl::lanes_of(state_.info, VDVR_VERIFY_CONE_HEIGHTS);
  std::mutex lock;
  for (std::int64_t first = 0; first < all; first += together) {
    const std::int64_t n = std::min(together, all - first);
    std::vector<ViewNumbers> numbers(at(n * of_tile));
    Launch launch;
    parallel_for(n, {}, "", [&](std::int64_t t) {
      Launch own;
      for (std::int64_t b = 0; b < blocks; ++b) {
        if (tiles.blocks[at((first + t) * blocks + b)] == 0) continue;
        const cl_int2& node = tiles.first[at(first + t)];
        Vec3 middle{static_cast<double>(node.s[0]), static_cast<double>(node.s[1]),
                    static_cast<double>(b * block)};
        for (std::size_t a = 0; a < 3; ++a)
          middle[a] = wanted.first[a] + (middle[a] + half_block[a]) * wanted.spacing[a];
        for (std::int64_t k = 0; k < table.filled; ++k)
          numbers[at((t * blocks + b) * table.filled + k)] =
              numbers_about(field_.views()[at(table.first_view + k)], middle, wanted.spacing,
                            table.window.first_column, table.window.first_row, density_, own);
      }
      const std::lock_guard guard(lock);
      launch.add(own);
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
                               .all_heights = to_int(wanted.heights),
                               .used = to_int(wanted.used)};
    // Eight rows from each of a block's places on; places may round to the row beside. A device whose
    // work-items have no caches of their own gains nothing.
    const double rows = static_cast<double>(block - 1) * launch.row_step + cone_points + 2;
    const bool strips = lanes == VDVR_VERIFY_CONE_HEIGHTS && rows <= VDVR_VERIFY_CONE_STRIP &&
                        (upright_ || launch.lean <= most_lean);
    facts.place_u = std::max(facts.place_u, strips && !upright_ ? launch.place_u : launch.facts.place_u);
    facts.place_v = std::max(facts.place_v, launch.facts.place_v);
    facts.cancellation = std::max(facts.cancellation, launch.facts.cancellation);
    if (strips && !upright_) facts.lean = std::max(facts.lean, launch.lean * density_[1] / density_[0]);
    const std::int64_t groups = strips ? blocks : up_to(wanted.used, VDVR_VERIFY_CONE_HEIGHTS) / lanes;
    opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrVerifyCone>
        kernel(state_, "verify/witness/verify_cone", "verify_cone",
               {{"VDVR_UPRIGHT", upright_ ? "1" : "0"},
                {"VDVR_STRIPS", strips ? "1" : "0"},
                {"VDVR_LANES", std::to_string(lanes)}});
    kernel(opencl::in_groups(state_.info, {count(groups), count(tile_nodes), count(n)},
                             {count(strips ? 1 : std::min<std::int64_t>(groups, 8)), count(tile_nodes), 1},
                             strips ? 1 : 0),
           nodes.buffer(), table.device.buffer(), on_device.buffer(), tiles.device_slots.buffer(),
           tiles.device_blocks.buffer(), tiles.device_ranges.buffer(), shape);
    opencl::finish(state_, "nodes of the field to verify against");  // before the numbers go
  }
}

}  // namespace vdvr
