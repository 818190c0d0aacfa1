// TIFF through libtiff; see tiff.hpp. Handlers are set per file (libtiff 4.5), so no global state is touched.
#include "host/files/io/tiff.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include "host/base/system/limits.hpp"
#include "host/files/io/number_text.hpp"
#include "host/files/io/stored_numbers.hpp"
#include "host/files/io/tiff_messages.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

int ignore_message(TIFF*, void*, const char*, const char*, va_list) { return 1; }

struct Close {
  void operator()(TIFF* t) const { TIFFClose(t); }
};

double half_value(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31, fraction = bits & 1023;
  const double magnitude = exponent == 31  ? (fraction == 0 ? HUGE_VAL : std::nan(""))
                           : exponent == 0 ? std::ldexp(fraction, -24)
                                           : std::ldexp(1024 + fraction, exponent - 25);
  return (bits >> 15) != 0 ? -magnitude : magnitude;
}

}  // namespace

std::string imagej_value(const std::string& description, const std::string& key) {
  std::istringstream lines(description);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.rfind(key + "=", 0) == 0) return line.substr(key.size() + 1);
  }
  return "";
}

class TiffFile::Reader {
 public:
  Reader(const std::filesystem::path& path, std::uint64_t max_memory_bytes)
      : path_(path.string()), limit_(max_memory_bytes) {
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
    stack_.rows = rows_;
    stack_.columns = columns_;
    stack_.is_integer = format_ != SAMPLEFORMAT_IEEEFP;
    read_description();
    list_images();
    stack_.images = static_cast<std::int64_t>(directories_.size());
    if (is_imagej()) check_imagej();
  }

  [[nodiscard]] const TiffStack& stack() const { return stack_; }

