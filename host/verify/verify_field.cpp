// F on gold nodes for `verify`, and bounds cell by cell. Double precision on the host up to the table of fine
// columns, fp32 on the device from there on.
#include "host/verify/verify_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "host/certify/result_units.hpp"
#include "host/opencl/kernel.hpp"
#include "host/system/casts.hpp"
#include "host/system/parallel.hpp"
#include "host/verify/verify_cosines.hpp"
#include "shared/verify_pieces.h"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrPieces) == 56 && sizeof(VdvrViewRun) == 40);
namespace {

constexpr double pi = std::numbers::pi;
constexpr std::int64_t halo = 2;   // of gold nodes: RADIUS of the kernel
constexpr std::int64_t room = 64;  // floats after a buffer's end that 16-lane reads may touch

std::int64_t up(std::int64_t n, std::int64_t multiple) { return (n + multiple - 1) / multiple * multiple; }

// Gold cells of a piece's side at most: what is computed at once stays small whatever the rate.
constexpr std::int64_t most_cells = 64;

/// Host memory counted against --max-memory.
class HostShare {
 public:
  HostShare(opencl::State& state, std::uint64_t bytes, const std::string& what)
      : state_(state), bytes_(bytes) {
    state.memory.take(bytes, what);
  }
  ~HostShare() { state_.memory.give(bytes_); }
  HostShare(const HostShare&) = delete;
  HostShare& operator=(const HostShare&) = delete;

 private:
  opencl::State& state_;
  std::uint64_t bytes_;
};

}  // namespace

/// How the selected bricks are cut into pieces, and these joined to blocks that are computed at once.
struct VerifyField::Shape {
  std::int64_t rate = 1;               // gold cells to a cell of the grid
  Vec3 h{};                            // gold spacing
  std::int64_t width = 1, height = 1;  // pieces per block across z, pieces per slab along z
  std::int64_t cells = 1;              // gold cells of a piece's side
  std::int64_t per_brick = 1;          // pieces of a brick's side
  Index3 pieces{};                     // of the grid
  std::int64_t nx = 0, nz = 0, z_padded = 0, error_padded = 0, words = 0;
  std::int64_t slab_z = 0;          // first layer of pieces
  std::int64_t views = 1, run = 1;  // whose fine columns are held at once; that are summed by themselves
  FieldBounds bounds;

  /// Where a piece begins along an axis.
  [[nodiscard]] double begin(const Grid& grid, std::size_t axis, std::int64_t piece) const {
    return grid.origin[axis] +
           static_cast<double>(piece * cells) / static_cast<double>(rate) * grid.spacing[axis];
  }
  /// The brick that a piece belongs to, (z * bricks_y + y) * bricks_x + x.
  [[nodiscard]] std::size_t brick(const Index3& n, std::int64_t x, std::int64_t y, std::int64_t z) const {
    return at((z / per_brick * n[1] + y / per_brick) * n[0] + x / per_brick);
  }
};

struct VerifyField::Batch {
  std::vector<cl_int4> first, items;
  std::vector<std::int64_t> bricks;  // of the items
  std::vector<std::uint8_t> tested;  // [block][y][x] gold cell columns
};

namespace {

// The stored field times 2^exponent.
DeviceField upload(opencl::State& state, const MixedVolume& volume, int exponent) {
  if (exponent == 0) return {state, volume};
  const HostShare copy(state, volume.base.bytes(), "the stored field in other units");
  MixedVolume scaled = volume;
  scale(scaled, exponent);
  return {state, scaled};
}

}  // namespace

VerifyField::VerifyField(opencl::State& state, const ExactField& field, const MixedVolume& volume,
                         const std::optional<std::pair<double, double>>& window, const Progress& progress,
                         int density)
    : state_(state),
      field_(field),
      volume_(volume),
      unit_(std::ldexp(1.0, density)),
      coverage_(field.geometry()),
      sups_(view_sups(field.coefficients(), field.geometry(), progress)),
      stored_(upload(state, volume, -density)) {
  if (window) window_ = {window->first / unit_, window->second / unit_};
  // Corners of tested cells lie within a gold diagonal of the covered region, differences reach two steps on;
  // at no rate further than at the volume's own.
  const ParallelGeometry& g = field.geometry();
  const double diagonal =
      std::hypot(volume.grid.spacing[0], volume.grid.spacing[1]) / static_cast<double>(volume.rate);
  pad_ =
      static_cast<std::int64_t>(std::ceil(3.1 * diagonal / g.pitch_u * static_cast<double>(fine_columns))) +
      4;
  columns_ = fine_columns * g.columns + 1 + 2 * pad_;
}

