// Pieces of bricks on the device: which cells of gold are tested, and their bounds. Launches
// kernels/verify/verify_pieces.cl.
#include <algorithm>
#include <bit>
#include <cmath>

#include "host/base/opencl/work_groups.hpp"
#include "host/base/system/parallel.hpp"
#include "host/verify/verify_parts.hpp"
#include "shared/verify_pieces.h"

namespace vdvr {

static_assert(sizeof(VdvrPieces) == 68);

VerifyField::Batch VerifyField::make_batch(const Shape& s,
                                           std::span<const std::array<std::int64_t, 2>> blocks,
                                           const std::vector<std::uint8_t>& selected) const {
  const Grid& grid = volume_.grid;
  const Index3 n = volume_.bricks();
  const std::int64_t side = s.width * s.cells;
  Batch batch;
  batch.tested.assign(blocks.size() * at(side * side), 0);
  // A cell that holds a covered point has its centre within half its diagonal of the region.
  const double half = 0.5 * std::hypot(s.h[0], s.h[1]) * (1 + 1e-9);
  parallel_for(static_cast<std::int64_t>(blocks.size()) * side, {}, "", [&](std::int64_t row) {
    const auto& b = blocks[at(row / side)];
    const double y = s.begin(grid, 1, b[1]) + (static_cast<double>(row % side) + 0.5) * s.h[1];
    for (std::int64_t i = 0; i < side; ++i) {
      const double x = s.begin(grid, 0, b[0]) + (static_cast<double>(i) + 0.5) * s.h[0];
      // Margins change by no more than the distance, so most corners need not be asked for.
      const double margin = coverage_.margin(x, y), dx = 0.5 * s.h[0], dy = 0.5 * s.h[1];
      const bool covered =
          margin >= half || (margin >= -half && coverage_.margin(x - dx, y - dy) >= 0 &&
                             coverage_.margin(x + dx, y - dy) >= 0 && coverage_.margin(x - dx, y + dy) >= 0 &&
                             coverage_.margin(x + dx, y + dy) >= 0);
      batch.tested[at(row * side + i)] = covered ? 2 : margin >= -half ? 1 : 0;
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
            any =
                std::any_of(mask + j * side, mask + j * side + s.cells, [](std::uint8_t f) { return f > 0; });
          if (!any) continue;
          batch.items.push_back({{to_int(x), to_int(y), to_int(z), to_int(static_cast<std::int64_t>(i))}});
          batch.bricks.push_back(static_cast<std::int64_t>(brick));
        }
  }
  return batch;
}

// Reads a few nodes at one height, so that F in double precision is cheap there.
void VerifyField::look(const Batch& batch, const Shape& s, const opencl::DeviceArray<float>& values) {
  const auto draw = [&](std::int64_t last) {
    return std::uniform_int_distribution<std::int64_t>(0, last)(random_);
  };
  for (std::size_t i = 0; i < batch.items.size(); ++i) {
    if (!looked_at_[at(batch.bricks[i])]) continue;
    const cl_int4 item = batch.items[i], first = batch.first[at(std::int64_t{item.s[3]})];
    Index3 last{};
    for (std::size_t a = 0; a < 3; ++a)
      last[a] = std::min(s.cells, volume_.grid.cells[a] * s.rate - item.s[a] * s.cells);
    const std::int64_t z = draw(last[2]);
    for (std::int64_t n = 0; n < nodes_each_; ++n) {
      const Index3 in{draw(last[0]), draw(last[1]), z};
      Node node;
      Index3 place{};
      for (std::size_t a = 0; a < 3; ++a) {
        node.at[a] = s.begin(volume_.grid, a, item.s[a]) + static_cast<double>(in[a]) * s.h[a];
        place[a] = (item.s[a] - first.s[a]) * s.cells + in[a] + verify_halo;
      }
      if (!covered(node.at)) continue;
      float value = 0;
      values.read(std::span(&value, 1),
                  count(((item.s[3] * s.nx + place[1]) * s.nx + place[0]) * s.z_padded + place[2]));
      node.value = unit_ * static_cast<double>(value);
      node.arithmetic = bounds_of(s, batch.bricks[i]).arithmetic;
      seen_.push_back(node);
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

// The largest error and total of a piece's columns, `cells` x `cells`.
void take_worst(VerifyField::Piece& b, std::int64_t cells) {
  float best = -1;
  for (std::int64_t j = 0; j < cells * cells; ++j) {
    const VerifyField::Column& c = b.columns[at(j)];
    if (c.total < 0) continue;
    b.error = std::max(b.error, b.unit * static_cast<double>(c.error));
    if (c.total <= best) continue;
    best = c.total;
    b.worst_cell = {b.first_cell[0] + j % cells, b.first_cell[1] + j / cells, b.first_cell[2] + c.worst_z};
  }
  if (best >= 0) b.total = b.unit * static_cast<double>(best) + b.constant;
}

std::vector<VerifyField::Column> columns_of(const std::vector<cl_int4>& raw) {
  static_assert(sizeof(cl_int4) == sizeof(VerifyField::Column));
  std::vector<VerifyField::Column> out(raw.size());
  std::transform(raw.begin(), raw.end(), out.begin(), [](const cl_int4& c) {
    return VerifyField::Column{std::bit_cast<float>(c.s[0]), std::bit_cast<float>(c.s[1]), c.s[2], 0};
  });
  return out;
}

}  // namespace

// The first and the last layer of cells along z that meet the covered heights, and those that lie in them.
VerifyField::Layers VerifyField::covered_cells(const Shape& s) const {
  const double first_z = s.begin(volume_.grid, 2, s.slab_z);
  Layers l{to_int(s.nz), -1, to_int(s.nz), -1};
  for (int k = 0; k < s.nz - 1 - 2 * verify_halo; ++k) {
    const auto margin = [&](double cells) { return coverage_.margin_z(first_z + (k + cells) * s.h[2]); };
    if (margin(0.5) < -0.5 * s.h[2] * (1 + 1e-9)) continue;
    l.first = std::min(l.first, k);
    l.last = k;
    if (margin(0) < 0 || margin(1) < 0) continue;
    l.in_first = std::min(l.in_first, k);
    l.in_last = k;
  }
  return l;
}

// Of each brick of the batch what its field may err by between nodes, from its largest fourth differences.
std::vector<double> VerifyField::constants_of(const Batch& batch, const Shape& s,
                                              const std::vector<cl_float8>& rows) const {
  const std::int64_t side = s.cells + 1;
  std::vector<double> constants;
  for (std::size_t i = 0; i < batch.items.size(); ++i) {
    std::array<double, 6> largest{};
    for (std::int64_t y = 0; y < side; ++y)
      for (std::size_t q = 0; q < 6; ++q)
        largest[q] = std::max(
            largest[q], unit_ * static_cast<double>(rows[at(static_cast<std::int64_t>(i) * side + y)].s[q]));
    const FieldBounds& bounds = bounds_of(s, batch.bricks[i]);
    constants.push_back(brick_constant(bounds, largest) + bounds.arithmetic);
  }
  return constants;
}

void VerifyField::measure(const Batch& batch, const Shape& s, const opencl::DeviceArray<float>& values,
                          const std::function<void(const Piece&)>& on_piece) {
  const std::int64_t n = static_cast<std::int64_t>(batch.items.size()), side = s.cells + 1;
  const VdvrGrid& grid = stored_.grid;
  const opencl::DeviceArray<cl_int4> items(state_, std::span<const cl_int4>(batch.items), "bricks to verify"),
      first(state_, std::span<const cl_int4>(batch.first), "blocks to verify");
  const opencl::DeviceArray<std::uint8_t> tested(state_, std::span<const std::uint8_t>(batch.tested),
                                                 "columns to verify");
  opencl::DeviceArray<float> error(state_, count(n * side * side * s.error_padded + lanes_beyond),
                                   "errors at nodes");
  opencl::DeviceArray<cl_float8> fourth(state_, count(n * side), "fourth differences");
  opencl::DeviceArray<cl_int4> columns(state_, count(n * s.cells * s.cells), "columns of gold cells");
  opencl::DeviceArray<cl_uint> bits(state_, count(n * s.cells * s.cells * s.words), "tested gold cells");
  bits.fill(0);
  const Layers layers = covered_cells(s);
  // On a CPU a work-item walks along a column.
  const cl_int each = opencl::items_along(state_.info) > 1 ? 1 : to_int(side);
  const VdvrPieces pieces{to_int(n),
                          to_int(s.rate),
                          to_int(s.cells),
                          to_int(s.nx),
                          to_int(s.nx),
                          to_int(s.z_padded),
                          to_int(s.error_padded),
                          to_int(s.words),
                          layers.first,
                          layers.last,
                          layers.in_first,
                          layers.in_last,
                          window_ ? 1 : 0,
                          window_ ? std::nextafter(static_cast<float>(window_->first), -INFINITY) : 0.0f,
                          window_ ? std::nextafter(static_cast<float>(window_->second), INFINITY) : 0.0f,
                          s.correction,
                          each};
  opencl::Defines defines = stored_.defines;
  for (const auto& define : opencl::height_defines(state_.info, 16)) defines.push_back(define);

  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, VdvrPieces>
      errors(state_, "verify/verify_pieces", "verify_errors", defines);
  errors(opencl::in_groups(state_.info, {count((side + each - 1) / each), count(side * side), count(n)},
                           {1, count(side), 1}),
         error.buffer(), values.buffer(), stored_.samples.buffer(), stored_.bricks.buffer(), grid,
         items.buffer(), first.buffer(), pieces);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer, VdvrPieces,
                 cl::LocalSpaceArg>
      fourths(state_, "verify/verify_pieces", "verify_fourth", defines);
  fourths(opencl::shared_groups(state_.info, {1, count(side), count(n)}), fourth.buffer(), values.buffer(),
          tested.buffer(), grid, items.buffer(), first.buffer(), pieces, opencl::shared_room(state_.info));

  const std::vector<double> constants = constants_of(batch, s, fourth.to_host());
  std::vector<float> widening;
  for (const double constant : constants)
    widening.push_back(static_cast<float>(constant / unit_ * (1 + 1e-6)));
  const opencl::DeviceArray<float> device_widening(state_, std::span<const float>(widening),
                                                   "constants of pieces");

  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, cl::Buffer,
                 cl::Buffer, VdvrPieces, cl::LocalSpaceArg>
      cells(state_, "verify/verify_pieces", "verify_cells", defines);
  cells(opencl::shared_groups(state_.info, {1, count(s.cells * s.cells), count(n)}), columns.buffer(),
        bits.buffer(), error.buffer(), values.buffer(), tested.buffer(), grid, items.buffer(), first.buffer(),
        device_widening.buffer(), pieces, opencl::shared_room(state_.info));

  const std::vector<Column> host = columns_of(columns.to_host());
  const std::vector<cl_uint> host_bits = bits.to_host();
  for (std::int64_t i = 0; i < n; ++i) {
    Piece b;
    b.brick = batch.bricks[at(i)];
    b.rate = to_int(s.rate);
    b.arithmetic = bounds_of(s, b.brick).arithmetic;
    const cl_int4 place = batch.items[at(i)];
    for (int a = 0; a < 3; ++a) b.first_cell[at(a)] = place.s[a] % s.per_brick * s.cells;
    b.constant = constants[at(i)];
    b.unit = unit_;
    b.columns = std::span<const Column>(host).subspan(at(i * s.cells * s.cells), at(s.cells * s.cells));
    const std::uint32_t* flags = host_bits.data() + i * s.cells * s.cells * s.words;
    for (std::int64_t w = 0; w < s.cells * s.cells * s.words; ++w) b.cells += std::popcount(flags[w]);
    if (b.cells > 0) b.nodes = tested_nodes(flags, s.cells, s.words);
    take_worst(b, s.cells);
    on_piece(b);
  }
}

}  // namespace vdvr
