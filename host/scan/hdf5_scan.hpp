// Data Exchange and NXtomo. Called by read_scan.cpp.
#pragma once

#include <filesystem>

#include "host/scan/raw_scan.hpp"

namespace vdvr::io {

/// Data Exchange (/exchange/data) or NXtomo; frames are read later. `cone`: of NXtomo, cone beam by its
/// distances. Throws FileError.
RawScan open_hdf5_scan(const std::filesystem::path& path, bool cone = false);

}  // namespace vdvr::io
