// JSON of what a volume takes. Called by both programs.
#pragma once

#include "apps/common/common_options.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr::cli {

/// With `interior` inside. `file_bytes` 0: not stored in a file.
Json storage_json(const MixedVolume& volume, std::uint64_t file_bytes);
/// Bricks per level triple, in file order "zyx".
Json levels_json(const MixedVolume& volume);

}  // namespace vdvr::cli
