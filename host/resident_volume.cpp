// Uploads a mixed volume once for many frames; packs and builds the image atlas. Called by raycast() and the
// verifier.
#include "host/resident_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdvr {
namespace {

using Size3 = std::array<std::uint64_t, 3>;

std::vector<std::uint64_t> candidates(std::uint64_t least, std::uint64_t most) {
  std::vector<std::uint64_t> sizes;
  // Steps of a sixteenth: the atlas found is within a few per cent of the best, from some thousand trials.
  for (std::uint64_t n = least; n < most && sizes.size() < 96; n += std::max<std::uint64_t>(1, n / 16))
    sizes.push_back(n);
  if (least <= most) sizes.push_back(most);
  return sizes;
}

// Shelves for a given width and depth; size[1] follows.
AtlasLayout lay_out(const MixedVolume& v, std::uint64_t width, std::uint64_t depth) {
  AtlasLayout l;
  const Index3 base = v.grid.samples();
  std::uint64_t y = static_cast<std::uint64_t>(base[1]);
  for (const auto& [triple, samples] : v.tiles) {
    const auto shape = v.tile_shape(triple);
    AtlasShelves s;
    for (std::size_t a = 0; a < 3; ++a) s.tile[a] = static_cast<std::uint64_t>(shape[2 - a]);
    s.tiles = samples.size() / static_cast<std::uint64_t>(v.tile_size(triple));
    s.first_y = y;
    s.columns_per_shelf = width / s.tile[0];
    s.tiles_per_column = depth / s.tile[2];
    const std::uint64_t columns = (s.tiles + s.tiles_per_column - 1) / s.tiles_per_column;
    y += (columns + s.columns_per_shelf - 1) / s.columns_per_shelf * s.tile[1];
    l.shelves[triple] = s;
  }
  l.size = {width, y, depth};
  return l;
}

// Width and depth no smaller than the base and any tile.
Size3 least_size(const MixedVolume& v) {
  const Index3 base = v.grid.samples();
  Size3 least{static_cast<std::uint64_t>(base[0]), static_cast<std::uint64_t>(base[1]),
              static_cast<std::uint64_t>(base[2])};
  for (const auto& [triple, samples] : v.tiles) {
    const auto shape = v.tile_shape(triple);
    least[0] = std::max(least[0], static_cast<std::uint64_t>(shape[2]));
    least[2] = std::max(least[2], static_cast<std::uint64_t>(shape[0]));
  }
  return least;
}

cl_float2 range_of(const float* first, const VdvrBrick& r, const std::array<std::int64_t, 3>& count) {
  float lo = std::numeric_limits<float>::infinity(), hi = -lo;
  for (std::int64_t z = 0; z < count[2]; ++z)
    for (std::int64_t y = 0; y < count[1]; ++y) {
      const float* row =
          first + static_cast<std::uint64_t>(z) * r.stride_z + static_cast<std::uint64_t>(y) * r.stride_y;
      for (std::int64_t x = 0; x < count[0]; ++x) {
        lo = std::min(lo, row[x]);
        hi = std::max(hi, row[x]);
      }
    }
  return {{lo, hi}};
}

std::vector<cl_float2> brick_ranges(const MixedVolume& v, const std::vector<VdvrBrick>& records,
                                    const std::map<LevelTriple, std::uint64_t>& offsets) {
  const Index3 b = v.bricks();
  std::vector<cl_float2> ranges(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    const VdvrBrick& r = records[i];
    const auto n = static_cast<std::int64_t>(i);
    const Index3 at{n % b[0], n / b[0] % b[1], n / (b[0] * b[1])};
    const std::array<std::uint32_t, 3> level{r.level_x, r.level_y, r.level_z};
    std::array<std::int64_t, 3> count{};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t cells =
          std::min<std::int64_t>(v.granularity, v.grid.cells[a] - at[a] * v.granularity);
      count[a] = (cells << level[a]) + 1;
    }
    const LevelTriple triple = v.level[i];
    const bool in_base = triple == LevelTriple{0, 0, 0};
    const float* first =
        in_base ? v.base.data() + r.offset : v.tiles.at(triple).data() + (r.offset - offsets.at(triple));
    ranges[i] = range_of(first, r, count);
  }
  return ranges;
}

