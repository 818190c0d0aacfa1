// A folder with a scan.json.
#pragma once

#include <filesystem>

#include "host/scan/raw/raw_scan.hpp"
#include "vdvr/expert/scan_options.hpp"

namespace vdvr::io {

/// A folder's scan.json; frames are read later. The first frame is read to know its size, within the options'
/// memory. Of `input` only the entry is looked at here. Throws FileError, InputError where options and
/// scan.json contradict each other, ResourceError.
RawScan open_scan_folder(const std::filesystem::path& folder, const ScanOptions& options = {});

}  // namespace vdvr::io