VerifyField::Shape VerifyField::shape_at(int rate, bool many) const {
  Shape s;
  s.rate = rate;
  s.h = volume_.grid.spacing;
  for (double& h : s.h) h /= static_cast<double>(rate);
  const std::int64_t side = std::int64_t{volume_.granularity} * rate;
  s.cells = std::min(side, most_cells);
  s.per_brick = side / s.cells;
  for (std::size_t a = 0; a < 3; ++a) s.pieces[a] = (volume_.grid.cells[a] * rate + s.cells - 1) / s.cells;
  // Few bricks are computed one by one, many in blocks with less halo.
  if (many) s.width = s.height = std::max<std::int64_t>(1, most_cells / s.cells);
  s.nx = s.width * s.cells + 1 + 2 * halo;
  s.error_padded = up(s.cells + 1, 16) + 16;
  s.words = (s.cells + 15) / 16;
  const std::int64_t all = field_.geometry().views(),
                     per_view = 4 * columns_ * up(s.height * s.cells + 1 + 2 * halo, 16);
  s.views = std::clamp<std::int64_t>(
      static_cast<std::int64_t>(std::min(state_.memory.left() / 4, state_.info.max_allocation)) / per_view, 1,
      all);
  s.run = std::min(views_per_run, s.views);
  s.views -= s.views % s.run;
  const double scale = static_cast<double>(fine_columns) / field_.geometry().pitch_u;
  s.bounds = field_bounds(sups_, field_.rounding(), field_.geometry(), s.h,
                          scale * std::hypot(s.h[0], s.h[1]) * static_cast<double>(s.nx + 7), s.run);
  return s;
}

void VerifyField::run(const std::vector<std::uint8_t>& selected, int rate,
                      const std::function<void(const Piece&)>& on_piece, const Progress& progress) {
  if (rate < volume_.rate || rate % volume_.rate != 0)
    throw InputError(fmt::format("V of rate {} cannot be tested at {}", volume_.rate, rate));
  const auto wanted = std::count(selected.begin(), selected.end(), 1);
  Shape s = shape_at(rate, 2 * wanted > static_cast<std::int64_t>(selected.size()));
  arithmetic_ = s.bounds.arithmetic;
  const Index3 n = volume_.bricks();

  struct Slab {
    std::int64_t z;
    std::vector<std::array<std::int64_t, 2>> blocks;
  };
  std::vector<Slab> slabs;
  double total = 0, done = 0;
  for (std::int64_t z = 0; z < s.pieces[2]; z += s.height) {
    Slab slab{z, {}};
    for (std::int64_t y = 0; y < s.pieces[1]; y += s.width)
      for (std::int64_t x = 0; x < s.pieces[0]; x += s.width) {
        bool any = false;
        for (std::int64_t bz = z; bz < std::min(s.pieces[2], z + s.height); ++bz)
          for (std::int64_t by = y; by < std::min(s.pieces[1], y + s.width); ++by)
            for (std::int64_t bx = x; bx < std::min(s.pieces[0], x + s.width); ++bx)
              any = any || selected[s.brick(n, bx, by, bz)] != 0;
        if (any) slab.blocks.push_back({x, y});
      }
    total += static_cast<double>(slab.blocks.size());
    if (!slab.blocks.empty()) slabs.push_back(std::move(slab));
  }
  for (const Slab& slab : slabs) {
    s.slab_z = slab.z;
    const std::int64_t layers = std::min(s.height, s.pieces[2] - slab.z);
    s.nz = std::min(layers * s.cells, volume_.grid.cells[2] * s.rate - slab.z * s.cells) + 1 + 2 * halo;
    s.z_padded = up(s.nz, 16);
    run_slab(s, slab.blocks, selected, on_piece, [&](std::size_t blocks) {
      done += static_cast<double>(blocks);
      report(progress, "verify", done / total);
    });
  }
}