void set_texels(const MixedVolume& v, const AtlasLayout& layout, std::vector<VdvrBrick>& records) {
  const Index3 b = v.bricks();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const auto n = static_cast<std::int64_t>(i);
    const std::int64_t g = v.granularity;
    Size3 origin{static_cast<std::uint64_t>(n % b[0] * g), static_cast<std::uint64_t>(n / b[0] % b[1] * g),
                 static_cast<std::uint64_t>(n / (b[0] * b[1]) * g)};
    if (v.level[i] != LevelTriple{0, 0, 0}) origin = layout.shelves.at(v.level[i]).origin(v.tile[i]);
    records[i].texel_x = static_cast<float>(origin[0]) + 0.5f;
    records[i].texel_y = static_cast<float>(origin[1]) + 0.5f;
    records[i].texel_z = static_cast<float>(origin[2]) + 0.5f;
  }
}

// Marks bricks that read the base, as those across their faces do. Kernels address the base by 32-bit offsets
// there.
void mark_base_around(const MixedVolume& v, std::vector<VdvrBrick>& records) {
  if (v.grid.sample_count() > std::numeric_limits<std::int32_t>::max()) return;
  const Index3 b = v.bricks();
  const auto reads_base = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    const bool inside = x >= 0 && x < b[0] && y >= 0 && y < b[1] && z >= 0 && z < b[2];
    return !inside || v.level[static_cast<std::size_t>((z * b[1] + y) * b[0] + x)] == LevelTriple{0, 0, 0};
  };
  for (std::size_t i = 0; i < records.size(); ++i) {
    const auto n = static_cast<std::int64_t>(i);
    const std::int64_t x = n % b[0], y = n / b[0] % b[1], z = n / (b[0] * b[1]);
    const bool all = reads_base(x, y, z) && reads_base(x - 1, y, z) && reads_base(x + 1, y, z) &&
                     reads_base(x, y - 1, z) && reads_base(x, y + 1, z) && reads_base(x, y, z - 1) &&
                     reads_base(x, y, z + 1);
    records[i].base_around = all ? 1 : 0;
  }
}

void check_sizes(const MixedVolume& v) {
  for (std::size_t a = 0; a < 3; ++a) {
    // Cell coordinates are fp32, and the kernels' leaps rely on rounding below 2^-8 cell.
    if (v.grid.cells[a] < 1 || v.grid.cells[a] > 8192)
      throw InputError(
          fmt::format("a volume of {} x {} x {} cells cannot be rendered; each axis needs 1 to 8192",
                      v.grid.cells[0], v.grid.cells[1], v.grid.cells[2]));
    if (!(v.grid.spacing[a] > 0))
      throw InputError(fmt::format("a grid spacing of {} cannot be rendered", v.grid.spacing[a]));
  }
  const auto bricks = static_cast<std::size_t>(v.brick_count());
  if (v.base.size() != static_cast<std::size_t>(v.grid.sample_count()) || v.level.size() != bricks ||
      v.tile.size() != bricks)
    throw InputError(fmt::format(
        "a mixed volume of {} base samples and {} / {} index entries, where its grid needs {} and {}",
        v.base.size(), v.level.size(), v.tile.size(), v.grid.sample_count(), bricks));
}

}  // namespace

ImageLimits image_limits(const DeviceInfo& info, std::uint64_t memory_left) {
  return {info.linear_float_image,
          {info.image3d_max[0], info.image3d_max[1], info.image3d_max[2]},
          std::min(info.max_allocation, memory_left)};
}

