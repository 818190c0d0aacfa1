// RTK's XML files of geometry.
#pragma once

#include <filesystem>

#include "host/files/io/raster_file.hpp"
#include "host/scan/geometry/cone_views.hpp"
#include "vdvr/expert/rtk_geometry.hpp"

namespace vdvr::io {

/// RTKThreeDCircularGeometry, version 2 or 3, for the projections of `header`. Throws FileError: parallel
/// beam, cylindrical detectors, jaws, a matrix that contradicts its parameters, another number of views.
ConeViews rtk_geometry(const std::filesystem::path& path, const RasterHeader& header,
                       const StackShape& stack);

}  // namespace vdvr::io