/// Fine columns of some views, on the host and on the device.
struct VerifyField::Table {
  Table(opencl::State& state, std::int64_t columns, std::int64_t z_padded, std::int64_t at_once)
      : per_view(columns * z_padded),
        views(at_once),
        share(state, count(4 * views * per_view), "fine columns of the filtered projections"),
        host(at(views * per_view)),
        device(state, count(views * per_view + room), "fine columns of the filtered projections") {}

  std::int64_t per_view, views;  // floats; views at a time
  std::int64_t first_view = -1;  // what it holds
  HostShare share;
  std::vector<float> host;
  opencl::DeviceArray<float> device;
};

void VerifyField::fill(Table& table, const Shape& shape, std::int64_t first_view) {
  if (table.first_view == first_view) return;
  const ParallelGeometry& g = field_.geometry();
  const std::int64_t U = g.columns, V = g.rows, rows = up(shape.nz, verify_cosines::lanes);
  const std::int64_t views = std::min(table.views, g.views() - first_view), last = fine_columns * U;
  const double first_z = shape.begin(volume_.grid, 2, shape.slab_z);
  std::vector<double> basis(at(V * rows));
  for (std::int64_t r = 0; r < rows; ++r) {
    const double z = first_z + static_cast<double>(r - halo) * shape.h[2];
    const double y = pi * (z / g.pitch_v + 0.5 * static_cast<double>(V)) / static_cast<double>(V);
    for (std::int64_t l = 0; l < V; ++l) basis[at(l * rows + r)] = std::cos(static_cast<double>(l) * y);
  }
  const auto cosine = verify_cosines::cosine_period(last);
  parallel_for(views, {}, "", [&](std::int64_t k) {
    std::vector<double> line(at(U * rows));
    verify_cosines::sum_rows(field_.coefficients().data() + (first_view + k) * U * V, U, V, basis, rows,
                             line);
    float* out = table.host.data() + k * table.per_view;
    verify_cosines::sum_columns(
        line, U, rows, fine_columns, cosine,
        [&](std::int64_t n, std::int64_t r, const std::array<double, verify_cosines::lanes>& values) {
          for (std::int64_t i = 0; i < verify_cosines::lanes; ++i)
            if (r + i < shape.z_padded)
              out[((r + i) / 16 * columns_ + n + pad_) * 16 + (r + i) % 16] =
                  static_cast<float>(values[at(i)] / unit_);
        });
    // Beyond the detector's edges the series is its own mirror image.
    for (std::int64_t n = 0; n < columns_; ++n) {
      std::int64_t m = std::abs(n - pad_) % (2 * last);
      if (m > last) m = 2 * last - m;
      if (m == n - pad_) continue;
      for (std::int64_t z = 0; z < shape.z_padded / 16; ++z)
        std::copy_n(out + (z * columns_ + m + pad_) * 16, 16, out + (z * columns_ + n) * 16);
    }
  });
  table.device.write(std::span<const float>(table.host).first(at(views * table.per_view)));
  table.first_view = first_view;
}

VerifyField::Batch VerifyField::make_batch(const Shape& s,
                                           std::span<const std::array<std::int64_t, 2>> blocks,
                                           const std::vector<std::uint8_t>& selected) const {
  const Grid& grid = volume_.grid;
  const Index3 n = volume_.bricks();
  const std::int64_t side = s.width * s.cells;
  Batch batch;
  batch.tested.assign(blocks.size() * at(side * side), 0);
  // A cell that holds a covered point has its centre within half its diagonal of the region.
  const double limit = -0.5 * std::hypot(s.h[0], s.h[1]) * (1 + 1e-9);
  parallel_for(static_cast<std::int64_t>(blocks.size()) * side, {}, "", [&](std::int64_t row) {
    const auto& b = blocks[at(row / side)];
    const double y = s.begin(grid, 1, b[1]) + (static_cast<double>(row % side) + 0.5) * s.h[1];
    for (std::int64_t i = 0; i < side; ++i) {
      const double x = s.begin(grid, 0, b[0]) + (static_cast<double>(i) + 0.5) * s.h[0];
      batch.tested[at(row * side + i)] = coverage_.margin(x, y) >= limit ? 1 : 0;
    }
  });
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const auto& b = blocks[i];
    batch.first.push_back({{to_int(b[0]), to_int(b[1]), to_int(s.slab_z), 0}});
    for (std::int64_t z = s.slab_z; z < std::min(s.pieces[2], s.slab_z + s.height); ++z)
      for (std::int64_t y = b[1]; y < std::min(s.pieces[1], b[1] + s.width); ++y)
        for (std::int64_t x = b[0]; x < std::min(s.pieces[0], b[0] + s.width); ++x) {
          const std::size_t brick = s.brick(n, x, y, z);
          if (!selected[brick]) continue;
          const std::uint8_t* mask = batch.tested.data() + i * at(side * side) +
                                     at((y - b[1]) * s.cells * side + (x - b[0]) * s.cells);
          bool any = false;
          for (std::int64_t j = 0; j < s.cells && !any; ++j)
            any = std::find(mask + j * side, mask + j * side + s.cells, 1) != mask + j * side + s.cells;
          if (!any) continue;
          batch.items.push_back({{to_int(x), to_int(y), to_int(z), to_int(static_cast<std::int64_t>(i))}});
          batch.bricks.push_back(static_cast<std::int64_t>(brick));
        }
  }
  return batch;
}

