// Double precision on the host up to the table of fine columns and the matrix along z, fp32 on the device
// from there on.
#include "host/verify/witness/nodes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/opencl/host_memory.hpp"
#include "host/base/opencl/work_groups.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/verify/witness/cosine_sums.hpp"
#include "host/verify/witness/lagrange.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrVerifyRows) == 32 && sizeof(VdvrVerifyHeights) == 28 &&
              sizeof(VdvrVerifyBetween) == 36);
static_assert(VDVR_VERIFY_VIEWS == views_per_run && VDVR_VERIFY_ROWS == rows_per_run);

namespace {

using std::numbers::pi;
constexpr std::int64_t row_lanes = 16;           // of a vector along z
constexpr std::int64_t tile = VDVR_VERIFY_TILE;  // nodes of its side
constexpr std::int64_t beyond = 64;              // floats after a buffer's end that vectors may touch

std::int64_t up(std::int64_t n, std::int64_t multiple) { return (n + multiple - 1) / multiple * multiple; }

std::int64_t floor_of(std::int64_t n, std::int64_t by) { return n >= 0 ? n / by : -((-n + by - 1) / by); }

std::int64_t rows_of(const VerifyNodes::Part& part, std::int64_t rows) { return part.rows ? rows : part.nz; }

/// Nodes of a block's side from which so many values between them are made, wherever the first lies.
std::int64_t nodes_before(std::int64_t after, const BetweenNodes& b) {
  return b.made() ? ((after - 1) * b.by + b.factor - 1) / b.factor + b.points : after;
}

}  // namespace

int nodes_across(const Grid& grid, const ParallelGeometry& g) {
  const double spacing = std::max(grid.spacing[0], grid.spacing[1]);
  int n = 1;
  while (n < (1 << 24) && !(spacing / static_cast<double>(n) <= 0.25 * g.pitch_u)) n *= 2;
  return n;
}

VerifyNodes::VerifyNodes(opencl::State& state, const ExactField& field, const Grid& grid, double unit,
                         double furthest)
    : state_(state),
      field_(field),
      grid_(grid),
      unit_(unit),
      along_u_(field.geometry().columns, fine_columns),
      density_(static_cast<double>(along_u_.places()) / static_cast<double>(field.geometry().columns)),
      gain_(row_gain(field.geometry().rows)) {
  pad_ = static_cast<std::int64_t>(std::ceil(furthest / field.geometry().pitch_u * density_)) + 6;
  columns_ = along_u_.places() + 2 * pad_;
}

VerifyNodes::VerifyNodes(opencl::State& state, const ExactField& field, const Coverage& coverage,
                         const Grid& grid, double unit)
    : state_(state), field_(field), grid_(grid), unit_(unit), along_u_(1, 1), density_(fine_columns) {
  cone_.emplace(state, field, coverage, unit);
}

std::uint64_t VerifyNodes::bytes_of(const Part& part) const {
  const auto wanted = std::max<std::int64_t>(1, std::count(part.tiles.begin(), part.tiles.end(), 1));
  const std::int64_t nodes = tile * tile * up(rows_of(part, field_.geometry().rows), row_lanes);
  return count(wanted) * (4 * count(nodes) +
                          (cone_ ? std::uint64_t{0} : sizeof(cl_float4) * count(field_.geometry().views())));
}

std::int64_t VerifyNodes::views_at_once() const {
  const auto budget =
      static_cast<std::int64_t>(std::min(state_.memory.left() / 8, state_.info.max_allocation));
  return std::clamp<std::int64_t>(budget / (4 * columns_ * row_lanes), 1, field_.geometry().views());
}

/// 16 rows of the fine columns of some views.
struct VerifyNodes::Table {
  Table(opencl::State& of, std::int64_t columns, std::int64_t at_once)
      : state(of),
        per_view(columns * row_lanes),
        views(at_once),
        counted(of, bytes(), "fine columns of the filtered projections") {
    device = opencl::DeviceArray<float>(state, count(views * per_view + beyond),
                                        "fine columns of the filtered projections");
  }
  ~Table() = default;
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  [[nodiscard]] std::uint64_t bytes() const { return 4 * count(views * per_view); }

