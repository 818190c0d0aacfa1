// Pictures as PNG and values as NumPy files.
#include "vdvr/expert/image.hpp"

#include <fmt/format.h>

#include <bit>
#include <string>

#include "host/base/system/png.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace vdvr {

void write_png(const std::filesystem::path& path, const Image& image) {
  io::write_file(path, encode_png(path, image));
}

std::string png_bytes(const Image& image) { return encode_png("a picture", image); }

void write_npy(const std::filesystem::path& path, const FloatImage& image) {
  if (image.width < 1 || image.height < 1 || image.channels < 1 ||
      image.values.size() != static_cast<std::size_t>(image.width * image.height * image.channels))
    throw InputError(fmt::format("{}: {} values for {} x {} pixels", path.string(), image.values.size(),
                                 image.width, image.height));
  std::string header =
      fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}{}), }}", image.height,
                  image.width, image.channels == 1 ? "" : fmt::format(", {}", image.channels));
  // Magic, version and length take 10 bytes; the header ends in a line feed at a multiple of 64.
  header.append(63 - (10 + header.size()) % 64, ' ').push_back('\n');
  std::string bytes = "\x93NUMPY";
  bytes.push_back('\x01');
  bytes.push_back('\x00');
  bytes.push_back(static_cast<char>(header.size() & 0xff));
  bytes.push_back(static_cast<char>(header.size() >> 8));
  bytes += header;
  bytes.reserve(bytes.size() + 4 * image.values.size());
  for (const float value : image.values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (int b = 0; b < 4; ++b) bytes.push_back(static_cast<char>(bits >> (8 * b)));
  }
  io::write_file(path, bytes);
}

}  // namespace vdvr