AtlasLayout pack_atlas(const MixedVolume& v, const ImageLimits& limits) {
  AtlasLayout best;
  if (!limits.linear_float) {
    best.reason = "the device has no CL_R / CL_FLOAT 3D image that it can read with the linear filter";
    return best;
  }
  const Size3 least = least_size(v);
  for (const std::uint64_t width : candidates(least[0], limits.size[0]))
    for (const std::uint64_t depth : candidates(least[2], limits.size[2])) {
      AtlasLayout l = lay_out(v, width, depth);
      if (l.size[1] > limits.size[1]) continue;
      if (best.fits && l.bytes() >= best.bytes()) continue;
      best = std::move(l);
      best.fits = true;
    }
  const auto text = [](const Size3& s) { return fmt::format("{} x {} x {}", s[0], s[1], s[2]); };
  if (!best.fits) {
    best.reason = fmt::format("base volume ({}) and tiles ({} floats) do not fit a 3D image of {} texels",
                              text(least), sample_buffer_size(v) - v.base.size(), text(limits.size));
  } else if (best.bytes() > limits.bytes) {
    best.fits = false;
    best.reason = fmt::format("an atlas of {} texels needs {} bytes, {} are left", text(best.size),
                              best.bytes(), limits.bytes);
  } else {
    best.reason = fmt::format("an atlas of {} texels, {} bytes", text(best.size), best.bytes());
  }
  return best;
}

std::vector<std::uint8_t> distance_to_occupied(const std::vector<std::uint8_t>& occupied, const Index3& n) {
  std::vector<std::uint8_t> d(occupied.size());
  std::transform(occupied.begin(), occupied.end(), d.begin(),
                 [](std::uint8_t o) { return o ? std::uint8_t{0} : std::uint8_t{255}; });
  // The two passes of a chamfer transform with all 26 neighbours at distance 1 are exact for the largest-axis
  // distance (Borgefors 1986).
  const auto pass = [&](std::int64_t sign) {
    for (std::int64_t iz = 0; iz < n[2]; ++iz)
      for (std::int64_t iy = 0; iy < n[1]; ++iy)
        for (std::int64_t ix = 0; ix < n[0]; ++ix) {
          const std::int64_t z = sign > 0 ? iz : n[2] - 1 - iz, y = sign > 0 ? iy : n[1] - 1 - iy,
                             x = sign > 0 ? ix : n[0] - 1 - ix;
          auto& here = d[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)];
          if (here == 0) continue;
          unsigned nearest = here;
          const auto look = [&](std::int64_t dz, std::int64_t dy, std::int64_t dx) {
            const std::int64_t qz = z - sign * dz, qy = y - sign * dy, qx = x - sign * dx;
            if (qz < 0 || qz >= n[2] || qy < 0 || qy >= n[1] || qx < 0 || qx >= n[0]) return;
            nearest = std::min(nearest, d[static_cast<std::size_t>((qz * n[1] + qy) * n[0] + qx)] + 1u);
          };
          for (std::int64_t dy = -1; dy <= 1; ++dy)
            for (std::int64_t dx = -1; dx <= 1; ++dx) look(1, dy, dx);
          for (std::int64_t dx = -1; dx <= 1; ++dx) look(0, 1, dx);
          look(0, 0, 1);
          here = static_cast<std::uint8_t>(std::min(nearest, 255u));
        }
  };
  pass(1);
  pass(-1);
  return d;
}

ResidentVolume::Impl::Impl(Device& device, const MixedVolume& v, const ImageLimits& limits)
    : state(&device.state()), grid(v.grid), sampler_grid(vdvr::sampler_grid(v)) {
  check_sizes(v);
  offsets_ = tile_offsets(v);
  samples = opencl::DeviceArray<float>(*state, sample_buffer_size(v), "samples of the volume");
  samples.write(v.base);
  for (const auto& [triple, values] : v.tiles) samples.write(values, offsets_.at(triple));

  std::vector<VdvrBrick> records = brick_records(v);
  ImageLimits left = limits;
  left.bytes = std::min(left.bytes, state->memory.left());
  layout = pack_atlas(v, left);
  if (layout.fits) set_texels(v, layout, records);
  mark_base_around(v, records);
  bricks = opencl::DeviceArray<VdvrBrick>(*state, std::span<const VdvrBrick>(records), "brick records");

  host_ranges = brick_ranges(v, records, offsets_);
  ranges =
      opencl::DeviceArray<cl_float2>(*state, std::span<const cl_float2>(host_ranges), "ranges of bricks");
  value_range = {host_ranges.front().s[0], host_ranges.front().s[1]};
  for (const auto& r : host_ranges) {
    value_range.first = std::min(value_range.first, r.s[0]);
    value_range.second = std::max(value_range.second, r.s[1]);
  }
  // Last, because a constructor that throws runs no destructor to give it back.
  state->memory.take(host_ranges.size() * sizeof(cl_float2), "ranges of bricks");
}

