// Uploads a mixed volume once for many frames; packs and builds the image atlas.
#include "host/volume/sampler/resident_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/system/scratch_pass.hpp"

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

struct AtlasImage {
  Size3 size{0, 0, 0};
  std::map<TileKind, AtlasShelves> shelves;
  [[nodiscard]] std::uint64_t texels() const { return size[0] * size[1] * size[2]; }
};

// Shelves of one type's samples for a given width and depth; size[1] follows.
AtlasImage lay_out(const MixedVolume& v, SampleType type, std::uint64_t width, std::uint64_t depth) {
  AtlasImage image;
  std::uint64_t y = v.base.type == type ? static_cast<std::uint64_t>(v.base_samples()[1]) : 0;
  for (const auto& [triple, block] : v.tiles) {
    if (block.type != type) continue;
    const auto shape = v.tile_shape(triple);
    AtlasShelves s;
    for (std::size_t a = 0; a < 3; ++a) s.tile[a] = static_cast<std::uint64_t>(shape[2 - a]);
    s.tiles = block.size() / static_cast<std::uint64_t>(v.tile_size(triple));
    s.first_y = y;
    s.columns_per_shelf = width / s.tile[0];
    s.tiles_per_column = depth / s.tile[2];
    const std::uint64_t columns = (s.tiles + s.tiles_per_column - 1) / s.tiles_per_column;
    y += (columns + s.columns_per_shelf - 1) / s.columns_per_shelf * s.tile[1];
    image.shelves[triple] = s;
  }
  image.size = {width, y, depth};
  return image;
}

// Width and depth no smaller than the base and any tile; 0 where the type does not occur.
Size3 least_size(const MixedVolume& v, SampleType type) {
  const Index3 base = v.base_samples();
  Size3 least{0, 0, 0};
  if (v.base.type == type)
    for (std::size_t a = 0; a < 3; ++a) least[a] = static_cast<std::uint64_t>(base[a]);
  for (const auto& [triple, block] : v.tiles) {
    if (block.type != type) continue;
    const auto shape = v.tile_shape(triple);
    for (std::size_t a = 0; a < 3; ++a)
      least[a] = std::max(least[a], static_cast<std::uint64_t>(shape[2 - a]));
  }
  return least;
}

std::string text_of(const Size3& s) { return fmt::format("{} x {} x {}", s[0], s[1], s[2]); }

// Coordinates are packed into 15, 16 and 16 bits.
constexpr Size3 kLongest{1u << 15, 1u << 16, 1u << 16};

cl_float2 range_of(const BrickSamples& stored) {
  float lo = std::numeric_limits<float>::infinity(), hi = -lo;
  const Index3& end = stored.end();
  for (std::int64_t z = 0; z <= end[2]; ++z)
    for (std::int64_t y = 0; y <= end[1]; ++y)
      for (std::int64_t x = 0; x <= end[0]; ++x) {
        const float s = stored(x, y, z);
        lo = std::min(lo, s);
        hi = std::max(hi, s);
      }
  return {{lo, hi}};
}

Index3 position_of(const MixedVolume& v, std::size_t brick) {
  const Index3 b = v.bricks();
  const auto n = static_cast<std::int64_t>(brick);
  return {n % b[0], n / b[0] % b[1], n / (b[0] * b[1])};
}

// Marks bricks that read the base, as those across their faces do. Kernels address the base by 32-bit offsets
// there.
void mark_base_around(const MixedVolume& v, PackedRecords& records) {
  if (v.base.size() > std::numeric_limits<std::int32_t>::max()) return;
  const Index3 b = v.bricks();
  const auto reads_base = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    const bool inside = x >= 0 && x < b[0] && y >= 0 && y < b[1] && z >= 0 && z < b[2];
    return !inside || v.level[static_cast<std::size_t>((z * b[1] + y) * b[0] + x)] == LevelTriple{0, 0, 0};
  };
  for (std::size_t i = 0; i < v.level.size(); ++i) {
    const auto [x, y, z] = position_of(v, i);
    const bool all = reads_base(x, y, z) && reads_base(x - 1, y, z) && reads_base(x + 1, y, z) &&
                     reads_base(x, y - 1, z) && reads_base(x, y + 1, z) && reads_base(x, y, z - 1) &&
                     reads_base(x, y, z + 1);
    if (all) records.set_base_around(i);
  }
}