void VerifyField::run_slab(const Shape& s, const std::vector<std::array<std::int64_t, 2>>& blocks,
                           const std::vector<std::uint8_t>& selected,
                           const std::function<void(const Piece&)>& on_piece,
                           const std::function<void(std::size_t)>& tick) {
  Table table(state_, columns_, s.z_padded, s.views);
  const std::int64_t per_block = s.nx * s.nx * s.z_padded,
                     per_item =
                         (s.cells + 1) * (s.cells + 1) * s.error_padded + s.cells * s.cells * (4 + s.words);
  const std::int64_t bytes = 4 * (per_block + s.width * s.width * s.height * per_item);
  const std::uint64_t budget = std::min<std::uint64_t>(state_.memory.left() / 2, 96 << 20);
  const std::size_t together = at(std::clamp<std::int64_t>(static_cast<std::int64_t>(budget) / bytes, 1,
                                                           static_cast<std::int64_t>(blocks.size())));
  opencl::DeviceArray<float> values(state_, count(static_cast<std::int64_t>(together) * per_block + room),
                                    "field to verify against");
  values.fill(0.0f);
  for (std::size_t first = 0; first < blocks.size(); first += together) {
    const auto part = std::span(blocks).subspan(first, std::min(together, blocks.size() - first));
    const Batch batch = make_batch(s, part, selected);
    if (!batch.items.empty()) {
      field_of(batch, s, table, values);
      measure(batch, s, values, on_piece);
    }
    tick(part.size());
  }
}

void VerifyField::field_of(const Batch& batch, const Shape& s, Table& table,
                           opencl::DeviceArray<float>& values) {
  const ParallelGeometry& g = field_.geometry();
  const std::size_t K = g.theta_rad.size(), blocks = batch.first.size();
  const double scale = static_cast<double>(fine_columns) / g.pitch_u;
  std::vector<cl_float4> steps(blocks * K);
  for (std::size_t b = 0; b < blocks; ++b)
    for (std::size_t k = 0; k < K; ++k) {
      const double c = std::cos(g.theta_rad[k]), s_k = std::sin(g.theta_rad[k]);
      const auto node = [&](std::size_t axis, cl_int piece) {
        return s.begin(volume_.grid, axis, piece) - static_cast<double>(halo) * s.h[axis];
      };
      const double t = node(0, batch.first[b].s[0]) * c + node(1, batch.first[b].s[1]) * s_k;
      // Fine column 0 of the table lies at the detector's edge, half a pixel before column 0, less the
      // padding.
      const double column =
          (t / g.pitch_u + g.center + 0.5) * static_cast<double>(fine_columns) + static_cast<double>(pad_);
      const double along_x = c * s.h[0] * scale, along_y = s_k * s.h[1] * scale,
                   nodes = static_cast<double>(s.nx + 7);
      const double whole =
          std::floor(column + std::min(0.0, along_x * nodes) + std::min(0.0, along_y * nodes)) - 1;
      steps[b * K + k] = {{static_cast<float>(along_x), static_cast<float>(along_y),
                           static_cast<float>(column - whole), static_cast<float>(whole)}};
    }
  const opencl::DeviceArray<cl_float4> device_steps(state_, std::span<const cl_float4>(steps),
                                                    "view positions");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrViewRun> kernel(state_, "verify/verify_field",
                                                                         "verify_field", stored_.defines);
  for (std::int64_t first = 0; first < g.views(); first += table.views) {
    fill(table, s, first);
    const std::int64_t end = std::min(first + table.views, g.views());
    // In runs, whose sums round seldom.
    for (std::int64_t run = first; run < end; run += s.run) {
      const VdvrViewRun shape{.accumulate = run > 0 ? 1 : 0,
                              .first_view = to_int(run),
                              .in_table = to_int(run - first),
                              .views = to_int(std::min(s.run, end - run)),
                              .all_views = to_int(g.views()),
                              .columns = to_int(columns_),
                              .z_padded = to_int(s.z_padded),
                              .nx = to_int(s.nx),
                              .ny = to_int(s.nx),
                              .blocks = to_int(static_cast<std::int64_t>(blocks))};
      kernel({{count((s.nx + 7) / 8), count(s.nx), count(s.z_padded / 16) * blocks},
              {count((s.nx + 7) / 8), 1, 1}},
             values.buffer(), table.device.buffer(), device_steps.buffer(), shape);
    }
  }
}

