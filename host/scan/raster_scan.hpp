// MetaImage and NRRD stacks as scans. Called by read_scan.cpp and scan_folder.cpp.
#pragma once

#include <filesystem>
#include <vector>
#include "host/scan/raw_scan.hpp"

namespace vdvr::io {

/// A MetaImage or NRRD stack [angle][v][u] of line integrals. Throws FileError.
RawScan open_raster_scan(const std::filesystem::path& path, const std::filesystem::path& angles_file);

/// Numbers separated by blanks, commas or line ends; # starts a comment. Throws FileError naming the word and
/// line.
std::vector<double> read_numbers(const std::filesystem::path& path);

}  // namespace vdvr::io
