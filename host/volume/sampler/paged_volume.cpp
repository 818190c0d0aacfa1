// Facts of all bricks once, then parts: the tiles of some bricks, gathered into one sample buffer whose
// layout is that of a volume which has no others. Every kind of tile keeps its first one, to which the
// records of bricks that are not here lead, so that whatever a masked lane reads lies in the buffer.
#include "host/volume/sampler/paged_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "host/base/system/casts.hpp"
#include "host/base/system/scratch_pass.hpp"
#include "host/volume/sampler/lit_samples.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// By brick on the host: level and tile twice, ranges, flags, classes and their distances, kind, and records
// on their way to the device.
constexpr std::uint64_t kHostBytesPerBrick = 64;
// By brick on the device: records twice at most, ranges, distances.
constexpr std::uint64_t kDeviceBytesPerBrick = 12 + 12 + 8 + 1;
// The first `count` samples of a block, where they lie: whoever holds it holds the block.
SampleBlock borrowed(const SampleBlock& b, std::uint64_t count) {
  SampleBlock some;
  some.type = b.type;
  const auto lend = [&](const auto& from, auto& to) {
    using Array = std::remove_cvref_t<decltype(to)>;
    using T = typename Array::value_type;
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast): nothing writes into it
    to = Array(std::span<T>(const_cast<T*>(from.data()), static_cast<std::size_t>(count)), nullptr);
  };
  if (b.type == SampleType::f32) lend(b.f32, some.f32);
  else if (b.type == SampleType::u16) lend(b.u16, some.u16);
  else lend(b.u8, some.u8);
  return some;
}

}  // namespace

PagedVolume::Impl::Impl(Device& device, const MixedVolume& v, std::uint64_t memory_bytes)
    : state(&device.state()), volume(&v), grid(sampler_grid(v)), asked(memory_bytes) {
  check_drawn_grid(v.grid);
  find_kinds();
  facts = std::make_shared<const FieldFacts>(facts_of(v));
  const std::uint64_t left = device.memory_left(), bricks = v.level.size();
  std::uint64_t host = kHostBytesPerBrick * bricks + v.base.bytes();
  // Pages of scratch files are resident beside all that.
  for (const Kind& k : kinds_) {
    const auto& block = *k.block;
    const auto& scratch = block.type == SampleType::f32   ? block.f32.scratch()
                          : block.type == SampleType::u16 ? block.u16.scratch()
                                                          : block.u8.scratch();
    if (!scratch) continue;
    host += scratch->resident_bytes();
    break;
  }
  const std::uint64_t most = memory_bytes == 0 ? left : std::min(left, memory_bytes);
  // An eighth is left for pages that the keeper of scratch is late for, and for small things.
  memory = most > host ? (most - host) / 8 * 7 : 0;
  const std::uint64_t least = fixed_bytes(false);
  if (least > memory)
    throw ResourceError(fmt::format(
        "base and index of this volume take {} bytes, and {} are left for them under the limit; only tiles "
        "are brought to the device brick by brick: raise `max_memory`",
        least + host, most));
  // Last, because a constructor that throws runs no destructor to give it back.
  state->take_host(host, "index of a volume by bricks");
  on_host_ = host;
}

PagedVolume::Impl::~Impl() { state->memory.give_host(on_host_); }

void PagedVolume::Impl::find_kinds() {
  const MixedVolume& v = *volume;
  std::map<LevelTriple, std::uint32_t> numbers;
  std::map<TileKind, std::uint16_t> number_of;
  for (const auto& [name, block] : v.tiles) {
    Kind k;
    k.name = name;
    k.block = &block;
    k.samples = static_cast<std::uint64_t>(v.tile_size(name));
    k.tile_bytes = k.samples * block.sample_bytes();
    k.first = numbers[name.level];
    numbers[name.level] += static_cast<std::uint32_t>(block.size() / k.samples);
    number_of[name] = static_cast<std::uint16_t>(kinds_.size());
    kinds_.push_back(k);
  }
  kind_of_.resize(v.level.size());
  anchors.resize(kinds_.size());
  whole_lit = v.base.size();
  for (std::size_t i = 0; i < v.level.size(); ++i) {
    if (v.level[i] == LevelTriple{0, 0, 0}) continue;
    const StoredTile tile = stored_tile(v, i);
    const std::uint16_t k = number_of.at(tile.kind);
    kind_of_[i] = static_cast<std::uint16_t>(k + 1);
    whole_lit += kinds_[k].samples;
    if (tile.number == 0) anchors[k] = static_cast<std::uint32_t>(i);
  }
}

std::uint64_t PagedVolume::Impl::samples_of(std::size_t brick) const {
  return kind_of_[brick] == 0 ? 0 : kinds_[kind_of_[brick] - 1u].samples;
}

std::uint64_t PagedVolume::Impl::stored_bytes_of(std::size_t brick) const {
  return kind_of_[brick] == 0 ? 0 : kinds_[kind_of_[brick] - 1u].tile_bytes;
}

std::uint64_t PagedVolume::Impl::bytes_of(std::size_t brick, bool lit) const {
  const std::uint64_t stored = stored_bytes_of(brick);
  return stored + (lit ? lit_sample_bytes * samples_of(brick) : 0);
}

std::uint64_t PagedVolume::Impl::fixed_bytes(bool lit) const {
  const std::uint64_t base = volume->base.bytes();
  std::uint64_t bytes = base + kDeviceBytesPerBrick * volume->level.size();
  if (lit) bytes += lit_sample_bytes * volume->base.size();
  return bytes;
}

std::uint64_t PagedVolume::Impl::device_bytes(std::uint64_t bricks_bytes, bool lit) const {
  std::uint64_t bytes = fixed_bytes(lit) + bricks_bytes;
  for (const std::uint32_t brick : anchors) bytes += bytes_of(brick, lit);
  return bytes;
}

