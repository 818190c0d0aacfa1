// Where each brick's samples lie in one sample buffer: base first, then the tiles of each triple in map
// order. Called by mixed_volume.cpp (sample_at), verify.cpp and resident_volume.cpp.
#pragma once

#include <map>
#include <vector>

#include "vdvr/mixed_volume.hpp"

#define VDVR_DIALECT_HOST
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"  // the shared headers are C99
#include "shared/mixed_sampler.h"
#pragma GCC diagnostic pop

namespace vdvr {

VdvrGrid sampler_grid(const MixedVolume& volume);

/// Offset of each triple's first tile in the sample buffer, in floats; base lies at 0.
std::map<LevelTriple, std::uint64_t> tile_offsets(const MixedVolume& volume);
/// Floats in the sample buffer.
std::uint64_t sample_buffer_size(const MixedVolume& volume);

/// The record of brick (bx, by, bz); texel coordinates are left 0 (the image atlas fills them).
VdvrBrick brick_record(const MixedVolume& volume, const std::map<LevelTriple, std::uint64_t>& offsets,
                       std::int64_t bx, std::int64_t by, std::int64_t bz);

/// All records, [bz][by][bx].
std::vector<VdvrBrick> brick_records(const MixedVolume& volume);

}  // namespace vdvr
