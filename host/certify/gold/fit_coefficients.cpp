// Fits lattices on the device. Launches kernels/certify/gold/fit_coefficients.cl and
// kernels/certify/gold/fit_at_twice.cl.
#include "host/certify/gold/fit_coefficients.hpp"

#include <algorithm>
#include <type_traits>

#include "host/base/opencl/write_later.hpp"
#include "host/base/system/casts.hpp"

namespace vdvr {

static_assert(sizeof(VdvrGoldBlocks) == 36 && sizeof(VdvrLattice) == 36 && sizeof(VdvrMarkedColumn) == 16);

namespace {

// Of the middle of the errors around a sample: 1 would overshoot, since a shift moves the interpolant around
// the neighbours too.
constexpr float share = 0.8f;
// Room for 16-lane reads that begin at the last node of the last column.
constexpr std::uint64_t room = 64;
// Of 16 nodes of a column, a bit each.
constexpr std::int64_t most_runs = 32;

template <class T>
void grow(opencl::State& state, opencl::DeviceArray<T>& array, std::uint64_t size, const char* what) {
  if (array.size() >= size) return;
  array = {};  // before the next one is allocated
  array = opencl::DeviceArray<T>(state, size, what);
  if constexpr (std::is_arithmetic_v<T>) array.fill(0);  // 16 lanes read beyond what is interpolated
}

}  // namespace

LatticeFit::LatticeFit(opencl::State& state, const GoldBlocks& blocks)
    : state_(state), defines_(opencl::height_defines(state.info, 16)), blocks_(blocks) {}

void LatticeFit::shape_for(const Index3& spacing) {
  const GoldBlocks& b = blocks_;
  const auto reach = [&](std::size_t a) { return b.halo / spacing[a]; };
  const auto samples = [&](std::int64_t nodes, std::size_t a) {
    return to_int((nodes - 1) / spacing[a] + 1 + 2 * reach(a));
  };
  level_.shape = {to_int(spacing[0]), to_int(spacing[1]), to_int(spacing[2]),
                  to_int(reach(0)),   to_int(reach(1)),   to_int(reach(2)),
                  samples(b.nx, 0),   samples(b.ny, 1),   samples(b.nz, 2)};
}

VdvrGoldBlocks LatticeFit::blocks_on_device() const {
  const GoldBlocks& b = blocks_;
  return {.nx = to_int(b.nx),
          .ny = to_int(b.ny),
          .nz = to_int(b.nz),
          .halo = to_int(b.halo),
          .gold_stride = to_int(b.gold_stride),
          .blocks = to_int(b.count),
          .z_first = to_int(b.z_first),
          .z_last = to_int(b.z_last),
          .lowest = b.lowest};
}

// Bits of the runs of 16 nodes in which nodes low .. high lie; a longer column's last bit stands for the
// rest.
cl_uint LatticeFit::runs_between(std::int64_t low, std::int64_t high) const {
  const auto run = [&](std::int64_t node) {
    return std::clamp<std::int64_t>((node + blocks_.halo) / 16, 0, most_runs - 1);
  };
  return static_cast<cl_uint>((std::uint64_t{2} << run(high)) - (std::uint64_t{1} << run(low)));
}

// A step looks half a spacing around a sample, the next one at what its neighbours did: nodes within as many
// spacings of the boxes, less a half, take part, and the lattice's columns on and beside those.
void LatticeFit::mark(const std::vector<NodeBox>& wanted, int steps) {
  const GoldBlocks& b = blocks_;
  const VdvrLattice& l = level_.shape;
  const std::int64_t wide = b.nx + 2 * b.halo, deep = b.ny + 2 * b.halo;
  host_wanted_.assign(at(b.count * wide * deep), 0);
  host_needed_.assign(at(b.count * l.cx * l.cy), 0);
  const std::int64_t halves = std::max(2 * steps - 1, 0), dx = (halves * l.spacing_x + 1) / 2,
                     dy = (halves * l.spacing_y + 1) / 2, dz = (halves * l.spacing_z + 1) / 2;
  for (const NodeBox& w : wanted) {
    // Errors count where the field is tested alone.
    const std::int64_t top = std::max(std::min(w.last[2] + dz, b.z_last), b.z_first),
                       bottom = std::min(std::max(w.first[2] - dz, b.z_first), top);
    const cl_uint runs = runs_between(bottom, top);
    const std::int64_t x0 = std::max(w.first[0] - dx + b.halo, std::int64_t{0}),
                       x1 = std::min(w.last[0] + dx + b.halo, wide - 1),
                       y0 = std::max(w.first[1] - dy + b.halo, std::int64_t{0}),
                       y1 = std::min(w.last[1] + dy + b.halo, deep - 1);
    for (std::int64_t y = y0; y <= y1; ++y)
      for (std::int64_t x = x0; x <= x1; ++x) host_wanted_[at((w.block * deep + y) * wide + x)] |= runs;
    // Of the lattice, whose first column need not lie on the halo's rim.
    const std::int64_t from_x = b.halo - std::int64_t{l.reach_x} * l.spacing_x,
                       from_y = b.halo - std::int64_t{l.reach_y} * l.spacing_y;
    const auto below = [](std::int64_t node, std::int64_t spacing) {
      return std::max<std::int64_t>(node / spacing - 1, 0);
    };
    for (std::int64_t y = below(y0 - from_y, l.spacing_y); y < l.cy && (y - 2) * l.spacing_y <= y1 - from_y;
         ++y)
      for (std::int64_t x = below(x0 - from_x, l.spacing_x); x < l.cx && (x - 2) * l.spacing_x <= x1 - from_x;
           ++x)
        host_needed_[at((w.block * l.cy + y) * l.cx + x)] |= runs;
  }
  grow(state_, wanted_, host_wanted_.size(), "nodes where samples are fitted");
  opencl::write_later<cl_uint>(state_, wanted_, host_wanted_);
  list(nodes_, host_wanted_, deep, wide);
  list(samples_, host_needed_, l.cy, l.cx);
}

// Those of columns [block][deep][wide] that have a run.
void LatticeFit::list(Columns& columns, const std::vector<cl_uint>& runs, std::int64_t deep,
                      std::int64_t wide) {
  std::vector<VdvrMarkedColumn> marked;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i] == 0) continue;
    const auto row = static_cast<std::int64_t>(i) / wide;
    marked.push_back(
        {to_int(row / deep), to_int(row % deep), to_int(static_cast<std::int64_t>(i) % wide), runs[i]});
  }
  columns.count = static_cast<std::int64_t>(marked.size());
  grow(state_, columns.on_device, std::max<std::size_t>(1, marked.size()), "columns that are fitted");
  opencl::write_later<VdvrMarkedColumn>(state_, columns.on_device, marked);
}

