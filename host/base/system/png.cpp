// The one unit that holds stb_image_write.
#include "host/base/system/png.hpp"

#include <fmt/format.h>

#include <limits>
#include <string>

#include "vdvr/error.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wnull-dereference"  // growth of its arrays, seen through inlining
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace vdvr {
namespace {

void append(void* context, void* data, int size) {
  static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
}

}  // namespace

std::string encode_png(const std::filesystem::path& path, const Image& image) {
  // stb counts a row's and the picture's bytes in int.
  constexpr std::int64_t most = std::numeric_limits<int>::max() / 4;
  if (image.width < 1 || image.height < 1 || image.width > most / image.height)
    throw InputError(
        fmt::format("{}: a picture of {} x {} pixels cannot be written as PNG; choose a smaller `size`",
                    path.string(), image.width, image.height));
  if (image.rgb.size() != static_cast<std::size_t>(3 * image.width * image.height))
    throw InputError(fmt::format("{}: {} bytes of colour for {} x {} pixels", path.string(), image.rgb.size(),
                                 image.width, image.height));
  std::string bytes;
  const int width = static_cast<int>(image.width), height = static_cast<int>(image.height);
  if (stbi_write_png_to_func(append, &bytes, width, height, 3, image.rgb.data(), 3 * width) == 0)
    throw ResourceError(fmt::format("{}: no memory to encode {} x {} pixels", path.string(), width, height));
  return bytes;
}

}  // namespace vdvr