std::size_t count_of(const Index3& n) { return static_cast<std::size_t>(n[0] * n[1] * n[2]); }

void check_sizes(const MixedVolume& v) {
  check_drawn_grid(v.grid);
  const auto bricks = static_cast<std::size_t>(v.brick_count());
  if (v.base.size() != count_of(v.base_samples()) || v.level.size() != bricks || v.tile.size() != bricks)
    throw InputError(fmt::format(
        "a mixed volume of {} base samples and {} / {} index entries, where its grid needs {} and {}",
        v.base.size(), v.level.size(), v.tile.size(), count_of(v.base_samples()), bricks));
}

// Records that say where rays find the base all around.
PackedRecords marked_records(const MixedVolume& v) {
  PackedRecords records(v, tile_offsets(v), record_kind(v));
  mark_base_around(v, records);
  return records;
}

}  // namespace

void check_drawn_grid(const Grid& grid) {
  for (std::size_t a = 0; a < 3; ++a) {
    // Cell coordinates are fp32, and the kernels' leaps rely on rounding below 2^-8 cell.
    if (grid.cells[a] < 1 || grid.cells[a] > 8192)
      throw InputError(
          fmt::format("a volume of {} x {} x {} cells cannot be rendered; each axis needs 1 to 8192",
                      grid.cells[0], grid.cells[1], grid.cells[2]));
    if (!(grid.spacing[a] > 0))
      throw InputError(fmt::format("a grid spacing of {} cannot be rendered", grid.spacing[a]));
  }
}

ImageLimits image_limits(const DeviceInfo& info, std::uint64_t memory_left) {
  return {{info.linear_float_image, info.linear_u16_image, info.linear_u8_image},
          {info.image3d_max[0], info.image3d_max[1], info.image3d_max[2]},
          info.max_allocation,
          memory_left};
}

std::uint64_t AtlasLayout::bytes() const {
  const auto texels = [&](SampleType t) {
    const Size3& s = size[static_cast<std::size_t>(t)];
    return s[0] * s[1] * s[2];
  };
  return 4 * texels(SampleType::f32) + 2 * texels(SampleType::u16) + texels(SampleType::u8);
}

std::uint64_t AtlasLayout::longest() const {
  std::uint64_t longest = 0;
  for (const Size3& s : size) longest = std::max(longest, *std::max_element(s.begin(), s.end()));
  return longest;
}

AtlasLayout pack_atlas(const MixedVolume& v, const ImageLimits& limits) {
  AtlasLayout layout;
  Size3 most{};
  for (std::size_t a = 0; a < 3; ++a) most[a] = std::min(limits.size[a], kLongest[a]);
  for (const SampleType type : {SampleType::f32, SampleType::u16, SampleType::u8}) {
    const Size3 least = least_size(v, type);
    if (least[0] == 0) continue;
    const auto t = static_cast<std::size_t>(type);
    if (!limits.linear[t]) {
      layout.reason =
          fmt::format("the device has no CL_R / {} 3D image that it can read with the linear filter",
                      type == SampleType::f32   ? "CL_FLOAT"
                      : type == SampleType::u16 ? "CL_UNORM_INT16"
                                                : "CL_UNORM_INT8");
      return layout;
    }
    std::optional<AtlasImage> best;
    for (const std::uint64_t width : candidates(least[0], most[0]))
      for (const std::uint64_t depth : candidates(least[2], most[2])) {
        AtlasImage image = lay_out(v, type, width, depth);
        if (image.size[1] <= most[1] && (!best || image.texels() < best->texels())) best = std::move(image);
      }
    if (!best) {
      layout.reason =
          fmt::format("base volume and tiles of type {} (each up to {}) do not fit a 3D image of {} texels",
                      vdvr::text_of(type), text_of(least), text_of(most));
      return layout;
    }
    layout.size[t] = best->size;
    layout.shelves.merge(best->shelves);
    const std::uint64_t bytes = best->texels() * (type == SampleType::f32   ? 4
                                                  : type == SampleType::u16 ? 2
                                                                            : 1);
    if (bytes > limits.image_bytes || layout.bytes() > limits.bytes) {
      layout.reason = fmt::format("an atlas of {} texels needs {} bytes, {} are left", text_of(best->size),
                                  bytes, std::min(limits.image_bytes, limits.bytes));
      return layout;
    }
    layout.reason += fmt::format("{}an atlas of {} texels of type {}", layout.reason.empty() ? "" : ", ",
                                 text_of(best->size), vdvr::text_of(type));
  }
  layout.fits = true;
  layout.reason += fmt::format(", {} bytes", layout.bytes());
  return layout;
}

