// Moving pictures as APNG and GIF.
#pragma once

#include <filesystem>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/image.hpp"

namespace vdvr {

/// Each is written whole or not at all. Throws as write_png, and InputError for no frames, frames of several
/// sizes, or a time out of range.
/// Frames of one size, shown `frame_ms` each, for ever. APNG is lossless; a viewer without it shows frame 0.
VDVR_API void write_apng(const std::filesystem::path& path, const std::vector<Image>& frames, int frame_ms);
/// One palette of 255 colours for all frames, median cut over their pixels, ordered dither (which stands
/// still from frame to frame). Sides up to 65535. GIF counts time in hundredths of a second.
VDVR_API void write_gif(const std::filesystem::path& path, const std::vector<Image>& frames, int frame_ms);

}  // namespace vdvr
