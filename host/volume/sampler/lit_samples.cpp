// Lays lit samples out and makes them. Launches: light_samples, close_gradients of
// kernels/volume/sampler/lit_samples.cl.
#include "host/volume/sampler/lit_samples.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include "host/base/opencl/kernel.hpp"
#include "host/volume/bricks.hpp"
#include "shared/lit_gradient.h"

namespace vdvr {

static_assert(sizeof(VdvrLitBlock) == 64);

namespace {

VdvrLitBlock block_of_base(const MixedVolume& v) {
  VdvrLitBlock b{};
  const Index3 n = v.base_samples();
  b.size_x = static_cast<int>(n[0]);
  b.size_y = static_cast<int>(n[1]);
  b.size_z = static_cast<int>(n[2]);
  b.base_type = static_cast<int>(v.base.type);
  if (v.base.type != SampleType::f32) {
    b.base_scale = static_cast<float>(v.step * static_cast<double>(1u << v.base.shift.front()));
    b.base_bias = static_cast<float>(v.step * v.base.offset.front());
  }
  return b;
}

VdvrLitBlock block_of_tiles(const MixedVolume& v, const LevelTriple& triple) {
  VdvrLitBlock b{};
  const auto shape = v.tile_shape(triple);
  b.size_x = static_cast<int>(shape[2]);
  b.size_y = static_cast<int>(shape[1]);
  b.size_z = static_cast<int>(shape[0]);
  b.level_x = triple[2];
  b.level_y = triple[1];
  b.level_z = triple[0];
  return b;
}

}  // namespace

LitLayout::LitLayout(const MixedVolume& v, std::span<const std::uint8_t> here) {
  std::map<LevelTriple, std::vector<std::uint32_t>> bricks;
  for (std::size_t i = 0; i < v.level.size(); ++i)
    if (v.level[i] != LevelTriple{0, 0, 0} && (here.empty() || here[i] != 0))
      bricks[v.level[i]].push_back(static_cast<std::uint32_t>(i));

  // Places: of base bricks where they lie in the base, of tiles in the order of their bricks.
  const Bricks all(v.grid, v.granularity);
  const Index3 base = v.base_samples();
  std::vector<std::uint64_t> place(v.level.size());
  for (std::size_t i = 0; i < place.size(); ++i) {
    const auto k = static_cast<std::int64_t>(i);
    const Index3 first = first_base_sample(v, all.position(k));
    place[i] = static_cast<std::uint64_t>((first[2] * base[1] + first[1]) * base[0] + first[0]);
  }
  blocks_.push_back({block_of_base(v), {}});
  samples_ = v.base.size();
  is_uniform_ = bricks.empty() && v.coarsening == LevelTriple{0, 0, 0};
  for (auto& [triple, of_triple] : bricks) {
    VdvrLitBlock params = block_of_tiles(v, triple);
    params.tiles = static_cast<int>(of_triple.size());
    params.first = static_cast<cl_uint>(std::min<std::uint64_t>(samples_, UINT32_MAX));
    const auto size = static_cast<std::uint64_t>(v.tile_size(triple));
    for (const std::uint32_t brick : of_triple) {
      place[brick] = samples_;
      samples_ += size;
    }
    blocks_.push_back({params, of_triple});
  }

  records_.resize(2 * v.level.size());
  for (std::size_t i = 0; i < v.level.size(); ++i) {
    const LevelTriple& l = v.level[i];
    if (!here.empty() && here[i] == 0 && l != LevelTriple{0, 0, 0}) place[i] = place[bricks.at(l).front()];
    records_[2 * i] = static_cast<std::uint32_t>(place[i]);
    records_[2 * i + 1] =
        l[2] | static_cast<std::uint32_t>(l[1]) << 3 | static_cast<std::uint32_t>(l[0]) << 6;
  }
}

std::uint64_t LitLayout::sample_bytes() const { return lit_sample_bytes * samples_; }

std::uint64_t LitLayout::bytes() const { return sample_bytes() + records_.size() * sizeof(std::uint32_t); }

bool LitLayout::is_addressable() const {
  constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();
  return samples_ <= most && records_.size() <= most;
}

LitSamples::LitSamples(opencl::State& state, const DeviceField& field, const LitLayout& layout,
                       const Grid& world, float range)
    : samples_(state, layout.sample_bytes() / sizeof(cl_uint), "lit samples"),
      bricks_(state, std::span<const std::uint32_t>(layout.records_), "brick records of lit samples"),
      grid_(field.grid) {
  if (!layout.is_addressable())
    throw ResourceError(fmt::format(
        "`gradient` stored: {} samples in {} bricks, where 31 bits number the samples and two words "
        "of each brick; use `gradient` central",
        layout.samples(), layout.records_.size() / 2));
  const double unit = *std::min_element(world.spacing.begin(), world.spacing.end());
  const float largest = range > 0 ? range / 2 : 1;
  // Kernels read a component times 2^22 (shared/lit_gradient.h).
  grid_.step = largest / LIT_LARGEST * 0x1p-22f;
  grid_.lit_samples = static_cast<cl_int>(layout.samples());

  const int lanes =
      state.info.is_cpu && field.highest_place <= std::numeric_limits<std::int32_t>::max() ? 8 : 1;
  const bool uniform = layout.is_uniform() && layout.blocks_.front().params.base_type == VDVR_F32;
  opencl::Defines defines = coarse_defines(field.grid);
  defines.emplace_back("VDVR_GRANULARITY", std::to_string(field.grid.granularity));
  defines.emplace_back("VDVR_LANES", std::to_string(lanes));
  defines.emplace_back("VDVR_UNIFORM", uniform && lanes > 1 ? "1" : "0");
  defines.insert(defines.end(), field.defines.begin(), field.defines.end());
  opencl::Kernel<cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer, VdvrLitBlock, cl::Buffer> light(
      state, "volume/sampler/lit_samples", "light_samples", defines);
  opencl::Kernel<cl::Buffer, VdvrGrid, cl::Buffer, VdvrLitBlock, cl::Buffer> close(
      state, "volume/sampler/lit_samples", "close_gradients", defines);
  for (const LitLayout::Block& block : layout.blocks_) {
    VdvrLitBlock b = block.params;
    b.cells_per_length_x = static_cast<float>(unit / world.spacing[0]);
    b.cells_per_length_y = static_cast<float>(unit / world.spacing[1]);
    b.cells_per_length_z = static_cast<float>(unit / world.spacing[2]);
    b.per_gradient = LIT_LARGEST / largest;
    b.samples = static_cast<cl_uint>(layout.samples());
    const std::vector<std::uint32_t> none{0};
    const opencl::DeviceArray<std::uint32_t> which(
        state, std::span<const std::uint32_t>(block.bricks.empty() ? none : block.bricks), "bricks of tiles");
    const auto tiles = static_cast<std::uint64_t>(std::max(b.tiles, 1));
    const auto packets = static_cast<std::uint64_t>((b.size_x + lanes - 1) / lanes);
    const auto rows = static_cast<std::uint64_t>(b.size_y) * static_cast<std::uint64_t>(b.size_z);
    light({{packets, rows, tiles}, {1, 8, 1}}, field.samples.buffer(), field.bricks.buffer(), field.grid,
          which.buffer(), b, samples_.buffer());
    if (b.tiles > 0)
      close({{tiles, 1, 1}, {16, 1, 1}}, field.bricks.buffer(), field.grid, which.buffer(), b,
            samples_.buffer());
    opencl::finish(state, "lighting samples");
  }
}

std::uint64_t LitSamples::bytes() const {
  return samples_.size() * sizeof(cl_uint) + bricks_.size() * sizeof(std::uint32_t);
}

}  // namespace vdvr