namespace {

// Distances that need no search: 0 in bricks of class 0, 1 beside a brick of another class, else 255.
std::vector<std::uint8_t> nearest_distances(const std::vector<std::uint8_t>& classes, const Index3& n) {
  std::vector<std::uint8_t> d(classes.size());
  const auto beside_another = [&](const Index3& p, std::uint8_t own) {
    for (std::int64_t z = std::max<std::int64_t>(p[2] - 1, 0); z <= std::min(p[2] + 1, n[2] - 1); ++z)
      for (std::int64_t y = std::max<std::int64_t>(p[1] - 1, 0); y <= std::min(p[1] + 1, n[1] - 1); ++y)
        for (std::int64_t x = std::max<std::int64_t>(p[0] - 1, 0); x <= std::min(p[0] + 1, n[0] - 1); ++x)
          if (classes[static_cast<std::size_t>((z * n[1] + y) * n[0] + x)] != own) return true;
    return false;
  };
  for (std::size_t i = 0; i < d.size(); ++i) {
    const auto k = static_cast<std::int64_t>(i);
    const Index3 p{k % n[0], k / n[0] % n[1], k / (n[0] * n[1])};
    d[i] = classes[i] == 0                 ? std::uint8_t{0}
           : beside_another(p, classes[i]) ? std::uint8_t{1}
                                           : std::uint8_t{255};
  }
  return d;
}

}  // namespace