namespace {

/// Gold nodes of a piece that are corners of a tested cell. bits: 16 cells to a word, [y][x][words].
std::int64_t tested_nodes(const std::uint32_t* bits, std::int64_t cells, std::int64_t words) {
  std::int64_t nodes = 0;
  for (std::int64_t y = 0; y <= cells; ++y)
    for (std::int64_t x = 0; x <= cells; ++x) {
      std::uint32_t carry = 0;  // cell 15 of the word before touches node 0 of this one
      for (std::int64_t w = 0; w < words; ++w) {
        std::uint32_t word = 0;
        for (std::int64_t j = std::max<std::int64_t>(y - 1, 0); j <= std::min(y, cells - 1); ++j)
          for (std::int64_t i = std::max<std::int64_t>(x - 1, 0); i <= std::min(x, cells - 1); ++i)
            word |= bits[(j * cells + i) * words + w];
        nodes += std::popcount((word | word << 1 | carry) & 0xffffu);
        carry = word >> 15;
      }
      nodes += carry;
    }
  return nodes;
}

}  // namespace

// The first and the last layer of cells along z that meet the covered heights.
std::pair<std::int64_t, std::int64_t> VerifyField::covered_cells(const Shape& s) const {
  const double first_z = s.begin(volume_.grid, 2, s.slab_z);
  std::pair<std::int64_t, std::int64_t> range{s.nz, -1};
  for (std::int64_t k = 0; k < s.nz - 1 - 2 * halo; ++k)
    if (coverage_.margin_z(first_z + (static_cast<double>(k) + 0.5) * s.h[2]) >= -0.5 * s.h[2] * (1 + 1e-9)) {
      range.first = std::min(range.first, k);
      range.second = k;
    }
  return range;
}

