// Bytes as zlib packs them, for the formats whose readers unpack them by themselves.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace vdvr {

enum class Wrapper { zlib, gzip };

using Bytes = std::vector<std::byte>;

/// One stream. No time is written: equal bytes give equal bytes. Throws Interrupted.
Bytes packed(std::span<const std::byte> bytes, Wrapper wrapper, int level);
/// HDF5's shuffle filter: first all first bytes of the elements, then all second ones.
Bytes shuffled(std::span<const std::byte> bytes, std::size_t element_bytes);

}  // namespace vdvr
