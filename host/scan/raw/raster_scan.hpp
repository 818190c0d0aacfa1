// MetaImage and NRRD stacks as scans.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>
#include "host/scan/raw/raw_scan.hpp"

namespace vdvr::io {

/// A MetaImage or NRRD stack [angle][v][u] without its angles. Throws FileError, ResourceError.
RawScan open_raster_stack(const std::filesystem::path& path, std::uint64_t max_memory_bytes);
/// The same with its angles.
RawScan open_raster_scan(const std::filesystem::path& path, const std::filesystem::path& angles_file,
                         AngleUnit unit);

/// Numbers separated by blanks, commas or line ends; # starts a comment. Throws FileError naming the word and
/// line.
std::vector<double> read_numbers(const std::filesystem::path& path);

}  // namespace vdvr::io
