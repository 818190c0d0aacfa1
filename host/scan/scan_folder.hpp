// A folder with a scan.json. Called by read_scan.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "host/scan/raw_scan.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr::io {

/// A folder's scan.json; frames are read later. The first frame is read to know its size, within
/// `max_memory_bytes` (0: no limit). `beam` is asked for beside scan.json's own.
/// `follow_links`: an HDF5 file's may leave the folder. Throws FileError, InputError
/// where the two contradict each other, ResourceError.
RawScan open_scan_folder(const std::filesystem::path& folder, std::uint64_t max_memory_bytes,
                         std::optional<Beam> beam = {}, bool follow_links = false);

}  // namespace vdvr::io
