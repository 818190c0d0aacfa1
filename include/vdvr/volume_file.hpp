// Uniform volumes as MHA (MetaImage) or NRRD.
#pragma once

#include <filesystem>

#include "vdvr/grid.hpp"

namespace vdvr {

/// By extension .mha/.mhd/.nrrd/.nhdr; any scalar type becomes float. Throws FileError. 0: no memory limit.
Volume read_volume(const std::filesystem::path& path, std::uint64_t max_memory_bytes = 0);
/// float32, by extension .mha or .nrrd; whole or not at all.
void write_volume(const std::filesystem::path& path, const Volume& volume);
/// True when the extension is one read_volume takes.
bool is_volume_path(const std::filesystem::path& path);

}  // namespace vdvr
