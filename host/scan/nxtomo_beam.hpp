// Cone beam from the distances of an NXtomo file. Synchrotron files have distances too, so it is read only
// when asked for: `beam` of ScanOptions and of scan.json. Called by hdf5_scan.cpp.
#pragma once

#include <string>
#include <vector>

#include "host/hdf5/hdf5_reader.hpp"
#include "host/scan/raw_scan.hpp"

namespace vdvr::io {

/// Paths of an NXtomo entry's groups within its file; `source` is empty where there is none.
struct NxtomoGroups {
  std::string detector, source, sample;
};

/// Fills `cone` of a scan whose projections, angles, pitch and unit are known, and takes its angles away.
/// `frames` are the numbers of the projections among `frame_count`. Throws FileError: distances or pixel
/// sizes that are missing, not finite, zero or upstream where they must not be; a unit of length that is
/// unknown; a sample that moves along the axis.
void set_nxtomo_cone(const hdf5::Reader& file, const NxtomoGroups& groups,
                     const std::vector<std::int64_t>& frames, std::int64_t frame_count, RawScan& scan);

}  // namespace vdvr::io
