// CIL's AcquisitionGeometry.create_Cone3D with its panel and angles, the arguments saved as JSON.
#pragma once

#include <filesystem>

#include "host/scan/geometry/cone_views.hpp"

namespace vdvr::io {

/// Throws FileError.
ConeViews cil_geometry(const std::filesystem::path& path, const StackShape& stack);

}  // namespace vdvr::io
