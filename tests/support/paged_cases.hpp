// Volumes that come to the device by bricks, in tests: a limit that has no room for the whole. Samples are
// random and bricks disagree on the faces they share, so that a ray which reads another brick's tile shows.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "host/volume/sampler/lit_samples.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr::support {

inline const std::vector<LevelTriple> kPagedTriples{{0, 0, 0}, {1, 1, 1}, {0, 2, 1}, {2, 2, 2}};
// What tables and a picture take beside volumes.
inline constexpr std::uint64_t kAside = 2'500'000;

/// Base and index, and of the tiles less than half: more than a few pixels need of so small a volume.
inline std::uint64_t budget_for(const MixedVolume& v, bool lit) {
  const auto lit_bytes = [&](const SampleBlock& b) {
    return b.bytes() + (lit ? lit_sample_bytes * b.size() : 0);
  };
  std::uint64_t tiles = 0;
  for (const auto& [triple, block] : v.tiles) tiles += lit_bytes(block);
  return 97 * v.level.size() + v.base.bytes() + lit_bytes(v.base) + tiles / 2;
}

inline Grid paged_grid() { return {{37, 34, 43}, {-18, -17, -20}, {1, 1, 0.9}, ""}; }

struct PagedCase {
  const char* name;
  MixedVolume volume;
};

/// The same volume in integers of both types.
inline MixedVolume with_integers(MixedVolume v) {
  v.step = 0x1p-14;
  std::size_t n = 0;
  const auto convert = [&](SampleBlock& b, std::size_t tiles) {
    const bool wide = n++ % 2 == 0;
    b.type = wide ? SampleType::u16 : SampleType::u8;
    const std::vector<float> from(b.f32.begin(), b.f32.end());
    b.f32.clear();
    const int shift = wide ? 0 : 7;
    for (const float s : from) {
      const auto stored = static_cast<std::int32_t>((s + 1) * 0.5f * (wide ? 65535.0f : 255.0f));
      if (wide) b.u16.push_back(static_cast<std::uint16_t>(stored));
      else b.u8.push_back(static_cast<std::uint8_t>(stored));
    }
    for (std::size_t t = 0; t < tiles; ++t) {
      // Tiles differ in what their integers stand for.
      b.offset.push_back(-16384 + static_cast<std::int32_t>(t % 5) * 1024);
      b.shift.push_back(static_cast<std::uint8_t>(shift));
    }
  };
  convert(v.base, 1);
  for (auto& [triple, block] : v.tiles)
    convert(block, block.size() / static_cast<std::size_t>(v.tile_size(triple)));
  return v;
}

inline const std::vector<PagedCase>& paged_cases() {
  static const std::vector<PagedCase> all{
      {"float", random_mixed(paged_grid(), 4, 4, kPagedTriples, 3)},
      {"integers", with_integers(random_mixed(paged_grid(), 4, 4, kPagedTriples, 5))},
      {"coarse base", random_mixed({{36, 32, 44}, {-18, -16, -20}, {1, 1, 1}, ""}, 4, 4,
                                   {{0, 0, 0}, {2, 2, 2}, {1, 2, 3}, {3, 2, 2}}, 7, {1, 0, 1})},
  };
  return all;
}

inline Camera from_within() { return look_at({3, -2, 1}, {-20, 11, 7}, std::nullopt, 70); }

inline bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return std::ranges::equal(a, b, [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  });
}

}  // namespace vdvr::support