void LatticeFit::reserve(std::uint64_t gold, int steps) {
  const VdvrLattice& l = level_.shape;
  const std::uint64_t columns = count(blocks_.count * l.cx * l.cy);
  grow(state_, level_.samples, columns * count(l.cz), "samples of a level");
  grow(state_, level_.along, columns * count(blocks_.gold_stride) + room, "interpolated columns");
  if (steps == 0) return;
  grow(state_, before_, columns * count(l.cz), "samples before a step");
  grow(state_, errors_, gold, "errors of an interpolant");
  grow(state_, low_, columns * count(blocks_.gold_stride), "smallest errors");
  grow(state_, high_, columns * count(blocks_.gold_stride), "largest errors");
}

// One step, whose interpolant it leaves.
void LatticeFit::fit(const opencl::DeviceArray<float>& gold, const opencl::DeviceArray<float>& margin,
                     float curvature) {
  const GoldBlocks& b = blocks_;
  const VdvrLattice& l = level_.shape;
  const VdvrGoldBlocks blocks = blocks_on_device();
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, VdvrGoldBlocks,
                 VdvrLattice, cl_float>
      err(state_, "certify/gold/fit_coefficients", "lattice_errors", defines_);
  const std::uint64_t runs = count(b.gold_stride / opencl::lanes_of(state_.info, 16));
  err(opencl::in_groups(state_.info, {runs, count(nodes_.count), 1}, {1, 16, 1}), errors_.buffer(),
      level_.along.buffer(), gold.buffer(), margin.buffer(), nodes_.on_device.buffer(), to_int(nodes_.count),
      blocks, l, curvature);
  pool_and_shift(margin);
  std::swap(level_.samples, before_);
}