  void read(std::int64_t index, double* out) {
    if (contiguous_) {
      read_contiguous(index, out);
    } else {
      go_to(static_cast<std::size_t>(index));
      if (TIFFIsTiled(tiff_.get())) read_tiles(out);
      else read_strips(out);
    }
    if (scale_ == 1 && offset_ == 0) return;
    for (std::int64_t i = 0; i < rows_ * columns_; ++i) out[i] = offset_ + scale_ * out[i];
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

  // --- directories ---

  void read_description() {
    const char* text = nullptr;
    if (TIFFGetField(tiff_.get(), TIFFTAG_IMAGEDESCRIPTION, &text) == 1 && text) stack_.description = text;
    float per_unit = 0;
    if (TIFFGetField(tiff_.get(), TIFFTAG_XRESOLUTION, &per_unit) == 1)
      stack_.pixels_per_unit_x = static_cast<double>(per_unit);
    if (TIFFGetField(tiff_.get(), TIFFTAG_YRESOLUTION, &per_unit) == 1)
      stack_.pixels_per_unit_y = static_cast<double>(per_unit);
  }

  // Where each image's directory is: going to one by its number walks from the first.
  void list_images() {
    directories_.push_back(TIFFCurrentDirOffset(tiff_.get()));
    current_ = 0;
    while (TIFFLastDirectory(tiff_.get()) == 0) {
      path_ = fmt::format("{}, image {}", file_, directories_.size());
      if (TIFFReadDirectory(tiff_.get()) != 1) fail("is truncated or damaged");
      std::uint32_t kind = 0, width = 0, height = 0;
      TIFFGetField(tiff_.get(), TIFFTAG_SUBFILETYPE, &kind);
      TIFFGetField(tiff_.get(), TIFFTAG_IMAGEWIDTH, &width);
      TIFFGetField(tiff_.get(), TIFFTAG_IMAGELENGTH, &height);
      const bool is_same_size = width == stack_.columns && height == stack_.rows;
      if ((kind & FILETYPE_REDUCEDIMAGE) != 0 && !is_same_size) continue;
      read_header();
      if (!is_same_size)
        fail(fmt::format("has {} x {} pixels, the first image has {} x {}", width, height, stack_.columns,
                         stack_.rows));
      stack_.is_integer = stack_.is_integer && format_ != SAMPLEFORMAT_IEEEFP;
      current_ = directories_.size();
      directories_.push_back(TIFFCurrentDirOffset(tiff_.get()));
    }
    path_ = file_;
    if (directories_.size() == 1 && current_ == 0) return;
    current_ = directories_.size();  // which of them is open, or a smaller copy, is not worth knowing
  }

  void go_to(std::size_t index) {
    if (index == current_) return;
    if (directories_.size() > 1) path_ = fmt::format("{}, image {}", file_, index);
    if (TIFFSetSubDirectory(tiff_.get(), directories_[index]) != 1) fail("is truncated or damaged");
    read_header();
    if (rows_ != stack_.rows || columns_ != stack_.columns) fail("was changed while it was read");
    current_ = index;
  }

  // --- ImageJ ---

  [[nodiscard]] bool is_imagej() const { return stack_.description.rfind("ImageJ=", 0) == 0; }

  [[nodiscard]] std::int64_t imagej_count(const char* key) const {
    const std::string text = imagej_value(stack_.description, key);
    if (text.empty()) return 1;
    const auto value = number_of(text);
    if (!value || !(*value >= 1 && *value <= 0x1p31) || *value != std::floor(*value))
      fail(fmt::format("ImageJ's description says {}={}", key, text.substr(0, 40)));
    return static_cast<std::int64_t>(*value);
  }

  void check_imagej() {
    const std::int64_t channels = imagej_count("channels"), slices = imagej_count("slices"),
                       frames = imagej_count("frames");
    if (channels > 1)
      fail(fmt::format("holds {} channels; split them (ImageJ: Image > Color > Split Channels) and take one",
                       channels));
    if (slices > 1 && frames > 1)
      fail(fmt::format(
          "holds {} time points of {} slices; save one of them (ImageJ: Image > Duplicate) as a file of its "
          "own",
          frames, slices));
    read_calibration();
    if (imagej_value(stack_.description, "images").empty()) return;
    const std::int64_t images = imagej_count("images");
    if (images == stack_.images) return;
    if (stack_.images != 1)
      fail(fmt::format("ImageJ wrote {} images, {} are listed; save it as a folder of slices", images,
                       stack_.images));
    find_contiguous(images);
  }

  // What integers stand for, where it is a straight line: signed 16 bits, which ImageJ stores from 32768 on,
  // and exports of integers.
  void read_calibration() {
    const auto number = [&](const char* key) { return number_of(imagej_value(stack_.description, key)); };
    const auto offset = number("c0"), scale = number("c1");
    if (number("cf") != 0.0 || !offset || !scale || *scale == 0) return;
    offset_ = *offset;
    scale_ = *scale;
    const auto is_whole = [](double x) { return x == std::floor(x); };
    stack_.is_integer = stack_.is_integer && is_whole(offset_) && is_whole(scale_);
  }

  // Beyond 4 GiB ImageJ writes one directory, and the other images behind the first.
  void find_contiguous(std::int64_t images) {
    const std::uint64_t* offsets = nullptr;
    const std::uint64_t* bytes = nullptr;
    const bool is_plain = tag(TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_NONE &&
                          !TIFFIsTiled(tiff_.get()) && bits_ % 8 == 0 &&
                          TIFFGetField(tiff_.get(), TIFFTAG_STRIPOFFSETS, &offsets) == 1 &&
                          TIFFGetField(tiff_.get(), TIFFTAG_STRIPBYTECOUNTS, &bytes) == 1 && offsets && bytes;
    if (!is_plain)
      fail(fmt::format("ImageJ wrote {} images, one is listed; save it as a folder of slices", images));
    for (std::uint32_t i = 1; i < TIFFNumberOfStrips(tiff_.get()); ++i)
      if (offsets[i] != offsets[i - 1] + bytes[i - 1])
        fail(fmt::format("ImageJ wrote {} images behind each other, but the first is not in one piece",
                         images));
    const std::array<std::int64_t, 3> shape{images, rows_, columns_};
    const std::uint64_t needed = checked_bytes(shape, bits_ / 8u, path_), start = offsets[0];
    if (start > file_bytes_ || needed > file_bytes_ - start)
      fail(fmt::format("is truncated: ImageJ's {} images of {} bytes, {} bytes are there", images,
                       needed / static_cast<std::uint64_t>(images),
                       file_bytes_ - std::min<std::uint64_t>(start, file_bytes_)));
    contiguous_ = start;
    stack_.images = images;
    raw_.open(file_, std::ios::binary);
  }

  void read_contiguous(std::int64_t index, double* out) {
    const std::int64_t width = bits_ / 8;
    std::vector<unsigned char> row(static_cast<std::size_t>(columns_ * width));
    raw_.seekg(static_cast<std::streamoff>(*contiguous_) + index * rows_ * columns_ * width);
    for (std::int64_t r = 0; r < rows_; ++r) {
      if (!raw_.read(reinterpret_cast<char*>(row.data()), static_cast<std::streamsize>(row.size())))
        throw FileError(
            fmt::format("{}, image {}: is truncated or damaged at row {} of {}", file_, index, r, rows_));
      if (TIFFIsByteSwapped(tiff_.get()))
        for (auto at = row.begin(); at != row.end(); at += width) std::reverse(at, at + width);
      convert_row(row.data(), columns_, out + r * columns_);
    }
  }

  // --- one image ---

  void read_header() {
    std::uint32_t width = 0, height = 0;
    if (TIFFGetField(tiff_.get(), TIFFTAG_IMAGEWIDTH, &width) != 1 ||
        TIFFGetField(tiff_.get(), TIFFTAG_IMAGELENGTH, &height) != 1 || width == 0 || height == 0)
      fail("has no image size");
    if (const int samples = tag(TIFFTAG_SAMPLESPERPIXEL, 1); samples != 1)
      fail(fmt::format("has {} samples per pixel (colour, or alpha); save it as greyscale", samples));
    std::uint32_t depth = 1;
    if (TIFFGetField(tiff_.get(), TIFFTAG_IMAGEDEPTH, &depth) == 1 && depth > 1)
      fail(fmt::format("is an image of depth {}; save it as a stack of images", depth));
    if (tag(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == PHOTOMETRIC_PALETTE)
      fail("has a colour palette; save it as greyscale");
    if (tag(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT) != ORIENTATION_TOPLEFT)
      fail("is stored turned or mirrored (Orientation tag); store its first row on top, first column left");
    bits_ = tag(TIFFTAG_BITSPERSAMPLE, 1);
    format_ = tag(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
    if (format_ == SAMPLEFORMAT_VOID) format_ = SAMPLEFORMAT_UINT;  // "untyped", which older writers mean so
    const bool integer = format_ == SAMPLEFORMAT_UINT || format_ == SAMPLEFORMAT_INT;
    const bool known = (integer && ((bits_ >= 1 && bits_ <= 16) || bits_ == 32 || bits_ == 64)) ||
                       (format_ == SAMPLEFORMAT_IEEEFP && (bits_ == 16 || bits_ == 32 || bits_ == 64));
    if (!known)
      fail(
          fmt::format("has {}-bit samples of format {}, which is not supported; save it as 16-bit integers "
                      "or 32-bit floats",
                      bits_, format_));
    rows_ = height;
    columns_ = width;
    // No codec of libtiff packs tighter than about 1:1400 (Deflate 1:1032, LZW 1:1365); beyond it the header
    // is wrong.
    constexpr std::uint64_t tightest = 1400;
    const std::array<std::int64_t, 2> shape{rows_, columns_}, packed{rows_, bytes_of(columns_)};
    const std::uint64_t bytes = checked_bytes(packed, 1, path_);
    const std::uint64_t ratio = tag(TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_NONE ? 1 : tightest;
    if (bytes / ratio > file_bytes_)
      fail(fmt::format("is truncated: {} samples in {} bytes", shape_text(shape), file_bytes_));
    require_memory(checked_bytes(shape, sizeof(double), path_), limit_, path_);
  }

  // Of samples in a row: rows begin at whole bytes.
  [[nodiscard]] std::int64_t bytes_of(std::int64_t samples) const { return (samples * bits_ + 7) / 8; }

  static void convert_halves(const unsigned char* from, std::int64_t n, double* to) {
    for (std::int64_t i = 0; i < n; ++i) {
      std::uint16_t bits = 0;
      std::memcpy(&bits, from + 2 * i, sizeof bits);
      to[i] = half_value(bits);
    }
  }

  // Samples of 1 to 15 bits behind each other, the highest bit first.
  void unpack(const unsigned char* from, std::int64_t n, double* to) const {
    std::uint32_t pool = 0;
    int held = 0;
    for (std::int64_t i = 0; i < n; ++i) {
      for (; held < bits_; held += 8) pool = pool << 8 | *from++;
      held -= bits_;
      const auto value = static_cast<std::int32_t>(pool >> held & ((1u << bits_) - 1));
      const bool is_negative = format_ == SAMPLEFORMAT_INT && (value >> (bits_ - 1)) != 0;
      to[i] = is_negative ? value - (1 << bits_) : value;
    }
  }

  void convert_row(const unsigned char* from, std::int64_t n, double* to) const {
    const ScalarKind kind = format_ == SAMPLEFORMAT_IEEEFP ? ScalarKind::floating
                            : format_ == SAMPLEFORMAT_INT  ? ScalarKind::signed_integer
                                                           : ScalarKind::unsigned_integer;
    if (kind == ScalarKind::floating && bits_ == 16) return convert_halves(from, n, to);
    if (bits_ % 8 != 0) return unpack(from, n, to);
    convert_numbers(kind, bits_ / 8, from, n, false, to);
  }

  void read_strips(double* out) {
    std::uint32_t per_strip = 0;
    TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_ROWSPERSTRIP, &per_strip);
    const std::int64_t step = std::clamp<std::int64_t>(per_strip, 1, rows_);
    const std::int64_t row_bytes = bytes_of(columns_);
    std::vector<unsigned char> buffer(static_cast<std::size_t>(step * row_bytes));
    for (std::int64_t row = 0; row < rows_; row += step) {
      const std::int64_t n = std::min(step, rows_ - row);
      const auto strip = static_cast<std::uint32_t>(row / step);
      if (TIFFReadEncodedStrip(tiff_.get(), strip, buffer.data(), n * row_bytes) != n * row_bytes)
        fail(fmt::format("is truncated or damaged at row {} of {}", row, rows_));
      for (std::int64_t r = 0; r < n; ++r)
        convert_row(buffer.data() + r * row_bytes, columns_, out + (row + r) * columns_);
    }
  }

  void read_tiles(double* out) {
    std::uint32_t w = 0, h = 0;
    TIFFGetField(tiff_.get(), TIFFTAG_TILEWIDTH, &w);
    TIFFGetField(tiff_.get(), TIFFTAG_TILELENGTH, &h);
    const std::array<std::int64_t, 2> tile{h, w}, packed{h, bytes_of(w)};
    const std::uint64_t bytes = checked_bytes(packed, 1, path_ + ": tile");
    // A tile may exceed the image, but not by much more than rounding up: 2^26 samples are beyond any
    // writer's choice.
    constexpr std::uint64_t largest_tile = std::uint64_t{1} << 29;
    if (bytes > largest_tile || static_cast<std::uint64_t>(TIFFTileSize(tiff_.get())) != bytes)
      fail(fmt::format("has tiles of {}, which cannot be", shape_text(tile)));
    std::vector<unsigned char> buffer(bytes);
    for (std::int64_t row = 0; row < rows_; row += tile[0])
      for (std::int64_t column = 0; column < columns_; column += tile[1]) {
        if (TIFFReadTile(tiff_.get(), buffer.data(), static_cast<std::uint32_t>(column),
                         static_cast<std::uint32_t>(row), 0, 0) < 0)
          fail(fmt::format("is truncated or damaged in the tile at row {}, column {}", row, column));
        const std::int64_t n = std::min(tile[1], columns_ - column);
        for (std::int64_t r = 0; r < std::min(tile[0], rows_ - row); ++r)
          convert_row(buffer.data() + r * packed[1], n, out + (row + r) * columns_ + column);
      }
  }

  std::string path_, file_, message_;
  std::uint64_t limit_ = 0;
  std::uintmax_t file_bytes_ = 0;
  std::unique_ptr<TIFF, Close> tiff_;
  std::uint16_t bits_ = 0, format_ = 0;
  std::int64_t rows_ = 0, columns_ = 0;
  TiffStack stack_;
  std::vector<std::uint64_t> directories_;
  std::size_t current_ = 0;
  std::optional<std::uint64_t> contiguous_;  ///< ImageJ's one directory: where the first image's samples are
  std::ifstream raw_;
  double scale_ = 1, offset_ = 0;  ///< value = offset + scale * stored
};

TiffFile::TiffFile(const std::filesystem::path& path, std::uint64_t max_memory_bytes)
    : reader_(std::make_unique<Reader>(path, max_memory_bytes)) {}
TiffFile::~TiffFile() = default;
TiffFile::TiffFile(TiffFile&&) noexcept = default;
const TiffStack& TiffFile::stack() const { return reader_->stack(); }
void TiffFile::read(std::int64_t image, double* out) { reader_->read(image, out); }

TiffSeries::TiffSeries(std::vector<std::filesystem::path> files, std::uint64_t max_memory_bytes)
    : files_(std::move(files)), limit_(max_memory_bytes) {
  for (const auto& file : files_) {
    const TiffFile one(file, limit_);
    const TiffStack& s = one.stack();
    const bool is_first = first_.empty();
    if (is_first) stack_ = s;
    if (s.rows != stack_.rows || s.columns != stack_.columns)
      throw FileError(fmt::format("{}: has {} rows x {} columns, but {} has {} x {}", file.string(), s.rows,
                                  s.columns, files_.front().filename().string(), stack_.rows,
                                  stack_.columns));
    first_.push_back(is_first ? 0 : stack_.images);
    if (is_first) continue;
    stack_.images += s.images;
    stack_.is_integer = stack_.is_integer && s.is_integer;
  }
  first_.push_back(stack_.images);
}

std::size_t TiffSeries::file_of(std::int64_t image) const {
  return static_cast<std::size_t>(std::upper_bound(first_.begin(), first_.end(), image) - first_.begin()) - 1;
}

std::string TiffSeries::name(std::int64_t image) const {
  const std::size_t file = file_of(image);
  const std::string path = files_[file].string();
  if (first_[file + 1] - first_[file] == 1) return path;
  return fmt::format("{}, image {}", path, image - first_[file]);
}

void TiffSeries::read(std::int64_t image, double* out) {
  const std::size_t file = file_of(image);
  if (!open_ || open_file_ != file) {
    open_ = std::make_unique<TiffFile>(files_[file], limit_);
    open_file_ = file;
    const TiffStack& s = open_->stack();
    if (s.rows != stack_.rows || s.columns != stack_.columns || s.images != first_[file + 1] - first_[file])
      throw FileError(files_[file].string() + ": was changed while it was read");
  }
  open_->read(image - first_[file], out);
}

}  // namespace vdvr::io
