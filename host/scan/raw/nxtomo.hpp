// NXtomo (NeXus): instrument/detector with data and image_key (0 projection, 1 flat, 2 dark, 3 invalid),
// sample/rotation_angle.
#pragma once

#include <string>
#include <vector>

#include "host/scan/raw/hdf5_frames.hpp"

namespace vdvr::io {

struct TomoEntry {
  std::string entry, instrument, detector;
  int depth = 0;
};

/// Groups with a detector that has data and image_key, in order of depth and name. NXtomo entries sit at the
/// root or one or two groups below (NXsubentry); deeper is no entry.
std::vector<TomoEntry> tomo_entries(const hdf5::Reader& file);

/// One of them; frames are read later. Throws FileError.
RawScan open_nxtomo(const hdf5::Reader& file, const TomoEntry& where, const Hdf5Wanted& wanted);

}  // namespace vdvr::io
