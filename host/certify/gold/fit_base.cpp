// Fits base samples on the device. Launches kernels/certify/gold/fit_base.cl.
#include "host/certify/gold/fit_base.hpp"

#include <algorithm>
#include <string>
#include <type_traits>

#include "host/base/opencl/write_later.hpp"
#include "host/base/system/casts.hpp"

namespace vdvr {

static_assert(sizeof(VdvrGoldBlocks) == 36 && sizeof(VdvrLattice) == 24);

namespace {

template <class T>
void grow(opencl::State& state, opencl::DeviceArray<T>& array, std::uint64_t size, const char* what) {
  if (array.size() >= size) return;
  array = {};  // before the next one is allocated
  array = opencl::DeviceArray<T>(state, size, what);
  if constexpr (std::is_floating_point_v<T>) array.fill(0);  // lanes read beyond what is written
}

}  // namespace

void BaseFit::shape() {
  const GoldBlocks& b = blocks_;
  const std::int64_t reach = b.halo / 2;
  const auto samples = [&](std::int64_t nodes) { return to_int((nodes - 1) / 2 + 1 + 2 * reach); };
  base_.shape = {to_int(reach), to_int(reach), to_int(reach), samples(b.nx), samples(b.ny), samples(b.nz)};
}

VdvrGoldBlocks BaseFit::blocks_on_device() const {
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

// How many steps a column's samples take part in: all on the boxes, and one less a sample further.
void BaseFit::mark_last_steps(const std::vector<NodeBox>& wanted, int steps) {
  const VdvrLattice& l = base_.shape;
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
}

// A step is one pass.
const BaseLattice& BaseFit::operator()(const opencl::DeviceArray<float>& gold,
                                       const opencl::DeviceArray<float>& margin,
                                       const std::vector<NodeBox>& wanted, int steps, float curvature) {
  shape();
  mark_last_steps(wanted, std::max(steps, 1));
  const VdvrLattice& l = base_.shape;
  const VdvrGoldBlocks blocks = blocks_on_device();
  const int lanes = opencl::lanes_of(state_.info, 8);
  const opencl::Defines defines{{"VDVR_LANES", std::to_string(lanes)}};
  // A sample more at either end than vectors hold.
  const std::uint64_t stride = opencl::round_up(count(l.cz) + 2, 8) + 8,
                      wide = count(blocks_.nx + 2 * blocks_.halo),
                      deep = count((blocks_.ny + 2 * blocks_.halo) * blocks_.count),
                      rows = count(l.cy * blocks_.count), columns = rows * count(l.cx);
  grow(state_, base_.samples, columns * count(l.cz), "base samples of blocks");
  grow(state_, targets_, wide * deep * 2 * stride, "what samples are fitted to");
  grow(state_, here_, columns * stride, "samples before a step");
  grow(state_, there_, columns * stride, "samples after a step");
  const cl_int along = to_int(static_cast<std::int64_t>(stride));
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGoldBlocks, VdvrLattice, cl_int,
                 cl_float>
      targets(state_, "certify/gold/fit_base", "take_targets", defines);
  opencl::Kernel<cl::Buffer, cl::Buffer, VdvrGoldBlocks, VdvrLattice, cl_int> take(
      state_, "certify/gold/fit_base", "take_samples", defines),
      give(state_, "certify/gold/fit_base", "give_samples", defines);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGoldBlocks, VdvrLattice, cl_int, cl_int,
                 cl_float>
      fit_step(state_, "certify/gold/fit_base", "fit_step", defines);
  const opencl::Range samples = opencl::in_groups(state_.info, {count(l.cz), count(l.cx), rows}, {16, 4, 1});
  const auto vectors = [&](int heights) { return (count(heights) + count(lanes) - 1) / count(lanes); };
  // Up to the node above the last sample, which does not count.
  targets(opencl::in_groups(state_.info, {vectors(l.cz + 1), wide, deep}, {1, 16, 1}), targets_.buffer(),
          gold.buffer(), margin.buffer(), last_.buffer(), blocks, l, along, curvature);
  take(samples, here_.buffer(), gold.buffer(), blocks, l, along);
  for (int step = 0; step < steps; ++step) {
    fit_step(opencl::in_groups(state_.info, {vectors(l.cz), count(l.cx), rows}, {1, 4, 4}), there_.buffer(),
             here_.buffer(), targets_.buffer(), last_.buffer(), blocks, l, along, step, fit_share);
    std::swap(here_, there_);
  }
  give(samples, base_.samples.buffer(), here_.buffer(), blocks, l, along);
  return base_;
}

}  // namespace vdvr
