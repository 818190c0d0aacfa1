// `matrices` of scan.json: a 3x4 matrix for each view in NumPy's format.
#pragma once

#include <filesystem>

#include "host/scan/geometry/cone_views.hpp"

namespace vdvr::io {

/// K x 3 x 4, world to pixel, to any scale. Throws FileError.
ConeViews matrix_geometry(const std::filesystem::path& path, const StackShape& stack);

}  // namespace vdvr::io
