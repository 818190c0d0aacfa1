// TIGRE's geometry, saved as JSON.
#pragma once

#include <filesystem>

#include "host/scan/geometry/cone_views.hpp"

namespace vdvr::io {

/// Throws FileError; for turned detectors and angles about other axes too.
ConeViews tigre_geometry(const std::filesystem::path& path, const StackShape& stack);

}  // namespace vdvr::io
