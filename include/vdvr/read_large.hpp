// .vdvr files whose samples do not fit a limit of memory.
#pragma once

#include <cstdint>
#include <filesystem>

#include "vdvr/export.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {

/// read_vdvr, but that samples of more than a quarter of the limit lie in scratch files in `scratch` (empty:
/// the default folder of scratch.hpp), of which an eighth of the limit may be resident. Whoever reads them
/// needs not know. Throws as read_vdvr, and ResourceError naming the folder where it has no room.
VDVR_API VdvrFile read_large_vdvr(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                                  const std::filesystem::path& scratch, Altered altered = Altered::refuse);

/// read_certified (verify_file.hpp) of the same kind.
VDVR_API VdvrFile read_large_certified(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                                       const std::filesystem::path& scratch);

}  // namespace vdvr
