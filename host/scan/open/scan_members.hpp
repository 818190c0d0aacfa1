// Members of scan.json that say where the rays of a scan run: angles, and the kinds of cone-beam geometry.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host/scan/geometry/description.hpp"
#include "host/scan/raw/raw_scan.hpp"

namespace vdvr::io {

/// Each is a member whose value is a file, but for `geometry`, which is an object.
inline constexpr std::array<const char*, 8> cone_kinds{"geometry", "matrices", "rtk_geometry", "nikon",
                                                       "astra",    "tigre",    "cil",          "leap"};

/// The kind that a scan.json has; nothing for parallel beam. Throws FileError where it has two.
std::optional<std::string> cone_kind(const Description& about);

/// Notes a file of the folder for the scan's hash.
void use_file(RawScan& scan, const Description& about, const std::string& name);

/// `angles`, a file of numbers or a list, cut by `angle_range`; the file goes into the hash.
std::vector<double> listed_angles(const Description& about, RawScan& scan);

/// Fills `cone` of a scan whose projections are known, from the member `kind`; "beam": from the distances
/// that its HDF5 file was read with. Throws FileError.
void set_cone(const Description& about, const std::string& kind, RawScan& scan);

}  // namespace vdvr::io
