// The hash of a volume's content (docs/file-format.md).
#include <array>
#include <bit>
#include <cstddef>
#include <span>

#include "host/base/system/scratch_pass.hpp"
#include "host/volume/validate_volume.hpp"
#include "host/volume/vdvr_file.hpp"
#include "host/volume/vdvr_layout.hpp"
#include "vdvr/expert/hash.hpp"

namespace vdvr {
namespace {

static_assert(std::endian::native == std::endian::little,
              "content_sha256 hashes memory, which must be little-endian");

template <class T>
void add(Sha256& hash, std::span<const T> values) {
  hash.update(values.data(), values.size_bytes());
}

void add_grid(Sha256& hash, const MixedVolume& v) {
  const auto cells = zyx(v.grid.cells);
  const auto origin = zyx(v.grid.origin), spacing = zyx(v.grid.spacing);
  add(hash, std::span<const std::int64_t>(cells));
  add(hash, std::span<const double>(origin));
  add(hash, std::span<const double>(spacing));
  // Unit texts hold no zero byte and the granularity ends in seven, so two different grids never give the
  // same bytes.
  hash.update(v.grid.unit.data(), v.grid.unit.size());
  const std::array<std::int64_t, 2> counts{v.granularity, v.rate};
  add(hash, std::span<const std::int64_t>(counts));
  if (!is_coarse(v)) return;
  const auto coarsening = wide(v.coarsening);
  add(hash, std::span<const std::int64_t>(coarsening));
}

}  // namespace

std::string content_sha256(const MixedVolume& v) {
  Sha256 hash;
  ScratchPass pass;
  pass.add_all(v);
  const auto add_samples = [&](const SampleBlock& block) {
    const auto* from = static_cast<const std::byte*>(block.data());
    for (std::uint64_t at = 0; at < block.bytes(); at += ScratchPass::at_once) {
      const std::uint64_t n = std::min(ScratchPass::at_once, block.bytes() - at);
      hash.update(from + at, n);
      pass.touched(n);
    }
  };
  add_grid(hash, v);
  const bool integers = has_integers(v);
  if (integers) hash.update(&v.step, sizeof v.step);
  add_samples(v.base);
  add(hash, std::span<const LevelTriple>(v.level));
  add(hash, std::span<const std::uint32_t>(v.tile));
  for (const auto& [triple, block] : v.tiles) add_samples(block);
  // The base's offset and shift are attributes: 64 bits.
  if (v.base.type != SampleType::f32) {
    const std::array<std::int64_t, 1> offset{v.base.offset.front()};
    add(hash, std::span<const std::int64_t>(offset));
  }
  for (const auto& [triple, block] : v.tiles) add(hash, std::span<const std::int32_t>(block.offset));
  if (v.base.type != SampleType::f32) {
    const std::array<std::int64_t, 1> shift{v.base.shift.front()};
    add(hash, std::span<const std::int64_t>(shift));
  }
  for (const auto& [triple, block] : v.tiles) add(hash, std::span<const std::uint8_t>(block.shift));
  return hash.hex();
}

}  // namespace vdvr
