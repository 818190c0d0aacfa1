// Data Exchange and NXtomo.
#pragma once

#include <filesystem>

#include "host/scan/raw/hdf5_frames.hpp"

namespace vdvr::io {

/// Data Exchange (/exchange/data) or NXtomo; frames are read later. Its links and virtual datasets may lead
/// to files of `folder`, the scan's (empty: the file's own), with `follow_links` to any. Throws FileError,
/// also where the file holds several scans and `wanted` names none.
RawScan open_hdf5_scan(const std::filesystem::path& path, const std::filesystem::path& folder,
                       bool follow_links, const Hdf5Wanted& wanted = {});

}  // namespace vdvr::io
