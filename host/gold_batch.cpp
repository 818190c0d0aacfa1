// What is done to a batch of gold blocks: fit, classify, extract, measure. Called by build.cpp, plan.cpp,
// foresee.cpp. Launches kernels/classify.cl and verify.cl.
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "host/gold_stream.hpp"
#include "host/opencl/kernel.hpp"
#include "host/reconstruct_field.hpp"

namespace vdvr {
namespace {

cl_int to_int(std::int64_t n) { return static_cast<cl_int>(n); }
std::uint64_t count(std::int64_t n) { return static_cast<std::uint64_t>(n); }
std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

}  // namespace

// Mirrors TileRequest of kernels/classify.cl.
struct GoldStream::Batch::TileRequest {
  cl_int block, node_x, node_y, node_z;
  cl_int spacing_x, spacing_y, spacing_z;
  cl_int side_x, side_y, side_z;
  cl_int last_x, last_y, last_z;
  cl_int pad;
  cl_ulong offset;
};

std::array<std::int64_t, 4> GoldStream::Batch::place(std::int64_t brick) const { return place_.at(brick); }

// Equal blocks by their first bricks in x and y, and the selected bricks in them.
void GoldStream::Batch::choose(std::vector<std::array<std::int64_t, 2>> first, std::int64_t first_z,
                               const std::vector<std::uint8_t>& selected) {
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity;
  const std::int64_t across = (grid.cells[0] + g - 1) / g, deep = (grid.cells[1] + g - 1) / g;
  first_brick_.clear();
  bricks_.clear();
  place_.clear();
  lattices_.clear();
  shape_.count = static_cast<std::int64_t>(first.size());
  for (std::size_t b = 0; b < first.size(); ++b) {
    const auto [bx, by] = first[b];
    first_brick_.push_back({bx, by, first_z});
    for (std::int64_t dz = 0; dz < bricks_z_; ++dz)
      for (std::int64_t dy = 0; dy < bricks_y_; ++dy)
        for (std::int64_t dx = 0; dx < bricks_x_; ++dx) {
          const std::int64_t brick = ((first_z + dz) * deep + by + dy) * across + bx + dx;
          if (!selected[at(brick)]) continue;
          bricks_.push_back(brick);
          place_[brick] = {static_cast<std::int64_t>(b), dx, dy, dz};
        }
  }
}

const LevelSamples& GoldStream::Batch::lattice(std::int64_t spacing) {
  const auto found = lattices_.find(spacing);
  if (found != lattices_.end()) return found->second;
  const int steps = !settings_.midrange ? 0 : spacing == settings_.rate ? base_fit_steps : level_fit_steps;
  return lattices_
      .emplace(spacing, fit_lattice(state_, shape_, gold_, margin_, spacing, steps, settings_.curvature))
      .first->second;
}

GoldStream::Batch::TileRequest GoldStream::Batch::request(std::int64_t brick, std::int64_t spacing,
                                                          std::uint64_t offset) const {
  const std::int64_t g = settings_.granularity, rate = settings_.rate, side = g * rate / spacing + 1;
  const auto [b, x, y, z] = place(brick);
  const auto& first = first_brick_[at(b)];
  TileRequest r{};
  r.block = to_int(b);
  r.node_x = to_int(x * g * rate);
  r.node_y = to_int(y * g * rate);
  r.node_z = to_int(z * g * rate);
  r.spacing_x = r.spacing_y = r.spacing_z = to_int(spacing);
  r.side_x = r.side_y = r.side_z = to_int(side);
  r.last_x = to_int(std::min(shape_.nx - 1, (settings_.grid.cells[0] - first[0] * g) * rate));
  r.last_y = to_int(std::min(shape_.ny - 1, (settings_.grid.cells[1] - first[1] * g) * rate));
  r.last_z = to_int(shape_.nz - 1);
  r.offset = offset;
  return r;
}

// Per brick of the blocks, [block][z][y][x].
struct GoldStream::Batch::Results {
  opencl::DeviceArray<cl_int> total, error, slack, violated;
};

GoldStream::Batch::Results GoldStream::Batch::run_measure(const DeviceField& field, float tolerance,
                                                          const opencl::DeviceArray<std::uint8_t>& selected) {
  const std::uint64_t n = blocks(), size = n * count(bricks_x_ * bricks_y_ * bricks_z_);
  Results r{{state_, size, "brick totals"},
            {state_, size, "brick errors"},
            {state_, size, "brick slack"},
            {state_, size, "violations"}};
  r.total.fill(-1);
  r.error.fill(0);
  r.slack.fill(-1);
  r.violated.fill(0);
  std::vector<cl_int4> firsts;
  for (const auto& f : first_brick_) firsts.push_back({{to_int(f[0]), to_int(f[1]), to_int(f[2]), 0}});
  const opencl::DeviceArray<cl_int4> first(state_, std::span<const cl_int4>(firsts), "first bricks");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer,
                 cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_float, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_float>
      kernel(state_, "verify", "verify_nodes", field.defines);
  const std::uint64_t side = count(std::int64_t{settings_.granularity} * settings_.rate + 1);
  kernel({{count(bricks_x_) * side, count(bricks_y_) * side, n}, {side, 1, 1}}, r.total.buffer(),
         r.error.buffer(), r.slack.buffer(), r.violated.buffer(), field.samples.buffer(),
         field.bricks.buffer(), field.grid, gold_.buffer(), above_.buffer(), below_.buffer(),
         margin_.buffer(), first.buffer(), selected.buffer(), shape_.lowest, to_int(shape_.nx),
         to_int(shape_.ny), to_int(shape_.halo), to_int(shape_.gold_stride), to_int(stride_), settings_.rate,
         to_int(bricks_x_), to_int(bricks_y_), to_int(bricks_z_), to_int(static_cast<std::int64_t>(n)),
         tolerance);
  return r;
}

std::vector<BrickMeasure> GoldStream::Batch::measure(const DeviceField& field, float tolerance,
                                                     const opencl::DeviceArray<std::uint8_t>& selected) {
  const Results r = run_measure(field, tolerance, selected);
  const auto totals = r.total.to_host(), errors = r.error.to_host(), slacks = r.slack.to_host(),
             bits = r.violated.to_host();
  std::vector<BrickMeasure> out;
  for (const std::int64_t brick : bricks_) {
    const auto [b, x, y, z] = place(brick);
    const std::size_t i = at(((b * bricks_z_ + z) * bricks_y_ + y) * bricks_x_ + x);
    BrickMeasure m;
    m.brick = brick;
    m.rate = settings_.rate;
    if (totals[i] >= 0) {
      m.total = std::bit_cast<float>(totals[i]);
      m.error = std::bit_cast<float>(errors[i]);
      m.slack = std::bit_cast<float>(slacks[i]);
      m.violated = static_cast<std::uint32_t>(bits[i]);
    }
    out.push_back(m);
  }
  return out;
}

std::vector<BrickClass> GoldStream::Batch::classify(const DeviceField& base, float tolerance,
                                                    const opencl::DeviceArray<std::uint8_t>& selected) {
  const std::int64_t rate = settings_.rate, n = static_cast<std::int64_t>(blocks());
  const int top = std::countr_zero(static_cast<unsigned>(rate));
  Results level0 = run_measure(base, tolerance, selected);
  const auto totals = level0.total.to_host(), errors0 = level0.error.to_host(),
             slacks = level0.slack.to_host();
  const auto fails = [&](cl_int bits) { return bits >= 0 && !(std::bit_cast<float>(bits) <= tolerance); };

  const opencl::Defines defines{{"VDVR_BRICK_NODES", std::to_string(settings_.granularity * settings_.rate)}};
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_float,
                 cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_float>
      level_error(state_, "classify", "level_error", defines);
  opencl::DeviceArray<cl_int> before = std::move(level0.total), error(state_, before.size(), "brick errors");
  std::vector<std::vector<cl_int>> by_level{totals};
  for (int level = 1; level < top && std::any_of(by_level.back().begin(), by_level.back().end(), fails);
       ++level) {
    const LevelSamples& samples = lattice(rate >> level);
    error.fill(-1);
    level_error({{count(shape_.nx), count(shape_.ny), count(bricks_z_ * n)}, {16, 4, 1}}, error.buffer(),
                before.buffer(), samples.along.buffer(), gold_.buffer(), above_.buffer(), below_.buffer(),
                margin_.buffer(), shape_.lowest, to_int(shape_.nx), to_int(shape_.ny), to_int(shape_.nz),
                to_int(shape_.halo), to_int(shape_.gold_stride), to_int(stride_), to_int(samples.spacing),
                to_int(samples.reach), to_int(samples.cx), to_int(samples.cy), to_int(bricks_x_),
                to_int(bricks_y_), to_int(bricks_z_), to_int(n), tolerance);
    by_level.push_back(error.to_host());
    std::swap(error, before);
  }
  std::vector<BrickClass> out;
  for (const std::int64_t brick : bricks_) {
    const auto [b, x, y, z] = place(brick);
    const std::size_t i = at(((b * bricks_z_ + z) * bricks_y_ + y) * bricks_x_ + x);
    BrickClass c;
    c.base.brick = brick;
    c.base.rate = settings_.rate;
    if (totals[i] >= 0) {
      c.base = {brick,
                std::bit_cast<float>(totals[i]),
                std::bit_cast<float>(errors0[i]),
                std::bit_cast<float>(slacks[i]),
                0,
                settings_.rate};
      while (c.level < static_cast<int>(by_level.size()) && fails(by_level[at(c.level)][i])) ++c.level;
    }
    out.push_back(c);
  }
  return out;
}

std::vector<std::pair<float, float>> GoldStream::Batch::largest_p() {
  const auto p = p_.to_host();
  const std::int64_t g = settings_.granularity, rate = settings_.rate, cells_x = bricks_x_ * g,
                     cells_y = bricks_y_ * g, cells_z = (shape_.nz - 1) / rate;
  std::vector<std::pair<float, float>> out;
  for (const std::int64_t brick : bricks_) {
    const auto [b, x, y, z] = place(brick);
    std::pair<float, float> range{0.0f, INFINITY};
    for (std::int64_t k = z * g; k < std::min((z + 1) * g, cells_z); ++k)
      for (std::int64_t j = y * g; j < (y + 1) * g; ++j)
        for (std::int64_t i = x * g; i < (x + 1) * g; ++i) {
          const float v = p[at(((b * cells_z + k) * cells_y + j) * cells_x + i)];
          range = {std::max(range.first, v), std::min(range.second, v)};
        }
    out.push_back(range);
  }
  return out;
}

std::vector<float> GoldStream::Batch::extract(
    const std::vector<std::pair<std::int64_t, LevelTriple>>& tiles) {
  std::uint64_t total = 0;
  std::map<std::int64_t, std::vector<TileRequest>> by_spacing;
  std::map<std::int64_t, std::uint64_t> largest;
  for (const auto& [brick, level] : tiles) {
    const std::int64_t spacing = settings_.rate >> level[0];
    const TileRequest r = request(brick, spacing, total);
    const std::uint64_t size = count(std::int64_t{r.side_x} * r.side_y * r.side_z);
    total += size;
    largest[spacing] = std::max(largest[spacing], size);
    by_spacing[spacing].push_back(r);
  }
  if (total == 0) return {};
  const opencl::DeviceArray<float> out(state_, total, "tiles of a block");
  const opencl::Defines defines{{"VDVR_BRICK_NODES", std::to_string(settings_.granularity * settings_.rate)}};
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_float>
      kernel(state_, "classify", "extract_tiles", defines);
  for (const auto& [spacing, requests] : by_spacing) {
    const opencl::DeviceArray<TileRequest> device_requests(state_, std::span<const TileRequest>(requests),
                                                           "tile requests");
    const auto copy = [&](const opencl::DeviceArray<float>& samples, std::int64_t reach, std::int64_t cx,
                          std::int64_t cy, std::int64_t stride) {
      kernel({{largest[spacing], requests.size(), 1}, {64, 1, 1}}, out.buffer(), samples.buffer(),
             margin_.buffer(), device_requests.buffer(), to_int(static_cast<std::int64_t>(requests.size())),
             to_int(shape_.nx), to_int(shape_.ny), to_int(shape_.halo), to_int(spacing), to_int(reach),
             to_int(cx), to_int(cy), to_int(stride), static_cast<cl_float>(-kept_margin(settings_.grid, 1)));
    };
    if (spacing == 1) {  // samples at the gold rate are gold, and gold lies as its own lattice would
      copy(gold_, shape_.halo, shape_.nx + 2 * shape_.halo, shape_.ny + 2 * shape_.halo, shape_.gold_stride);
      continue;
    }
    const LevelSamples& l = lattice(spacing);
    copy(l.samples, l.reach, l.cx, l.cy, l.stride);
  }
  return out.to_host();
}

void GoldStream::Batch::fit_base(std::vector<float>& base) {
  const Grid& grid = settings_.grid;
  const Index3 n = grid.samples();
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  const LevelSamples& l = lattice(rate);
  const std::vector<float> samples = l.samples.to_host(), margins = margin_.to_host();
  const auto kept = static_cast<float>(-kept_margin(grid, 1));
  for (std::size_t b = 0; b < first_brick_.size(); ++b) {
    const auto& first = first_brick_[b];
    for (std::int64_t z = 0; z <= std::min(bricks_z_ * g, grid.cells[2] - first[2] * g); ++z)
      for (std::int64_t y = 0; y <= std::min(bricks_y_ * g, grid.cells[1] - first[1] * g); ++y)
        for (std::int64_t x = 0; x <= std::min(bricks_x_ * g, grid.cells[0] - first[0] * g); ++x) {
          const std::int64_t column =
              (static_cast<std::int64_t>(b) * (shape_.ny + 2 * shape_.halo) + y * rate + shape_.halo) *
                  (shape_.nx + 2 * shape_.halo) +
              x * rate + shape_.halo;
          if (!(margins[at(column)] >= kept)) continue;
          const std::int64_t from =
              ((static_cast<std::int64_t>(b) * l.cy + y + l.reach) * l.cx + x + l.reach) * l.stride + z +
              l.reach;
          base[at(((first[2] * g + z) * n[1] + first[1] * g + y) * n[0] + first[0] * g + x)] =
              samples[at(from)];
        }
  }
}

float GoldStream::Batch::largest_value() const {
  const std::vector<float> gold = gold_.to_host(), margins = margin_.to_host();
  const std::int64_t h = shape_.halo, wide = shape_.nx + 2 * h, deep = shape_.ny + 2 * h;
  float largest = 0;
  for (std::int64_t column = 0; column < shape_.count * wide * deep; ++column) {
    if (!(margins[at(column)] >= 0)) continue;
    for (std::int64_t z = std::max(-h, shape_.z_first); z <= std::min(shape_.nz - 1 + h, shape_.z_last); ++z)
      largest = std::max(largest, std::fabs(gold[at(column * shape_.gold_stride + z + h)]));
  }
  return largest;
}

}  // namespace vdvr
