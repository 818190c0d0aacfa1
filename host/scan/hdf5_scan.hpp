// Data Exchange and NXtomo. Called by read_scan.cpp.
#pragma once

#include <filesystem>

#include "host/scan/raw_scan.hpp"

namespace vdvr::io {

/// Data Exchange (/exchange/data) or NXtomo; frames are read later. Its links and virtual datasets may lead
/// to files of `folder`, the scan's (empty: the file's own), with `follow_links` to any. `cone`: of
/// NXtomo, cone beam by its distances. Throws FileError.
RawScan open_hdf5_scan(const std::filesystem::path& path, const std::filesystem::path& folder,
                       bool follow_links, bool cone = false);

}  // namespace vdvr::io
