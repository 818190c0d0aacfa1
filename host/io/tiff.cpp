// TIFF through libtiff; see tiff.hpp. Handlers are set per file (libtiff 4.5), so no global state is touched.
#include "host/io/tiff.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>

#include "host/io/tiff_messages.hpp"
#include "host/system/limits.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

int ignore_message(TIFF*, void*, const char*, const char*, va_list) { return 1; }

struct Close {
  void operator()(TIFF* t) const { TIFFClose(t); }
};

class Reader {
 public:
  Reader(const std::filesystem::path& path, std::uint64_t max_memory_bytes, bool several = false)
      : path_(path.string()), limit_(max_memory_bytes), several_(several) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) throw FileError(path_ + ": no such file");
    file_ = path_;
    file_bytes_ = std::filesystem::file_size(path, error);
    if (file_bytes_ == 0) throw FileError(path_ + ": is empty");
    const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                   &TIFFOpenOptionsFree);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_tiff_message, &message_);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore_message, nullptr);
    // libtiff itself holds tables and packed strips, none longer than the file but for its own small buffers;
    // samples go into memory of ours, which read_header asks for.
    constexpr std::uint64_t own_buffers = 64u << 20;
    TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), static_cast<tmsize_t>(file_bytes_ + own_buffers));
    tiff_.reset(TIFFOpenExt(path.c_str(), "rm", options.get()));
    if (!tiff_) fail("cannot be opened as TIFF");
    read_header();
  }

  TiffImage read() {
    image_.samples.resize(static_cast<std::size_t>(image_.rows * image_.columns));
    if (TIFFIsTiled(tiff_.get())) read_tiles();
    else read_strips();
    return std::move(image_);
  }

  TiffStack stack() {
    TiffStack s;
    s.images = static_cast<std::int64_t>(TIFFNumberOfDirectories(tiff_.get()));
    const char* text = nullptr;
    if (TIFFGetField(tiff_.get(), TIFFTAG_IMAGEDESCRIPTION, &text) == 1 && text) s.description = text;
    float per_unit = 0;
    if (TIFFGetField(tiff_.get(), TIFFTAG_XRESOLUTION, &per_unit) == 1)
      s.pixels_per_unit_x = static_cast<double>(per_unit);
    if (TIFFGetField(tiff_.get(), TIFFTAG_YRESOLUTION, &per_unit) == 1)
      s.pixels_per_unit_y = static_cast<double>(per_unit);
    return s;
  }

  void go_to(std::int64_t index) {
    path_ = fmt::format("{}, image {}", file_, index);
    if (TIFFSetDirectory(tiff_.get(), static_cast<tdir_t>(index)) != 1) fail("is truncated or damaged");
    read_header();
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw FileError(
        fmt::format("{}: {}{}", path_, what, message_.empty() ? "" : " (libtiff: " + message_ + ")"));
  }

  std::uint16_t tag(std::uint32_t which, std::uint16_t fallback) const {
    std::uint16_t value = fallback;
    return TIFFGetFieldDefaulted(tiff_.get(), which, &value) == 1 ? value : fallback;
  }

  void read_header() {
    std::uint32_t width = 0, height = 0;
    if (TIFFGetField(tiff_.get(), TIFFTAG_IMAGEWIDTH, &width) != 1 ||
        TIFFGetField(tiff_.get(), TIFFTAG_IMAGELENGTH, &height) != 1)
      fail("has no image size");
    if (!several_ && TIFFLastDirectory(tiff_.get()) == 0)
      fail("holds several images; one projection per file is needed");
    if (tag(TIFFTAG_SAMPLESPERPIXEL, 1) != 1) fail("has several samples per pixel; greyscale is needed");
    if (tag(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == PHOTOMETRIC_PALETTE) fail("has a colour palette");
    if (tag(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT) != ORIENTATION_TOPLEFT)
      fail("is stored turned or mirrored (Orientation tag); store its first row on top, first column left");
    bits_ = tag(TIFFTAG_BITSPERSAMPLE, 1);
    format_ = tag(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
    const bool integer = format_ == SAMPLEFORMAT_UINT || format_ == SAMPLEFORMAT_INT;
    const bool known = (integer && (bits_ == 8 || bits_ == 16 || bits_ == 32)) ||
                       (format_ == SAMPLEFORMAT_IEEEFP && (bits_ == 32 || bits_ == 64));
    if (!known) fail(fmt::format("has {}-bit samples of format {}, which is not supported", bits_, format_));
    image_.rows = height;
    image_.columns = width;
    image_.is_integer = integer;
    const std::array<std::int64_t, 2> shape{image_.rows, image_.columns};
    // No codec of libtiff packs tighter than about 1:1400 (Deflate 1:1032, LZW 1:1365); beyond it the header
    // is wrong.
    constexpr std::uint64_t tightest = 1400;
    const std::uint64_t bytes = checked_bytes(shape, bits_ / 8u, path_);
    const std::uint64_t ratio = tag(TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_NONE ? 1 : tightest;
    if (bytes / ratio > file_bytes_)
      fail(fmt::format("is truncated: {} samples in {} bytes", shape_text(shape), file_bytes_));
    require_memory(checked_bytes(shape, sizeof(double), path_), limit_, path_);
  }

  template <typename T>
  static void convert(const unsigned char* from, std::int64_t n, double* to) {
    for (std::int64_t i = 0; i < n; ++i) {
      T value;
      std::memcpy(&value, from + static_cast<std::size_t>(i) * sizeof(T), sizeof(T));
      to[i] = static_cast<double>(value);
    }
  }

  void convert_row(const unsigned char* from, std::int64_t n, double* to) const {
    if (format_ == SAMPLEFORMAT_IEEEFP)
      return bits_ == 32 ? convert<float>(from, n, to) : convert<double>(from, n, to);
    const bool negative = format_ == SAMPLEFORMAT_INT;
    if (bits_ == 8) return negative ? convert<std::int8_t>(from, n, to) : convert<std::uint8_t>(from, n, to);
    if (bits_ == 16)
      return negative ? convert<std::int16_t>(from, n, to) : convert<std::uint16_t>(from, n, to);
    return negative ? convert<std::int32_t>(from, n, to) : convert<std::uint32_t>(from, n, to);
  }

  void read_strips() {
    std::uint32_t per_strip = 0;
    TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_ROWSPERSTRIP, &per_strip);
    const std::int64_t step = std::clamp<std::int64_t>(per_strip, 1, image_.rows);
    const std::int64_t row_bytes = image_.columns * bits_ / 8;
    std::vector<unsigned char> buffer(static_cast<std::size_t>(step * row_bytes));
    for (std::int64_t row = 0; row < image_.rows; row += step) {
      const std::int64_t n = std::min(step, image_.rows - row);
      const auto strip = static_cast<std::uint32_t>(row / step);
      if (TIFFReadEncodedStrip(tiff_.get(), strip, buffer.data(), n * row_bytes) != n * row_bytes)
        fail(fmt::format("is truncated or damaged at row {} of {}", row, image_.rows));
      for (std::int64_t r = 0; r < n; ++r)
        convert_row(buffer.data() + r * row_bytes, image_.columns,
                    &image_.samples[static_cast<std::size_t>((row + r) * image_.columns)]);
    }
  }

  void read_tiles() {
    std::uint32_t w = 0, h = 0;
    TIFFGetField(tiff_.get(), TIFFTAG_TILEWIDTH, &w);
    TIFFGetField(tiff_.get(), TIFFTAG_TILELENGTH, &h);
    const std::array<std::int64_t, 2> tile{h, w};
    const std::uint64_t bytes = checked_bytes(tile, bits_ / 8u, path_ + ": tile");
    // A tile may exceed the image, but not by much more than rounding up: 2^26 samples are beyond any
    // writer's choice.
    constexpr std::uint64_t largest_tile = std::uint64_t{1} << 29;
    if (bytes > largest_tile || static_cast<std::uint64_t>(TIFFTileSize(tiff_.get())) != bytes)
      fail(fmt::format("has tiles of {}, which cannot be", shape_text(tile)));
    std::vector<unsigned char> buffer(bytes);
    for (std::int64_t row = 0; row < image_.rows; row += tile[0])
      for (std::int64_t column = 0; column < image_.columns; column += tile[1]) {
        if (TIFFReadTile(tiff_.get(), buffer.data(), static_cast<std::uint32_t>(column),
                         static_cast<std::uint32_t>(row), 0, 0) < 0)
          fail(fmt::format("is truncated or damaged in the tile at row {}, column {}", row, column));
        const std::int64_t n = std::min(tile[1], image_.columns - column);
        for (std::int64_t r = 0; r < std::min(tile[0], image_.rows - row); ++r)
          convert_row(buffer.data() + r * tile[1] * bits_ / 8, n,
                      &image_.samples[static_cast<std::size_t>((row + r) * image_.columns + column)]);
      }
  }

  std::string path_, file_, message_;
  std::uint64_t limit_ = 0;
  bool several_ = false;
  std::uintmax_t file_bytes_ = 0;
  std::unique_ptr<TIFF, Close> tiff_;
  std::uint16_t bits_ = 0, format_ = 0;
  TiffImage image_;
};

}  // namespace

TiffImage read_tiff(const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  return Reader(path, max_memory_bytes).read();
}

void read_tiff_stack(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                     const std::function<void(const TiffStack&)>& begin,
                     const std::function<void(std::int64_t, TiffImage)>& take) {
  Reader reader(path, max_memory_bytes, true);
  const TiffStack stack = reader.stack();
  begin(stack);
  for (std::int64_t i = 0; i < stack.images; ++i) {
    reader.go_to(i);
    take(i, reader.read());
  }
}

}  // namespace vdvr::io