  opencl::State& state;
  std::int64_t per_view, views;  // floats; views at a time
  HostMemory counted;
  std::int64_t first_view = 0, filled = 0;
  opencl::DeviceArray<float> device;
};

VerifyNodes::~VerifyNodes() = default;

void VerifyNodes::release() {
  nodes_.reset();
  slots_.reset();
  steps_.reset();
  table_.reset();
}

void VerifyNodes::fill(std::int64_t first_row, std::int64_t first_view) {
  Table& table = *table_;
  const ParallelGeometry& g = field_.geometry();
  const std::int64_t U = g.columns, V = g.rows, all = along_u_.places();
  table.first_view = first_view;
  table.filled = std::min(table.views, g.views() - first_view);
  std::vector<double> basis(at(V * row_lanes));
  for (std::int64_t r = 0; r < row_lanes; ++r) {
    // Places beyond the last are computed like it: what is never read is finite at least.
    const auto row = static_cast<double>(std::min(first_row + r, rows_of(part_, V) - 1));
    const double z = grid_.origin[2] + (static_cast<double>(part_.first_z) + row) /
                                           static_cast<double>(part_.along) * grid_.spacing[2];
    const double half = part_.rows ? row + 0.5 : z / g.pitch_v + 0.5 * static_cast<double>(V);
    for (std::int64_t l = 0; l < V; ++l)
      basis[at(l * row_lanes + r)] = std::cos(pi * static_cast<double>(l) * half / static_cast<double>(V));
  }
  const auto fill_view = [&](std::int64_t k, float* out) {
    std::vector<double> line(at(U * row_lanes)), work;
    cosine_sums::sum_rows(field_.coefficients().data() + (first_view + k) * U * V, U, V, basis, row_lanes,
                          line);
    along_u_.values(line.data(), row_lanes, unit_, out + pad_ * row_lanes, row_lanes, work);
    // Beyond the detector's edges, half a place before the first and after the last, the series is its own
    // mirror image.
    const auto mirror = [&](std::int64_t n) {
      std::int64_t m = (n - pad_) % (2 * all);
      if (m < 0) m += 2 * all;
      if (m >= all) m = 2 * all - 1 - m;
      std::copy_n(out + (m + pad_) * row_lanes, row_lanes, out + n * row_lanes);
    };
    for (std::int64_t n = 0; n < pad_; ++n) {
      mirror(n);
      mirror(columns_ - 1 - n);
    }
  };
  table.device.write_mapped([&](std::span<float> to) {
    parallel_for(table.filled, {}, "", [&](std::int64_t k) { fill_view(k, to.data() + k * table.per_view); });
  });
}

// Where each view sees the first node of a tile, and its steps across it.
void VerifyNodes::make_steps(const std::vector<std::array<std::int64_t, 2>>& tiles) {
  const ParallelGeometry& g = field_.geometry();
  const std::size_t K = g.theta_rad.size();
  const double scale = density_ / g.pitch_u, n = part_.across;
  std::vector<std::array<double, 2>> directions;
  for (const double theta : g.theta_rad) directions.push_back({std::cos(theta), std::sin(theta)});
  const auto step = [&](const std::array<std::int64_t, 2>& node, std::size_t k) {
    const auto& [c, s] = directions[k];
    const double t =
        (grid_.origin[0] + static_cast<double>(part_.first_x + node[0]) / n * grid_.spacing[0]) * c +
        (grid_.origin[1] + static_cast<double>(part_.first_y + node[1]) / n * grid_.spacing[1]) * s;
    // The detector's edge lies half a pixel before column 0, and half a fine column before the first that
    // the padding leaves.
    const double column =
        (t / g.pitch_u + g.center_of_view(k) + 0.5) * density_ - 0.5 + static_cast<double>(pad_);
    const double along_x = c * grid_.spacing[0] / n * scale, along_y = s * grid_.spacing[1] / n * scale;
    const double whole =
        std::floor(column + std::min(0.0, along_x * tile) + std::min(0.0, along_y * tile)) - 1;
    return cl_float4{{static_cast<float>(along_x), static_cast<float>(along_y),
                      static_cast<float>(column - whole), static_cast<float>(whole)}};
  };
  steps_.emplace(state_, tiles.size() * K, "view positions");
  steps_->write_mapped([&](std::span<cl_float4> steps) {
    parallel_for(static_cast<std::int64_t>(tiles.size()), {}, "", [&](std::int64_t t) {
      for (std::size_t k = 0; k < K; ++k) steps[at(t) * K + k] = step(tiles[at(t)], k);
    });
  });
}