ResidentVolume::Impl::~Impl() {
  state->memory.give(host_ranges.size() * sizeof(cl_float2));
  if (atlas_) state->memory.give(layout.bytes());
}

const cl::Image3D& ResidentVolume::Impl::atlas() {
  if (atlas_) return *atlas_;
  if (!layout.fits)
    throw ResourceError("the image3d sampler cannot be used: " + layout.reason + "; use --sampler buffer");
  state->memory.take(layout.bytes(), "image3d atlas");
  try {
    cl::Image3D image(state->context, CL_MEM_READ_ONLY, cl::ImageFormat(CL_R, CL_FLOAT), layout.size[0],
                      layout.size[1], layout.size[2]);
    const auto region = [](const Size3& s) {
      return cl::array<cl::size_type, 3>{static_cast<cl::size_type>(s[0]), static_cast<cl::size_type>(s[1]),
                                         static_cast<cl::size_type>(s[2])};
    };
    // Texels beside a tile weigh 0, but 0 times NaN would be NaN.
    state->queue.enqueueFillImage(image, cl_float4{{0, 0, 0, 0}}, region({0, 0, 0}), region(layout.size));
    const Index3 base = grid.samples();
    state->queue.enqueueCopyBufferToImage(
        samples.buffer(), image, 0, region({0, 0, 0}),
        region({static_cast<std::uint64_t>(base[0]), static_cast<std::uint64_t>(base[1]),
                static_cast<std::uint64_t>(base[2])}));
    for (const auto& [triple, s] : layout.shelves)
      for (std::uint64_t i = 0; i < s.tiles; i += s.tiles_per_column) {
        const std::uint64_t count = std::min(s.tiles_per_column, s.tiles - i);
        const std::uint64_t first = offsets_.at(triple) + i * s.tile[0] * s.tile[1] * s.tile[2];
        state->queue.enqueueCopyBufferToImage(samples.buffer(), image, first * sizeof(float),
                                              region(s.origin(i)),
                                              region({s.tile[0], s.tile[1], count * s.tile[2]}));
      }
    atlas_ = std::move(image);
  } catch (const cl::Error& e) {
    state->memory.give(layout.bytes());
    throw ResourceError(fmt::format("image3d atlas, {}: {} on '{}': {}; use --sampler buffer", layout.reason,
                                    e.what(), state->info.name, opencl::code_name(e.err())));
  }
  return *atlas_;
}

std::uint64_t ResidentVolume::Impl::bytes() const {
  return samples.size() * sizeof(float) + bricks.size() * (sizeof(VdvrBrick) + sizeof(cl_float2)) +
         (atlas_ ? layout.bytes() : 0);
}

ResidentVolume::ResidentVolume(Device& device, const MixedVolume& volume)
    : ResidentVolume(device, volume, image_limits(device.info(), device.memory_left())) {}
ResidentVolume::ResidentVolume(Device& device, const MixedVolume& volume, const ImageLimits& limits)
    : impl_(std::make_unique<Impl>(device, volume, limits)) {}
ResidentVolume::~ResidentVolume() = default;
ResidentVolume::ResidentVolume(ResidentVolume&&) noexcept = default;
ResidentVolume& ResidentVolume::operator=(ResidentVolume&&) noexcept = default;

bool ResidentVolume::has_image3d() const { return impl_->layout.fits; }
std::string ResidentVolume::image3d_reason() const { return impl_->layout.reason; }
std::pair<float, float> ResidentVolume::value_range() const { return impl_->value_range; }
const Grid& ResidentVolume::grid() const { return impl_->grid; }
std::uint64_t ResidentVolume::bytes() const { return impl_->bytes(); }

}  // namespace vdvr