bool PagedVolume::Impl::is_addressable(std::uint64_t samples, std::uint64_t stored_bytes, bool lit) const {
  constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();
  std::uint64_t all_samples = volume->base.size() + samples, all_bytes = volume->base.bytes() + stored_bytes;
  for (const std::uint32_t brick : anchors) {
    all_samples += samples_of(brick);
    all_bytes += stored_bytes_of(brick) + 4;
  }
  if (all_bytes > state->info.max_allocation) return false;
  return !lit || (all_samples <= most && lit_sample_bytes * all_samples <= state->info.max_allocation);
}

std::uint64_t PagedVolume::Impl::highest_place() const { return volume->base.bytes() + memory; }

VolumePart PagedVolume::Impl::part_of(std::vector<std::uint8_t> here) const {
  const MixedVolume& v = *volume;
  for (const std::uint32_t brick : anchors) here[brick] = 1;
  // By kind, which of its tiles are here, in the order of their numbers.
  std::vector<std::vector<std::uint32_t>> tiles(kinds_.size());
  for (std::size_t i = 0; i < here.size(); ++i) {
    if (kind_of_[i] == 0) here[i] = 0;
    if (here[i] == 0) continue;
    const std::size_t k = kind_of_[i] - 1u;
    tiles[k].push_back(v.tile[i] - kinds_[k].first);
  }
  VolumePart part;
  part.facts = facts;
  MixedVolume& p = part.volume;
  p.grid = v.grid;
  p.granularity = v.granularity;
  p.rate = v.rate;
  p.coarsening = v.coarsening;
  p.step = v.step;
  p.base = borrowed(v.base, v.base.size());
  p.base.offset = v.base.offset;
  p.base.shift = v.base.shift;
  p.level = v.level;
  p.tile.assign(v.tile.size(), 0);
  std::vector<std::uint32_t> first(kinds_.size());
  std::map<LevelTriple, std::uint32_t> numbers;
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    std::sort(tiles[k].begin(), tiles[k].end());
    const Kind& kind = kinds_[k];
    SampleBlock& block = p.tiles[kind.name] = borrowed(*kind.block, tiles[k].size() * kind.samples);
    first[k] = numbers[kind.name.level];
    numbers[kind.name.level] += static_cast<std::uint32_t>(tiles[k].size());
    if (block.type == SampleType::f32) continue;
    for (const std::uint32_t t : tiles[k]) {
      block.offset.push_back(kind.block->offset[t]);
      block.shift.push_back(kind.block->shift[t]);
    }
  }
  for (std::size_t i = 0; i < here.size(); ++i) {
    if (here[i] == 0) continue;
    const std::size_t k = kind_of_[i] - 1u;
    const auto at = std::lower_bound(tiles[k].begin(), tiles[k].end(), v.tile[i] - kinds_[k].first);
    p.tile[i] = first[k] + static_cast<std::uint32_t>(at - tiles[k].begin());
  }
  part.here = std::move(here);
  const auto offsets = tile_offsets(p);
  part.fill = [this, tiles = std::move(tiles), offsets](std::span<std::uint8_t> to) {
    ScratchPass pass;
    pass.add_all(*volume);
    std::memcpy(to.data(), volume->base.data(), volume->base.bytes());
    for (std::size_t k = 0; k < kinds_.size(); ++k) {
      const Kind& kind = kinds_[k];
      const auto* from = static_cast<const std::uint8_t*>(kind.block->data());
      std::uint8_t* at = to.data() + offsets.at(kind.name);
      for (const std::uint32_t t : tiles[k]) {
        std::memcpy(at, from + t * kind.tile_bytes, kind.tile_bytes);
        at += kind.tile_bytes;
        pass.touched(kind.tile_bytes);
      }
    }
  };
  return part;
}

std::unique_ptr<ResidentVolume::Impl> PagedVolume::Impl::load(std::vector<std::uint8_t> here,
                                                              bool lit) const {
  VolumePart part = part_of(std::move(here));
  PagingCounts now;
  for (std::size_t i = 0; i < part.here.size(); ++i) {
    if (part.here[i] == 0) continue;
    ++now.bricks;
    now.bytes += stored_bytes_of(i);
    now.largest_part += bytes_of(i, lit);
  }
  auto loaded = std::make_unique<ResidentVolume::Impl>(*state, part, ImageLimits{});
  ++counts.parts;
  counts.bricks += now.bricks;
  counts.bytes += now.bytes;
  counts.largest_part = std::max(counts.largest_part, now.largest_part);
  return loaded;
}

PagedVolume::PagedVolume(Device& device, const MixedVolume& volume, std::uint64_t memory_bytes)
    : impl_(std::make_unique<Impl>(device, volume, memory_bytes)) {}
PagedVolume::~PagedVolume() = default;
PagedVolume::PagedVolume(PagedVolume&&) noexcept = default;
PagedVolume& PagedVolume::operator=(PagedVolume&&) noexcept = default;

PagingCounts PagedVolume::counts() const { return impl_->counts; }
std::uint64_t PagedVolume::memory_bytes() const { return impl_->memory; }
std::pair<float, float> PagedVolume::value_range() const { return impl_->facts->value_range; }

bool fits(const Device& device, const MixedVolume& volume) {
  // The probe's tile, and pieces of rays of a band of pixels.
  constexpr std::uint64_t beside = std::uint64_t{8} << 20;
  const std::uint64_t samples = sample_buffer_bytes(volume), left = device.memory_left();
  return samples <= device.info().max_allocation &&
         samples + kDeviceBytesPerBrick * volume.level.size() + beside <= left;
}

}  // namespace vdvr
