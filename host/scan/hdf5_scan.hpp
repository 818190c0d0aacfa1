// Data Exchange and NXtomo. Called by read_scan.cpp.
#pragma once

#include <filesystem>

#include "host/scan/raw_scan.hpp"

namespace vdvr::io {

/// Data Exchange (/exchange/data) or NXtomo; frames are read later. Throws FileError.
RawScan open_hdf5_scan(const std::filesystem::path& path);

}  // namespace vdvr::io
