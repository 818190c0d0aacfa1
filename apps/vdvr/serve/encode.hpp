// A frame as the bytes that a browser shows: JPEG while it moves, PNG at rest. Called by server.cpp.
#pragma once

#include <string>

#include "vdvr/expert/image.hpp"

namespace vdvr::cli {

/// Throws ResourceError.
std::string jpeg_bytes(const Image& image);

}  // namespace vdvr::cli
