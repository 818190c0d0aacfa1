// Writes HDF5 files in which every stored number is under a checksum: datasets are chunked, deflated if asked
// for, with the Fletcher32 filter last; object headers, chunk indexes and superblock carry HDF5's own
// checksums (format of HDF5 1.10).
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "host/files/hdf5/hdf5.hpp"

namespace vdvr::io::hdf5 {

/// Chunk of about 512 KiB whose elements are contiguous in the C order of `shape`, split evenly so that
/// little is padded.
Shape chunk_shape(const Shape& shape, std::uint64_t element_bytes);

enum class Headers {
  reproducible,  ///< no time stamps: equal contents give equal bytes
  dated          ///< as HDF5 writes them by itself: scans have always had them so
};

struct Form {
  unsigned deflate_level = 0;  ///< 1 to 9, 0: not compressed; text never is
  Headers headers = Headers::reproducible;
};

/// Writes a new file in place of what is there; `shown` is the path that messages name. Failures throw
/// ResourceError (disk).
class Writer {
 public:
  Writer(const std::filesystem::path& file, const std::filesystem::path& shown, const Form& form);

  void group(const std::string& path);
  void attribute(const std::string& object, const std::string& name, std::int64_t value);
  void attribute(const std::string& object, const std::string& name, double value);
  void attribute(const std::string& object, const std::string& name, std::span<const std::int64_t> values);
  void attribute(const std::string& object, const std::string& name, std::span<const double> values);
  void attribute(const std::string& object, const std::string& name, const std::string& text);
  /// In chunks of chunk_shape, or of `chunk` where one is given.
  template <class T>
  void dataset(const std::string& path, const Shape& shape, std::span<const T> values,
               const Shape& chunk = {}) {
    create_dataset(path, shape, chunk.empty() ? chunk_shape(shape, sizeof(T)) : chunk, element_type<T>(),
                   form_.deflate_level, values.data());
  }
  /// A dataset whose chunks come one by one, through the filters shuffle (elements of more than one byte) and
  /// deflate already where `deflate_level` is above 0. Under no Fletcher32: deflate has a checksum of its
  /// own.
  Handle chunked_dataset(const std::string& path, const Shape& shape, const Shape& chunk, hid_t type,
                         unsigned deflate_level);
  /// One of its chunks, whole, with its first element at `place`.
  void chunk(const Handle& dataset, const Shape& place, std::span<const std::byte> bytes);
  /// A scalar string kept in its object header, where HDF5's checksum covers it; longer than 60,000 bytes,
  /// where a header cannot hold it, a string dataset of one element under Fletcher32.
  void text(const std::string& path, const std::string& text);
  /// All that were written so far.
  [[nodiscard]] const std::vector<Attribute>& attributes() const { return attributes_; }
  /// Flushes and closes. Throws ResourceError.
  void close();

 private:
  [[nodiscard]] Handle properties(hid_t of) const;
  void create_dataset(const std::string& path, const Shape& shape, const Shape& chunk, hid_t type,
                      unsigned deflate_level, const void* values);
  void write_dataset(const std::string& path, hid_t type, const Handle& space, const Handle& creation,
                     const void* values);
  void create_attribute(Attribute attribute, hid_t type, const Handle& space);
  [[noreturn]] void fail(const std::string& what) const;

  Silence silence_;
  std::string shown_;
  Form form_;
  Handle file_;
  std::vector<Attribute> attributes_;
};

}  // namespace vdvr::io::hdf5