void VerifyNodes::make(const Part& part) {
  const ParallelGeometry& g = field_.geometry();
  part_ = part;
  nodes_.reset();
  slots_.reset();
  steps_.reset();
  const std::int64_t rows = rows_of(part, g.rows), across = tiles_across(part.nx);
  rows_padded_ = up(rows, row_lanes);
  std::vector<std::array<std::int64_t, 2>> tiles;  // by their first nodes
  std::vector<cl_int> slots(part.tiles.size(), 0);
  for (std::int64_t t = 0; t < static_cast<std::int64_t>(part.tiles.size()); ++t) {
    if (!part.tiles[at(t)]) continue;
    slots[at(t)] = to_int(static_cast<std::int64_t>(tiles.size()));
    tiles.push_back({t % across * tile, t / across * tile});
  }
  slots_.emplace(state_, std::span<const cl_int>(slots), "tiles of nodes");
  nodes_.emplace(state_,
                 std::max<std::size_t>(1, tiles.size()) * count(tile * tile * rows_padded_) + count(beyond),
                 "nodes of the field to verify against");
  if (tiles.empty() || cone_) nodes_->fill(0.0f);
  if (tiles.empty()) return;
  if (cone_) {
    make_cone_nodes(std::move(tiles));
    return;
  }
  make_steps(tiles);
  // All parts have tables of one size, whose pages cost time to get.
  if (!table_) table_ = std::make_unique<Table>(state_, columns_, views_at_once());
  calls_ = (g.views() + table_->views - 1) / table_->views;
  for (std::int64_t row = 0; row < rows; row += row_lanes) back_project(row);
}

void VerifyNodes::make_cone_nodes(std::vector<std::array<std::int64_t, 2>> tiles) {
  VerifyConeNodes::Nodes wanted;
  const std::array<std::int64_t, 3> first{part_.first_x, part_.first_y, part_.first_z};
  for (std::size_t a = 0; a < 3; ++a) {
    wanted.spacing[a] = grid_.spacing[a] / static_cast<double>(a < 2 ? part_.across : part_.along);
    wanted.first[a] = grid_.origin[a] + static_cast<double>(first[a]) * wanted.spacing[a];
  }
  wanted.heights = rows_padded_;
  wanted.used = part_.nz;
  wanted.furthest = part_.furthest;
  wanted.tiles = std::move(tiles);
  const std::int64_t blocks = part_.blocks_along();
  for (std::size_t t = 0; t < part_.tiles.size(); ++t) {
    if (!part_.tiles[t]) continue;
    if (!part_.ranges.empty()) wanted.ranges.push_back(part_.ranges[t]);
    if (part_.blocks.empty()) continue;
    const auto of_tile = std::span(part_.blocks).subspan(t * at(blocks), at(blocks));
    wanted.blocks.insert(wanted.blocks.end(), of_tile.begin(), of_tile.end());
  }
  cone_facts_ = cone_->make(wanted, *nodes_);
}

void VerifyNodes::back_project(std::int64_t first_row) {
  const Table& table = *table_;
  const std::int64_t K = field_.geometry().views();
  const std::uint64_t tiles = steps_->size() / count(K);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrVerifyRows> kernel(
      state_, "verify/witness/verify_nodes", "verify_nodes",
      opencl::height_defines(state_.info, to_int(row_lanes)));
  const std::uint64_t in_row = count(row_lanes / opencl::lanes_of(state_.info, to_int(row_lanes)));
  for (std::int64_t first = 0; first < K; first += table.views) {
    fill(first_row, first);
    const VdvrVerifyRows rows{.accumulate = first > 0 ? 1 : 0,
                              .first_view = to_int(first),
                              .views = to_int(table.filled),
                              .all_views = to_int(K),
                              .columns = to_int(columns_),
                              .tiles = to_int(static_cast<std::int64_t>(tiles)),
                              .rows_padded = to_int(rows_padded_),
                              .first_row = to_int(first_row)};
    kernel(opencl::in_groups(state_.info, {in_row, count(tile), tiles}, {1, count(tile), 1}),
           nodes_->buffer(), table.device.buffer(), steps_->buffer(), rows);
  }
}

