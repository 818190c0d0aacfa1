// Where the sample stood in each view. Called once views are chosen and lengths known.
#pragma once

#include <string>

#include "host/scan/raw/raw_scan.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr::io {

/// ". The longest part at rest is `views` 0:40", by positions along z; nothing where there is none. `pitch`:
/// of rows.
std::string part_at_rest(const RawScan& scan, double pitch);

/// Fills shifts of the geometry from what is stated, else from the file's positions along x and z, relative
/// to the first view, and the axis' roll; the words that say so go into the scan's notes or warnings.
/// Positions within a quarter of a pixel in all are those of a sample that stands still: were they spread
/// evenly over that, they would add (1/4)^2 / 12 to the variance of a pixel's aperture, 1/12, which widens it
/// by 3 % (docs/inputs.md). Throws FileError for positions along y, and all of cone beam, that move by more;
/// and where the size of a pixel is not known in their unit.
void set_shifts(RawScan& scan, const std::string& name, ParallelGeometry& geometry);

}  // namespace vdvr::io
