// The geometry of a cone-beam scan as it is read: where its axis lies, which rays it measures twice.
#pragma once

#include <filesystem>

#include "host/scan/raw/raw_scan.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr {

/// Throws FileError, or InputError where options say the column: the axis is not on the detector.
void require_on_detector(const std::filesystem::path& path, double center, std::int64_t columns,
                         const ScanOptions& options);

/// Fills the geometry of `scan`, and notes what was decided. Throws FileError, InputError.
void set_cone(const std::filesystem::path& path, const io::RawScan& raw, const ScanOptions& options,
              ProjectionSet& scan);

}  // namespace vdvr
