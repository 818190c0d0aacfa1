// DejaVu Sans as it lies in its file, put into the library by cmake/EmbedFont.cmake.
#pragma once

#include <string_view>

namespace vdvr {

/// A whole TrueType file.
std::string_view embedded_font();

}  // namespace vdvr