/// The product along z: what gold's heights are as sums over the part's.
struct VerifyNodes::Heights {
  std::vector<cl_int4> bands;  // per 16 heights: first row, rows, where the weights begin
  std::vector<float> weights;  // [row][16]
};

VerifyNodes::Heights VerifyNodes::heights_of(const Blocks& blocks) const {
  const ParallelGeometry& g = field_.geometry();
  const std::int64_t all = rows_of(part_, g.rows);
  const BetweenNodes b = between_nodes(blocks.rate, part_.along, part_.points);
  const LagrangeFilter filter = lagrange_filter(b);
  const std::int64_t before = b.made() ? b.before() : 0, after = b.made() ? b.points - before : 1;
  Heights h;
  for (std::int64_t first = 0; first < blocks.z_padded; first += row_lanes) {
    // Of heights: those around the group's. Places beyond the part's are nobody's.
    const auto node_of = [&](std::int64_t i) {
      return floor_of((blocks.first_z + first + i) * b.by, b.factor) - part_.first_z;
    };
    const std::int64_t begin = part_.rows ? 0 : std::clamp<std::int64_t>(node_of(0) - before, 0, all - 1),
                       end = part_.rows
                                 ? all
                                 : std::clamp<std::int64_t>(node_of(row_lanes - 1) + after, begin + 1, all);
    h.bands.push_back({{to_int(begin), to_int(end - begin),
                        to_int(static_cast<std::int64_t>(h.weights.size()) / row_lanes), 0}});
    for (std::int64_t row = begin; row < end; ++row)
      for (std::int64_t i = 0; i < row_lanes; ++i) {
        const std::int64_t height = blocks.first_z + first + i;
        if (part_.rows) {
          const double z = grid_.origin[2] +
                           static_cast<double>(height) / static_cast<double>(blocks.rate) * grid_.spacing[2];
          h.weights.push_back(static_cast<float>(
              row_weight(g.rows, z / g.pitch_v + 0.5 * static_cast<double>(g.rows - 1), row)));
          continue;
        }
        const std::int64_t tap = row - node_of(i) + before,
                           phase = height * b.by - floor_of(height * b.by, b.factor) * b.factor;
        const std::int64_t taps = b.made() ? b.points : 1;
        h.weights.push_back(tap < 0 || tap >= taps ? 0.0f
                            : b.made()             ? filter.weights[at(phase * b.points + tap)]
                                                   : 1.0f);
      }
  }
  return h;
}

std::int64_t VerifyNodes::floats_per_block(const Part& part, int rate, std::int64_t nx,
                                           std::int64_t z_padded) const {
  const BetweenNodes b = between_nodes(rate, part.across, part.points);
  const std::int64_t n = nodes_before(nx, b);
  return b.made() ? (n + nx) * n * z_padded : 0;
}

