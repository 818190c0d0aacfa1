// LEAP's geometries `set_conebeam` and `set_modularbeam`, their arguments saved as JSON.
#pragma once

#include <filesystem>

#include "host/scan/geometry/cone_views.hpp"

namespace vdvr::io {

/// Throws FileError.
ConeViews leap_geometry(const std::filesystem::path& path, const StackShape& stack);

}  // namespace vdvr::io
