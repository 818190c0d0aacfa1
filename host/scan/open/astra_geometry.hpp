// ASTRA's projection geometries `cone` and `cone_vec`, saved as JSON.
#pragma once

#include <filesystem>

#include "host/scan/geometry/cone_views.hpp"

namespace vdvr::io {

/// Throws FileError.
ConeViews astra_geometry(const std::filesystem::path& path, const StackShape& stack);

}  // namespace vdvr::io
