// The base of the HDF5 layer: handles that close themselves, HDF5's messages silenced and quoted, attributes
// and datasets as their headers declare them. hdf5_reader.hpp opens and reads, hdf5_writer.hpp writes,
// hdf5_chunks.hpp and hdf5_filters.hpp judge what is stored, hdf5_links.hpp and hdf5_virtual.hpp find it in
// other files.
//
// The HDF5 library is not thread-safe: one thread at a time.
#pragma once

// The functions and structures that HDF5 1.10 has; later releases keep them under this name.
#define H5_USE_110_API
#include <hdf5.h>

#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace vdvr::io::hdf5 {

/// An HDF5 identifier, closed by the function it was opened for.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle() = default;
  Handle(hid_t id, Close closer) : id_(id), close_(closer) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() { close(); }
  [[nodiscard]] hid_t id() const { return id_; }
  explicit operator bool() const { return id_ >= 0; }
  /// False when HDF5 reports that closing (hence flushing) failed.
  bool close() { return id_ < 0 || close_(std::exchange(id_, H5I_INVALID_HID)) >= 0; }

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

/// Keeps HDF5 from printing its error stack while alive; the library never prints. The setting is global to
/// the process and belongs to the host program.
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

/// The innermost message of HDF5's error stack ("Data error detected by Fletcher32 checksum"), which says
/// what happened; the outer ones repeat the chain of calls.
std::string reason();

static_assert(std::endian::native == std::endian::little, "elements are stored little-endian");

/// HDF5's type of a T: the same in memory and in files of ours.
template <class T>
hid_t element_type() {
  if constexpr (std::is_same_v<T, float>) return H5T_IEEE_F32LE;
  else if constexpr (std::is_same_v<T, double>) return H5T_IEEE_F64LE;
  else if constexpr (std::is_same_v<T, std::uint8_t>) return H5T_STD_U8LE;
  else if constexpr (std::is_same_v<T, std::uint16_t>) return H5T_STD_U16LE;
  else if constexpr (std::is_same_v<T, std::uint32_t>) return H5T_STD_U32LE;
  else if constexpr (std::is_same_v<T, std::int32_t>) return H5T_STD_I32LE;
  else {
    static_assert(std::is_same_v<T, std::int64_t>);
    return H5T_STD_I64LE;
  }
}

/// One UTF-8 text of that many bytes, or of H5T_VARIABLE.
Handle text_type(std::size_t length);

/// An attribute as what it says, however it is stored: integers as int64, reals as float64, one text.
struct Attribute {
  std::string object, name;
  char kind = 'i';          ///< 'i', 'f' or 't'
  std::uint64_t count = 0;  ///< numbers, or bytes of text
  std::string bytes;        ///< little-endian
};

template <class T>
Attribute attribute_of(const std::string& object, const std::string& name, std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  return {object, name, std::is_integral_v<T> ? 'i' : 'f', values.size(),
          std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())};
}

using Shape = std::vector<std::uint64_t>;   ///< slowest axis first
using Filters = std::vector<H5Z_filter_t>;  ///< in the order in which they were applied

/// Types whose bytes in the file are those in memory, so that chunks are read without HDF5's conversion.
enum class Element { f32, u8, u16, u32, i32, other };

/// What was done to a chunk before its Fletcher32 checksum was taken; shuffle goes before deflate.
struct Packing {
  bool deflated = false, shuffled = false;
};

/// Where the numbers of a virtual dataset lie.
class VirtualLayout {
 public:
  virtual ~VirtualLayout() = default;
  /// The elements that `wanted` selects of the virtual dataset, as doubles to where `memory` puts them. What
  /// is wrong, or nothing.
  virtual std::optional<std::string> read(hid_t wanted, hid_t memory, double* out) const = 0;
};

/// A dataset as its header declares it. Its numbers can be read as long as it lives, without its Reader.
struct Dataset {
  Handle id;
  std::string name;  ///< "file: /path", for messages
  H5T_class_t kind = H5T_NO_CLASS;
  Element element = Element::other;
  std::uint64_t element_bytes = 0;
  Shape shape, largest;     ///< now, and what it may grow to
  std::uint64_t count = 0;  ///< elements: product of shape, 1 of a scalar
  std::uint64_t bytes = 0;  ///< in memory
  H5D_layout_t layout = H5D_LAYOUT_ERROR;
  bool outside = false;  ///< the numbers lie in other files, or in other datasets
  std::shared_ptr<const VirtualLayout> virtual_layout;  ///< of a virtual one that may be read
  std::uint64_t missing_chunks = 0;                     ///< never written: HDF5 gives fill values there
  bool may_be_sparse = false;  ///< and these are what is wanted; else reading one is refused
  Shape chunk;                 ///< empty unless chunked
  Filters filters;
  // Of a checksummed one, filled in by check_storage:
  Packing packing;
  std::uint64_t chunk_bytes = 0, stored_bytes = 0;  ///< of one chunk in memory; of all in the file
  std::uint64_t chunk_memory = 0;                   ///< that reading takes beside `bytes`

  [[nodiscard]] bool is_integer() const { return kind == H5T_INTEGER; }
  [[nodiscard]] bool is_number() const { return is_integer() || kind == H5T_FLOAT; }
  /// The shape as the rest of the library counts; what exceeds 63 bits is negative, which checked_bytes
  /// refuses.
  [[nodiscard]] std::vector<std::int64_t> extents() const { return {shape.begin(), shape.end()}; }
  /// A block, converted to double, C order. `start` and `count` have one entry per axis.
  void read(std::span<const std::int64_t> start, std::span<const std::int64_t> block_count,
            double* out) const;
  [[nodiscard]] std::vector<double> read_all() const;
  /// The elements that `wanted` selects of its space, as doubles to where `memory` puts them. What is wrong,
  /// or nothing.
  std::optional<std::string> read_selected(hid_t wanted, hid_t memory, double* out) const;
};

/// "a 4-byte float"
std::string type_name(H5T_class_t type, std::size_t bytes);

/// A dataset as its header declares it; `object` is its handle, `name` its name in messages. Throws FileError
/// where it is none, and before HDF5 opens any source of a virtual dataset that has no fixed shape.
Dataset declare(Handle object, std::string name);

}  // namespace vdvr::io::hdf5
