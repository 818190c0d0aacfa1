// HDF5 files in which every stored number is under a checksum: move-only handles, a writer and a strict
// reader. Datasets are chunked, deflated if asked for, with the Fletcher32 filter last; object headers, chunk
// indexes and superblock carry HDF5's own checksums (format of HDF5 1.10). The reader hands out a dataset
// only after its type, shape, filters and stored bytes have been checked, so that callers can size memory by
// it. Called by vdvr_file.cpp.
//
// The HDF5 library is not thread-safe: one thread at a time.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace vdvr::io::hdf5_file {

/// An HDF5 identifier, closed by the function it was opened for.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle() = default;
  Handle(hid_t id, Close close) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept;
  Handle& operator=(Handle&& other) noexcept;
  ~Handle() { reset(); }
  [[nodiscard]] hid_t get() const { return id_; }
  explicit operator bool() const { return id_ >= 0; }
  /// False when HDF5 reports that closing (hence flushing) failed.
  bool reset();

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

/// Keeps HDF5 from printing its error stack while alive; the library never prints.
class Silence {
 public:
  Silence();
  ~Silence();
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

using Shape = std::vector<std::uint64_t>;  ///< slowest axis first

/// Chunk of about 512 KiB whose elements are contiguous in the C order of `shape`, split evenly so that
/// little is padded.
Shape chunk_shape(const Shape& shape, std::uint64_t element_bytes);

/// An attribute as what it says, however it is stored: integers as int64, reals as float64, one text.
struct Attribute {
  std::string object, name;
  char kind = 'i';          ///< 'i', 'f' or 't'
  std::uint64_t count = 0;  ///< numbers, or bytes of text
  std::string bytes;        ///< little-endian
};

/// Writes a new file; `shown` is the path that messages name. `deflate_level` 1 to 9, 0: not compressed; text
/// never is. Failures throw ResourceError (disk).
class Writer {
 public:
  Writer(const std::filesystem::path& file, const std::filesystem::path& shown, unsigned deflate_level);

  void group(const std::string& path);
  void attribute(const std::string& object, const std::string& name, std::int64_t value);
  void attribute(const std::string& object, const std::string& name, double value);
  void attribute(const std::string& object, const std::string& name, std::span<const std::int64_t> values);
  void attribute(const std::string& object, const std::string& name, std::span<const double> values);
  void attribute(const std::string& object, const std::string& name, const std::string& text);
  void dataset(const std::string& path, const Shape& shape, std::span<const float> values);
  void dataset(const std::string& path, const Shape& shape, std::span<const std::uint8_t> values);
  void dataset(const std::string& path, const Shape& shape, std::span<const std::uint16_t> values);
  void dataset(const std::string& path, const Shape& shape, std::span<const std::int32_t> values);
  void dataset(const std::string& path, const Shape& shape, std::span<const std::uint32_t> values);
  /// A scalar string kept in its object header, where HDF5's checksum covers it; longer than 60,000 bytes,
  /// where a header cannot hold it, a string dataset of one element under Fletcher32.
  void text(const std::string& path, const std::string& text);
  /// All that were written so far.
  [[nodiscard]] const std::vector<Attribute>& attributes() const { return attributes_; }
  /// Flushes and closes. Throws ResourceError.
  void close();

 private:
  void create_dataset(const std::string& path, const Shape& shape, hid_t stored, hid_t given,
                      std::uint64_t element_bytes, unsigned deflate_level, const void* values);
  void create_attribute(const std::string& object, const std::string& name, hid_t type, hid_t space,
                        hid_t given, const void* values);
  [[noreturn]] void fail(const std::string& what) const;

  Silence silence_;
  std::string shown_;
  unsigned deflate_level_ = 0;
  Handle file_;
  std::vector<Attribute> attributes_;
};

enum class Element { f32, u8, u16, u32, i32, other };

/// What was done to a chunk before its Fletcher32 checksum was taken; shuffle goes before deflate.
struct Packing {
  bool deflated = false, shuffled = false;
};

/// A dataset whose declaration was checked: chunked, of a known packing, as many chunks as its shape needs,
/// shape without a zero. A chunk's content is checked when it is read.
struct Dataset {
  Handle id;
  std::string path;
  Element element = Element::other;
  Shape shape;
  std::uint64_t count = 0;         ///< elements, product of shape
  std::uint64_t bytes = 0;         ///< in memory
  std::uint64_t stored_bytes = 0;  ///< in the file
  Packing packing;
  Shape chunk;
  std::uint64_t chunk_bytes = 0, element_bytes = 0;
  std::uint64_t chunk_memory = 0;  ///< that reading takes beside `bytes`
};

/// Reads and refuses: every failure is a FileError naming file and object.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& path);

  /// True when `path` exists as a hard link; throws for a soft or external one.
  [[nodiscard]] bool has(const std::string& path) const;
  /// Throws unless `path` is a group, reached by hard links.
  void require_group(const std::string& path) const;
  /// Link names in a group, sorted.
  [[nodiscard]] std::vector<std::string> members(const std::string& group) const;
  [[nodiscard]] bool has_attribute(const std::string& object, const std::string& name) const;
  [[nodiscard]] std::int64_t integer(const std::string& object, const std::string& name) const;
  [[nodiscard]] std::vector<std::int64_t> integers(const std::string& object, const std::string& name,
                                                   std::uint64_t count) const;
  [[nodiscard]] std::vector<double> reals(const std::string& object, const std::string& name,
                                          std::uint64_t count) const;
  [[nodiscard]] std::string text_attribute(const std::string& object, const std::string& name) const;
  /// Every attribute of an object, by name; one that is no number and no text is refused.
  [[nodiscard]] std::vector<Attribute> attributes(const std::string& object) const;
  [[nodiscard]] Dataset dataset(const std::string& path) const;
  /// Into memory of dataset.bytes bytes, native byte order.
  void read(const Dataset& dataset, void* values) const;
  /// A string dataset, fixed or variable length, scalar or of one element, of at most `max_bytes`.
  [[nodiscard]] std::string text(const std::string& path, std::uint64_t max_bytes) const;
  /// Throws FileError: "path: object: what".
  [[noreturn]] void refuse(const std::string& object, const std::string& what) const;
  [[nodiscard]] std::uint64_t file_bytes() const { return file_bytes_; }

 private:
  [[nodiscard]] Handle open_object(const std::string& path) const;
  [[nodiscard]] Handle open_attribute(const std::string& object, const std::string& name, bool number,
                                      std::uint64_t count) const;

  Silence silence_;
  std::string shown_;
  std::uint64_t file_bytes_ = 0;
  Handle file_;
};

}  // namespace vdvr::io::hdf5_file
