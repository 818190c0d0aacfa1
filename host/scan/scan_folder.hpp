// A folder with a scan.json. Called by read_scan.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include "host/scan/raw_scan.hpp"

namespace vdvr::io {

/// A folder's scan.json; frames are read later. The first frame is read to know its size, within
/// `max_memory_bytes` (0: no limit). Throws FileError, ResourceError.
RawScan open_scan_folder(const std::filesystem::path& folder, std::uint64_t max_memory_bytes);

}  // namespace vdvr::io
