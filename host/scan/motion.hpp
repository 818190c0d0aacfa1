// Whether the sample stood still. Called once views are chosen and lengths known.
#pragma once

#include <string>

#include "host/scan/raw/raw_scan.hpp"

namespace vdvr::io {

/// Throws FileError where the sample moves, along an axis, by more than a quarter of a pixel in all: F is
/// that of a sample which turns and does nothing else. Were positions spread evenly over that, they would
/// add (1/4)^2 / 12 to the variance of a pixel's aperture, 1/12: it widens by 3 %, and a centre of rotation
/// is not known better either (docs/inputs.md). `pitch`: sides of a pixel at the axis, in the scan's unit.
void require_still(const RawScan& scan, double pitch, const std::string& name);

}  // namespace vdvr::io