void LatticeFit::pool_and_shift(const opencl::DeviceArray<float>& margin) {
  const GoldBlocks& b = blocks_;
  const VdvrLattice& l = level_.shape;
  const VdvrGoldBlocks blocks = blocks_on_device();
  const cl_int columns = to_int(samples_.count);
  if (samples_each() == l.cz) {
    opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer,
                   cl::Buffer, cl::Buffer, cl_int, VdvrGoldBlocks, VdvrLattice, cl_float>
        both(state_, "certify/gold/fit_coefficients", "pool_and_shift", defines_);
    both(parts_of_columns(), level_.along.buffer(), before_.buffer(), level_.samples.buffer(), low_.buffer(),
         high_.buffer(), errors_.buffer(), margin.buffer(), wanted_.buffer(), samples_.on_device.buffer(),
         columns, blocks, l, share);
    return;
  }
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int,
                 VdvrGoldBlocks, VdvrLattice>
      pool(state_, "certify/gold/fit_coefficients", "pool_errors", defines_);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int,
                 VdvrGoldBlocks, VdvrLattice, cl_float>
      shift(state_, "certify/gold/fit_coefficients", "shift_lattice", defines_);
  const std::uint64_t runs = count(b.gold_stride / opencl::lanes_of(state_.info, 16));
  pool(opencl::in_groups(state_.info, {runs, count(samples_.count), 1}, {1, 16, 1}), low_.buffer(),
       high_.buffer(), errors_.buffer(), margin.buffer(), wanted_.buffer(), samples_.on_device.buffer(),
       columns, blocks, l);
  shift(parts_of_columns(), level_.along.buffer(), before_.buffer(), level_.samples.buffer(), low_.buffer(),
        high_.buffer(), samples_.on_device.buffer(), columns, samples_each(), blocks, l, share);
}

// On a CPU a work-item walks along a column, on a GPU it does a sample of it.
cl_int LatticeFit::samples_each() const { return opencl::items_along(state_.info) > 1 ? 1 : level_.shape.cz; }

opencl::Range LatticeFit::parts_of_columns() const {
  const cl_int each = samples_each();
  return opencl::in_groups(
      state_.info, {count(std::int64_t{(level_.shape.cz + each - 1) / each}), count(samples_.count), 1},
      {1, 16, 1});
}

// How many steps a column's samples take part in: all on the boxes, and one less a sample further.
void LatticeFit::mark_last_steps(const std::vector<NodeBox>& wanted, int steps) {
  const VdvrLattice& l = level_.shape;
  constexpr cl_int none = -1;
  host_last_.assign(at(blocks_.count * l.cx * l.cy), none);
  const auto last = [&](std::int64_t block, std::int64_t y, std::int64_t x) -> cl_int& {
    return host_last_[at((block * l.cy + y) * l.cx + x)];
  };
  for (const NodeBox& w : wanted)
    for (std::int64_t y = w.first[1] / 2 + l.reach_y; 2 * (y - l.reach_y) <= w.last[1] && y < l.cy; ++y)
      for (std::int64_t x = w.first[0] / 2 + l.reach_x; 2 * (x - l.reach_x) <= w.last[0] && x < l.cx; ++x)
        last(w.block, y, x) = steps - 1;
  // The distance of the nearest, by the larger of both axes: there and back over the block.
  const auto spread = [&](std::int64_t block, std::int64_t y, std::int64_t x, std::int64_t back) {
    cl_int& own = last(block, y, x);
    const auto from = [&](std::int64_t ny, std::int64_t nx) {
      if (ny >= 0 && nx >= 0 && ny < l.cy && nx < l.cx) own = std::max(own, last(block, ny, nx) - 1);
    };
    from(y, x - back);
    for (const std::int64_t dx : {-1, 0, 1}) from(y - back, x + dx);
  };
  for (std::int64_t block = 0; block < blocks_.count; ++block) {
    for (std::int64_t i = 0; i < std::int64_t{l.cy} * l.cx; ++i) spread(block, i / l.cx, i % l.cx, 1);
    for (std::int64_t i = std::int64_t{l.cy} * l.cx - 1; i >= 0; --i) spread(block, i / l.cx, i % l.cx, -1);
  }
  grow(state_, last_, host_last_.size(), "steps of a lattice's columns");
  opencl::write_later<cl_int>(state_, last_, host_last_);
  host_needed_.assign(host_last_.begin(), host_last_.end());
  for (cl_uint& needed : host_needed_) needed = needed != static_cast<cl_uint>(none);
  list(samples_, host_needed_, l.cy, l.cx);
}

