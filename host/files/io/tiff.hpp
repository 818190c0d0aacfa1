// Greyscale TIFF files as arrays of double: one image, a stack of them in a file, or a row of files. Strips
// and tiles; integers of 1 to 16, 32 and 64 bits, packed or not; float16, float32, float64; any compression
// the installed libtiff decodes. libtiff's messages become FileError; nothing is printed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace vdvr::io {

/// What a file says about itself.
struct TiffStack {
  std::int64_t images = 0, rows = 0, columns = 0;
  bool is_integer = false;                              ///< all images
  std::string description;                              ///< ImageDescription of the first image
  double pixels_per_unit_x = 0, pixels_per_unit_y = 0;  ///< 0 where the file does not say
};

/// "key=value" of ImageJ's description, which has one a line; empty where there is none.
std::string imagej_value(const std::string& description, const std::string& key);

/// A file whose images are read in any order; not to be shared between threads. Images that are marked as
/// smaller copies of others do not count. ImageJ's stacks of one directory, which beyond 4 GiB are all that
/// it writes, have their images behind each other.
class TiffFile {
 public:
  /// Reads all directories. Throws FileError: missing, not TIFF, truncated, images that differ in size,
  /// several samples per pixel, several channels, unsupported type; ResourceError where one image as double
  /// exceeds the limit (0: none).
  explicit TiffFile(const std::filesystem::path& path, std::uint64_t max_memory_bytes = 0);
  ~TiffFile();
  TiffFile(TiffFile&&) noexcept;
  [[nodiscard]] const TiffStack& stack() const;
  /// To out[row][column]. Throws FileError naming the image.
  void read(std::int64_t image, double* out);

 private:
  class Reader;
  std::unique_ptr<Reader> reader_;
};

/// Images of several files, one after the other, as a file may have one or many; all of one size. One file is
/// open at a time.
class TiffSeries {
 public:
  /// Opens each file once. Throws as TiffFile, and FileError where one's images have another size than those
  /// of the first.
  explicit TiffSeries(std::vector<std::filesystem::path> files, std::uint64_t max_memory_bytes = 0);
  /// Of all files together; description and resolution are the first file's.
  [[nodiscard]] const TiffStack& stack() const { return stack_; }
  [[nodiscard]] std::size_t file_of(std::int64_t image) const;
  /// The file, and of one with several images which one.
  [[nodiscard]] std::string name(std::int64_t image) const;
  void read(std::int64_t image, double* out);

 private:
  std::vector<std::filesystem::path> files_;
  std::vector<std::int64_t> first_;  ///< by file its first image; then the count of all
  TiffStack stack_;
  std::uint64_t limit_;
  std::unique_ptr<TiffFile> open_;
  std::size_t open_file_ = 0;
};

}  // namespace vdvr::io