void VerifyNodes::gold(const Blocks& b, const opencl::DeviceArray<float>& values) {
  const BetweenNodes across = between_nodes(b.rate, part_.across, part_.points);
  if (!across.made() && across.by > 1)
    throw InputError(
        fmt::format("gold of rate {} is coarser than its {} nodes a cell", b.rate, part_.across));
  const std::int64_t n = nodes_before(b.nx, across), before = across.made() ? across.before() : 0,
                     blocks = static_cast<std::int64_t>(b.first.size()), groups = b.z_padded / row_lanes;
  std::vector<cl_int2> places;
  std::vector<cl_int> phases;  // [block][x, y]: how far the first value lies behind its node
  for (const auto& first : b.first) {
    const std::array<std::int64_t, 2> node{floor_of(first[0] * across.by, across.factor),
                                           floor_of(first[1] * across.by, across.factor)};
    places.push_back({{to_int(node[0] - before - part_.first_x), to_int(node[1] - before - part_.first_y)}});
    for (std::size_t a = 0; a < 2; ++a)
      phases.push_back(to_int(first[a] * across.by - node[a] * across.factor));
  }
  const Heights h = heights_of(b);
  const opencl::DeviceArray<cl_int2> device_places(state_, std::span<const cl_int2>(places),
                                                   "blocks of gold to verify");
  const opencl::DeviceArray<cl_int4> bands(state_, std::span<const cl_int4>(h.bands), "heights to verify");
  const opencl::DeviceArray<float> weights(state_, std::span<const float>(h.weights), "product along z");
  const opencl::Defines defines = opencl::height_defines(state_.info, to_int(row_lanes));
  const std::uint64_t in_group = count(row_lanes / opencl::lanes_of(state_.info, to_int(row_lanes)));
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrVerifyHeights>
      along(state_, "verify/witness/verify_nodes", "verify_heights", defines);
  const VdvrVerifyHeights shape{.blocks = to_int(blocks),
                                .nx = to_int(n),
                                .ny = to_int(n),
                                .groups = to_int(groups),
                                .tiles_x = to_int(tiles_across(part_.nx)),
                                .tiles_y = to_int(tiles_across(part_.ny)),
                                .rows_padded = to_int(rows_padded_)};
  const opencl::Range heights =
      opencl::in_groups(state_.info, {in_group * count(groups), count((n + 7) / 8), count(n * blocks)},
                        {count(groups), count((n + 7) / 8), 1});
  if (!across.made()) {
    along(heights, values.buffer(), nodes_->buffer(), weights.buffer(), bands.buffer(),
          device_places.buffer(), slots_->buffer(), shape);
    return;
  }
  const opencl::DeviceArray<float> first(state_, count(blocks * n * n * b.z_padded + beyond),
                                         "nodes at heights"),
      second(state_, count(blocks * b.nx * n * b.z_padded + beyond), "rows of gold");
  along(heights, first.buffer(), nodes_->buffer(), weights.buffer(), bands.buffer(), device_places.buffer(),
        slots_->buffer(), shape);
  const LagrangeFilter filter = lagrange_filter(across);
  const opencl::DeviceArray<cl_int> device_phases(state_, std::span<const cl_int>(phases),
                                                  "blocks of gold to verify");
  const opencl::DeviceArray<float> taps(state_, std::span<const float>(filter.weights), "Lagrange's weights");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrVerifyBetween> kernel(
      state_, "verify/witness/verify_nodes", "verify_between", defines);
  const auto pass = [&](const auto& out, const auto& in, int axis, std::int64_t outer, std::int64_t inner,
                        std::uint64_t together) {
    const VdvrVerifyBetween s{.outer = to_int(outer),
                              .inner = to_int(inner),
                              .before = to_int(n),
                              .after = to_int(b.nx),
                              .factor = across.factor,
                              .by = across.by,
                              .points = across.points,
                              .axis = axis,
                              .blocks = to_int(blocks)};
    kernel(opencl::in_groups(state_.info, {in_group * count(inner), count(b.nx), count(outer)},
                             {count(inner), together, 1}),
           out.buffer(), in.buffer(), taps.buffer(), device_phases.buffer(), s);
  };
  pass(second, first, 1, blocks, n * groups, 1);
  pass(values, second, 0, blocks * b.nx, groups, count(b.nx));
}

NodePath VerifyNodes::path(const Part& part, int rate) const {
  const ParallelGeometry& g = field_.geometry();
  NodePath p;
  p.across = between_nodes(rate, part.across, part.points);
  p.rows = part.rows;
  if (!part.rows) p.along = between_nodes(rate, part.along, part.points);
  p.terms = part.rows ? g.rows : row_lanes + part.points;
  p.gain = part.rows ? gain_ : 1;
  if (cone_) return p;
  p.calls = calls_;
  const auto n = static_cast<double>(part.across);
  p.density = density_;
  p.reach = density_ / g.pitch_u * std::hypot(grid_.spacing[0] / n, grid_.spacing[1] / n) *
            static_cast<double>(tile);
  for (std::size_t a = 0; a < 3; ++a)
    p.band[a] = pi * grid_.spacing[a] / (a < 2 ? n * g.pitch_u : static_cast<double>(part.along) * g.pitch_v);
  return p;
}

}  // namespace vdvr
