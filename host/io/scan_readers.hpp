// The readers of scans, one per kind of file; each returns a RawScan whose frames are read later. Called by
// host/read_scan.cpp, which tells the kinds apart by content.
#pragma once

#include <filesystem>
#include <vector>

#include "host/io/raw_scan.hpp"

namespace vdvr::io {

/// Data Exchange (/exchange/data) or NXtomo. host/io/hdf5_scan.cpp. Throws FileError.
RawScan open_hdf5_scan(const std::filesystem::path& path);

/// A folder's scan.json. The first frame is read to know its size, within `max_memory_bytes` (0: no limit).
/// host/io/scan_folder.cpp. Throws FileError, ResourceError.
RawScan open_scan_folder(const std::filesystem::path& folder, std::uint64_t max_memory_bytes);

/// A MetaImage or NRRD stack [angle][v][u] of line integrals. host/io/raster_scan.cpp. Throws FileError.
RawScan open_raster_scan(const std::filesystem::path& path, const std::filesystem::path& angles_file);

/// Numbers separated by blanks, commas or line ends; # starts a comment. Throws FileError naming the word and
/// line.
std::vector<double> read_numbers(const std::filesystem::path& path);

/// a2 before a10.
bool natural_less(const std::string& a, const std::string& b);

}  // namespace vdvr::io