// Every second node of all axes is a sample: a step is one pass.
void LatticeFit::fit_at_twice(const opencl::DeviceArray<float>& gold,
                              const opencl::DeviceArray<float>& margin, int steps, float curvature) {
  const VdvrLattice& l = level_.shape;
  const VdvrGoldBlocks blocks = blocks_on_device();
  const int lanes = opencl::lanes_of(state_.info, 8);
  const opencl::Defines defines{{"VDVR_LANES", std::to_string(lanes)}};
  // A sample more at either end than vectors hold.
  const std::uint64_t stride = opencl::round_up(count(l.cz), 8) + 8,
                      wide = count(blocks_.nx + 2 * blocks_.halo),
                      deep = count((blocks_.ny + 2 * blocks_.halo) * blocks_.count),
                      rows = count(l.cy * blocks_.count), columns = rows * count(l.cx);
  grow(state_, targets_, wide * deep * 2 * stride, "what samples are fitted to");
  grow(state_, here_, columns * stride, "samples before a step");
  grow(state_, there_, columns * stride, "samples after a step");
  const cl_int along = to_int(static_cast<std::int64_t>(stride));
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGoldBlocks, VdvrLattice, cl_int,
                 cl_float>
      targets(state_, "certify/gold/fit_at_twice", "take_targets", defines);
  opencl::Kernel<cl::Buffer, cl::Buffer, VdvrGoldBlocks, VdvrLattice, cl_int> take(
      state_, "certify/gold/fit_at_twice", "take_samples", defines),
      give(state_, "certify/gold/fit_at_twice", "give_samples", defines);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGoldBlocks, VdvrLattice,
                 cl_int, cl_int, cl_float>
      fit_step(state_, "certify/gold/fit_at_twice", "fit_step", defines);
  const opencl::Range samples = opencl::in_groups(state_.info, {count(l.cz), count(l.cx), rows}, {16, 4, 1});
  const std::uint64_t vectors = (count(l.cz) + count(lanes) - 1) / count(lanes);
  targets(opencl::in_groups(state_.info, {vectors, wide, deep}, {1, 16, 1}), targets_.buffer(), gold.buffer(),
          margin.buffer(), last_.buffer(), blocks, l, along, curvature);
  take(samples, here_.buffer(), gold.buffer(), blocks, l, along);
  for (int step = 0; step < steps; ++step) {
    fit_step(opencl::in_groups(state_.info, {vectors, count(l.cx), rows}, {1, 4, 4}), there_.buffer(),
             here_.buffer(), targets_.buffer(), margin.buffer(), last_.buffer(), blocks, l, along, step,
             share);
    std::swap(here_, there_);
  }
  give(samples, level_.samples.buffer(), here_.buffer(), blocks, l, along);
}

const LevelSamples& LatticeFit::operator()(const opencl::DeviceArray<float>& gold,
                                           const opencl::DeviceArray<float>& margin,
                                           const std::vector<NodeBox>& wanted, const Index3& spacing,
                                           int steps, float curvature) {
  shape_for(spacing);
  const bool at_twice = spacing == Index3{2, 2, 2} && steps > 0;
  if (at_twice) mark_last_steps(wanted, steps);
  else mark(wanted, steps);
  reserve(gold.size(), at_twice ? 0 : steps);
  const VdvrLattice& l = level_.shape;
  const VdvrGoldBlocks blocks = blocks_on_device();
  const cl_int n = to_int(samples_.count);
  if (at_twice) {
    fit_at_twice(gold, margin, steps, curvature);
    opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, VdvrGoldBlocks, VdvrLattice>
        interpolate(state_, "certify/gold/fit_coefficients", "interpolate_lattice", defines_);
    interpolate(parts_of_columns(), level_.along.buffer(), level_.samples.buffer(),
                samples_.on_device.buffer(), n, samples_each(), blocks, l);
    return level_;
  }
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, VdvrGoldBlocks, VdvrLattice>
      take(state_, "certify/gold/fit_coefficients", "take_lattice", defines_);
  take(parts_of_columns(), level_.along.buffer(), level_.samples.buffer(), gold.buffer(),
       samples_.on_device.buffer(), n, samples_each(), blocks, l);
  for (int step = 0; step < steps; ++step) fit(gold, margin, curvature);
  return level_;
}

}  // namespace vdvr
