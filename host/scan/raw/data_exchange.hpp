// Data Exchange (De Carlo et al. 2014): a group with data, data_white, data_dark and theta.
#pragma once

#include <string>

#include "host/scan/raw/hdf5_frames.hpp"

namespace vdvr::io {

/// Whether that group holds a scan.
bool is_data_exchange(const hdf5::Reader& file, const std::string& group);
/// The scan of a group, "/exchange" as a rule; frames are read later. Throws FileError.
RawScan open_data_exchange(const hdf5::Reader& file, const std::string& group, const Hdf5Wanted& wanted);

}  // namespace vdvr::io
