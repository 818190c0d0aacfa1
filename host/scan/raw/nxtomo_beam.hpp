// Cone beam from the distances of an NXtomo file. Synchrotron files have distances too, so it is read only
// when asked for: `beam` of ScanOptions and of scan.json.
#pragma once

#include <string>

#include "host/files/hdf5/hdf5_reader.hpp"
#include "host/scan/raw/raw_scan.hpp"

namespace vdvr::io {

/// Paths of an NXtomo entry's groups within its file; `source` is empty where there is none.
struct NxtomoGroups {
  std::string detector, source, sample;
};

/// Fills `cone` of a scan whose projections, angles, pitch and unit are known, and takes its angles away.
/// Throws FileError: distances or pixel sizes that are missing, not finite, zero or upstream where they must
/// not be; a unit of length that is unknown.
void set_nxtomo_cone(const hdf5::Reader& file, const NxtomoGroups& groups, RawScan& scan);

/// Of a scan that is read as parallel beam: a warning where the file's distances spread the rays by so much
/// that this moves one by more than a quarter of a pixel within the object.
void warn_of_magnification(const hdf5::Reader& file, const NxtomoGroups& groups, RawScan& scan);

/// Of a detector's half_acquisition or field_of_view: whether the axis lies near its edge.
bool is_half_acquisition(const hdf5::Reader& file, const std::string& detector);

}  // namespace vdvr::io
