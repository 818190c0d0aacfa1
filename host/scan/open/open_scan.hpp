// Which reader a scan is for.
#pragma once

#include <filesystem>

#include "host/scan/raw/raw_scan.hpp"
#include "vdvr/expert/scan_options.hpp"

namespace vdvr::io {

/// A scan of any kind, told apart by content, with the views and the entry that options choose; frames are
/// read later. `folder` becomes whether its description is a folder's. Throws FileError, InputError.
RawScan open_scan(const std::filesystem::path& path, const ScanOptions& options, bool& folder);

/// Whether opening it may run HDF5: the file is HDF5, or a description that may name one.
bool holds_hdf5(const std::filesystem::path& path);

}  // namespace vdvr::io
