// A picture as the bytes of a PNG file.
#pragma once

#include <filesystem>
#include <string>

#include "vdvr/expert/image.hpp"

namespace vdvr {

/// `path` is named in errors only. Throws InputError (size) or ResourceError (memory).
std::string encode_png(const std::filesystem::path& path, const Image& image);

}  // namespace vdvr