std::vector<std::uint8_t> distance_to_other(const std::vector<std::uint8_t>& classes, const Index3& n) {
  std::vector<std::uint8_t> d = nearest_distances(classes, n);
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

FieldFacts facts_of(const MixedVolume& v) {
  FieldFacts f;
  for (const auto& [triple, block] : v.tiles)
    for (std::size_t a = 0; a < 3; ++a)
      f.highest_level = std::max(f.highest_level, triple.level[a] - v.coarsening[a]);
  ScratchPass pass;
  pass.add_all(v);
  for (std::size_t i = 0; i < v.level.size(); ++i) {
    f.has_tile.push_back(v.level[i] == LevelTriple{0, 0, 0} ? 0 : 1);
    const BrickSamples stored(v, position_of(v, i));
    f.ranges.push_back(range_of(stored));
    pass.touched(sizeof(float) * static_cast<std::uint64_t>(v.tile_size(v.level[i])));
    const VdvrBrick& r = stored.record();
    if (r.type == VDVR_F32) continue;
    // Beside a tile's own samples a texel can decode to anything that its type can hold.
    const float top = (r.type == VDVR_U16 ? 65535.0f : 255.0f) * r.scale;
    f.largest = std::max({f.largest, std::abs(r.bias), top, std::abs(r.bias + top)});
  }
  f.value_range = {f.ranges.front().s[0], f.ranges.front().s[1]};
  for (const auto& r : f.ranges) {
    f.value_range.first = std::min(f.value_range.first, r.s[0]);
    f.value_range.second = std::max(f.value_range.second, r.s[1]);
  }
  f.largest = std::max({f.largest, std::abs(f.value_range.first), std::abs(f.value_range.second)});
  return f;
}

ResidentVolume::Impl::Impl(Device& device, const MixedVolume& v, const ImageLimits& limits)
    : state(&device.state()),
      grid(v.grid),
      facts((check_sizes(v), std::make_shared<const FieldFacts>(facts_of(v)))),
      is_uniform(v.base.type == SampleType::f32 && v.tiles.empty() && v.coarsening == LevelTriple{0, 0, 0}),
      lit_layout(v),
      field(*state, v, marked_records(v)),
      base_samples_(v.base_samples()),
      offsets_(tile_offsets(v)) {
  lay_atlas(v, limits);
  // Last, because a constructor that throws runs no destructor to give it back.
  const std::uint64_t bytes = host_ranges.size() * sizeof(cl_float2);
  state->take_host(bytes, "ranges of bricks");
  counted_ = bytes;
}

ResidentVolume::Impl::Impl(opencl::State& of, const VolumePart& part, const ImageLimits& limits)
    : state(&of),
      grid(part.volume.grid),
      facts(part.facts),
      lit_layout(part.volume, part.here),
      field(of, part.volume, marked_records(part.volume), part.fill),
      base_samples_(part.volume.base_samples()),
      offsets_(tile_offsets(part.volume)) {
  lay_atlas(part.volume, limits);
}

void ResidentVolume::Impl::lay_atlas(const MixedVolume& v, ImageLimits left) {
  types_[{}] = v.base.type;
  for (const auto& [triple, block] : v.tiles) types_[triple] = block.type;
  left.bytes = std::min(left.bytes, state->memory.left());
  layout = pack_atlas(v, left);
  if (layout.fits) {
    PackedRecords texels(v, offsets_, record_kind(v, true));
    set_texels(v, texels);
    texel_records_ = texels.words();
    atlas_defines_ = field_defines(v, texels.kind());
  }
}

ResidentVolume::Impl::~Impl() {
  state->memory.give_host(counted_);
  if (atlas_) state->memory.give(layout.bytes());
}

// The texel of each brick's first sample, in 15, 16 and 16 bits.
void ResidentVolume::Impl::set_texels(const MixedVolume& v, PackedRecords& records) const {
  for (std::size_t i = 0; i < v.level.size(); ++i) {
    const Index3 p = position_of(v, i);
    Size3 origin{};
    if (v.level[i] == LevelTriple{0, 0, 0}) {
      const Index3 first = first_base_sample(v, p);
      for (std::size_t a = 0; a < 3; ++a) origin[a] = static_cast<std::uint64_t>(first[a]);
    } else {
      const StoredTile tile = stored_tile(v, i);
      origin = layout.shelves.at(tile.kind).origin(tile.number);
    }
    records.set_place(i, origin[0] | origin[1] << 15 | origin[2] << 31);
  }
}

void ResidentVolume::Impl::fill_image(const cl::Image3D& image, SampleType type) const {
  const auto region = [](const Size3& s) {
    return cl::array<cl::size_type, 3>{static_cast<cl::size_type>(s[0]), static_cast<cl::size_type>(s[1]),
                                       static_cast<cl::size_type>(s[2])};
  };
  const cl::Buffer& samples = field.samples.buffer();
  // Texels beside a tile weigh 0, but 0 times NaN would be NaN.
  state->queue.enqueueFillImage(image, cl_float4{{0, 0, 0, 0}}, region({0, 0, 0}),
                                region(layout.size[static_cast<std::size_t>(type)]));
  const Index3& base = base_samples_;
  if (types_.at({}) == type)
    state->queue.enqueueCopyBufferToImage(
        samples, image, 0, region({0, 0, 0}),
        region({static_cast<std::uint64_t>(base[0]), static_cast<std::uint64_t>(base[1]),
                static_cast<std::uint64_t>(base[2])}));
  const std::uint64_t sample_bytes = type == SampleType::f32 ? 4 : type == SampleType::u16 ? 2 : 1;
  for (const auto& [triple, s] : layout.shelves) {
    if (types_.at(triple) != type) continue;
    for (std::uint64_t i = 0; i < s.tiles; i += s.tiles_per_column) {
      const std::uint64_t count = std::min(s.tiles_per_column, s.tiles - i);
      state->queue.enqueueCopyBufferToImage(
          samples, image, offsets_.at(triple) + i * s.tile[0] * s.tile[1] * s.tile[2] * sample_bytes,
          region(s.origin(i)), region({s.tile[0], s.tile[1], count * s.tile[2]}));
    }
  }
}

std::array<cl::Image3D, 3> ResidentVolume::Impl::make_images() const {
  constexpr std::array<cl_channel_type, 3> formats{CL_FLOAT, CL_UNORM_INT16, CL_UNORM_INT8};
  std::array<cl::Image3D, 3> images;
  cl::Image3D any;
  for (std::size_t t = 0; t < 3; ++t) {
    const Size3& size = layout.size[t];
    if (size[0] == 0) continue;
    images[t] = cl::Image3D(state->context, CL_MEM_READ_ONLY, cl::ImageFormat(CL_R, formats[t]), size[0],
                            size[1], size[2]);
    fill_image(images[t], static_cast<SampleType>(t));
    any = images[t];
  }
  for (std::size_t t = 0; t < 3; ++t)
    if (layout.size[t][0] == 0) images[t] = any;
  return images;
}

const Atlas& ResidentVolume::Impl::atlas() const {
  const std::lock_guard guard(lock_);
  if (atlas_) return *atlas_;
  if (!layout.fits)
    throw ResourceError("the image3d sampler cannot be used: " + layout.reason + "; use `sampler` buffer");
  opencl::DeviceArray<std::uint32_t> records(*state, std::span<const std::uint32_t>(texel_records_),
                                             "brick records of the atlas");
  state->memory.take(layout.bytes(), "image3d atlas");
  try {
    return atlas_.emplace(Atlas{make_images(), std::move(records)});
  } catch (const cl::Error& e) {
    state->memory.give(layout.bytes());
    throw ResourceError(fmt::format("image3d atlas, {}: {} on '{}': {}; use `sampler` buffer", layout.reason,
                                    e.what(), state->info.name, opencl::code_name(e.err())));
  }
}

bool ResidentVolume::Impl::lit_fits() const {
  const std::lock_guard guard(lock_);
  return lit_ || (lit_layout.is_addressable() && lit_layout.sample_bytes() <= state->info.max_allocation &&
                  lit_layout.bytes() <= state->memory.left());
}

const LitSamples& ResidentVolume::Impl::lit() const {
  const std::lock_guard guard(lock_);
  if (!lit_)
    lit_.emplace(*state, field, lit_layout, grid, facts->value_range.second - facts->value_range.first);
  return *lit_;
}

const cl::Buffer& ResidentVolume::Impl::ranges() const {
  const std::lock_guard guard(lock_);
  if (ranges_.size() == 0)
    ranges_ =
        opencl::DeviceArray<cl_float2>(*state, std::span<const cl_float2>(host_ranges), "ranges of bricks");
  return ranges_.buffer();
}

std::uint64_t ResidentVolume::Impl::bytes() const {
  const std::lock_guard guard(lock_);
  return field.samples.size() + field.bricks.size() * sizeof(std::uint32_t) +
         (atlas_ ? layout.bytes() + atlas_->bricks.size() * sizeof(std::uint32_t) : 0) +
         ranges_.size() * sizeof(cl_float2) + (lit_ ? lit_->bytes() : 0);
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
std::pair<float, float> ResidentVolume::value_range() const { return impl_->facts->value_range; }
const Grid& ResidentVolume::grid() const { return impl_->grid; }
std::uint64_t ResidentVolume::bytes() const { return impl_->bytes(); }

}  // namespace vdvr