void VerifyField::measure(const Batch& batch, const Shape& s, const opencl::DeviceArray<float>& values,
                          const std::function<void(const Piece&)>& on_piece) {
  const std::int64_t n = static_cast<std::int64_t>(batch.items.size()), side = s.cells + 1;
  const VdvrGrid& grid = stored_.grid;
  const opencl::DeviceArray<cl_int4> items(state_, std::span<const cl_int4>(batch.items), "bricks to verify"),
      first(state_, std::span<const cl_int4>(batch.first), "blocks to verify");
  const opencl::DeviceArray<std::uint8_t> tested(state_, std::span<const std::uint8_t>(batch.tested),
                                                 "columns to verify");
  opencl::DeviceArray<float> error(state_, count(n * side * side * s.error_padded + room), "errors at nodes");
  opencl::DeviceArray<cl_float8> fourth(state_, count(n * side), "fourth differences");
  opencl::DeviceArray<cl_int4> columns(state_, count(n * s.cells * s.cells), "columns of gold cells");
  opencl::DeviceArray<cl_uint> bits(state_, count(n * s.cells * s.cells * s.words), "tested gold cells");
  const auto [z_first, z_last] = covered_cells(s);
  const VdvrPieces pieces{to_int(n),
                          to_int(s.rate),
                          to_int(s.cells),
                          to_int(s.nx),
                          to_int(s.nx),
                          to_int(s.z_padded),
                          to_int(s.error_padded),
                          to_int(s.words),
                          to_int(z_first),
                          to_int(z_last),
                          window_ ? 1 : 0,
                          window_ ? std::nextafter(static_cast<float>(window_->first), -INFINITY) : 0.0f,
                          window_ ? std::nextafter(static_cast<float>(window_->second), INFINITY) : 0.0f,
                          s.bounds.correction};

  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, VdvrPieces>
      errors(state_, "verify/verify_field", "verify_errors", stored_.defines);
  errors({{count(side), count(side), count(n)}, {count(side), 1, 1}}, error.buffer(), values.buffer(),
         stored_.samples.buffer(), stored_.bricks.buffer(), grid, items.buffer(), first.buffer(), pieces);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, VdvrPieces> fourths(
      state_, "verify/verify_field", "verify_fourth", stored_.defines);
  fourths({{count(side), count(n), 1}, {1, 1, 1}}, fourth.buffer(), values.buffer(), tested.buffer(), grid,
          items.buffer(), first.buffer(), pieces);

  const std::vector<cl_float8> rows = fourth.to_host();
  std::vector<double> constants(at(n));
  std::vector<float> widening(at(n));
  for (std::int64_t i = 0; i < n; ++i) {
    std::array<double, 6> largest{};
    for (std::int64_t y = 0; y < side; ++y)
      for (std::size_t q = 0; q < 6; ++q)
        largest[q] = std::max(largest[q], unit_ * static_cast<double>(rows[at(i * side + y)].s[q]));
    constants[at(i)] = brick_constant(s.bounds, largest) + s.bounds.arithmetic;
    widening[at(i)] = static_cast<float>(constants[at(i)] / unit_ * (1 + 1e-6));
  }
  const opencl::DeviceArray<float> device_widening(state_, std::span<const float>(widening),
                                                   "constants of pieces");

  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer,
                 cl::Buffer, VdvrPieces>
      cells(state_, "verify/verify_field", "verify_cells", stored_.defines);
  cells({{count(s.cells), count(s.cells), count(n)}, {count(s.cells), 1, 1}}, columns.buffer(), bits.buffer(),
        error.buffer(), values.buffer(), tested.buffer(), grid, items.buffer(), first.buffer(),
        device_widening.buffer(), pieces);

  std::vector<Column> host(at(n * s.cells * s.cells));
  {
    const std::vector<cl_int4> raw = columns.to_host();
    static_assert(sizeof(cl_int4) == sizeof(Column));
    std::transform(raw.begin(), raw.end(), host.begin(), [](const cl_int4& c) {
      return Column{std::bit_cast<float>(c.s[0]), std::bit_cast<float>(c.s[1]), c.s[2], 0};
    });
  }
  const std::vector<cl_uint> host_bits = bits.to_host();
  for (std::int64_t i = 0; i < n; ++i) {
    Piece b;
    b.brick = batch.bricks[at(i)];
    const cl_int4 place = batch.items[at(i)];
    for (int a = 0; a < 3; ++a) b.first_cell[at(a)] = place.s[a] % s.per_brick * s.cells;
    b.constant = constants[at(i)];
    b.unit = unit_;
    b.columns = std::span<const Column>(host).subspan(at(i * s.cells * s.cells), at(s.cells * s.cells));
    const std::uint32_t* flags = host_bits.data() + i * s.cells * s.cells * s.words;
    for (std::int64_t w = 0; w < s.cells * s.cells * s.words; ++w) b.cells += std::popcount(flags[w]);
    if (b.cells > 0) b.nodes = tested_nodes(flags, s.cells, s.words);
    float best = -1;
    for (std::int64_t j = 0; j < s.cells * s.cells; ++j) {
      const Column& c = b.columns[at(j)];
      if (c.total < 0) continue;
      b.error = std::max(b.error, unit_ * static_cast<double>(c.error));
      if (c.total <= best) continue;
      best = c.total;
      b.worst_cell = {b.first_cell[0] + j % s.cells, b.first_cell[1] + j / s.cells,
                      b.first_cell[2] + c.worst_z};
    }
    if (best >= 0) b.total = unit_ * static_cast<double>(best) + b.constant;
    on_piece(b);
  }
}

}  // namespace vdvr
