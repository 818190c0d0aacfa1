// The HDF5 C API behind handles that close themselves and errors that are exceptions: FileError on reading,
// ResourceError on writing, each with file and object path. HDF5's own messages are silenced and quoted in
// ours. External links, external storage and virtual datasets are refused: a scan is one file, and its hash
// covers all of it. Called by hdf5_scan.cpp, read_scan.cpp, volume_stack.cpp and the tests. Not thread-safe,
// as HDF5 itself.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace vdvr::io {

/// Owns an hid_t.
class Hdf5Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Hdf5Handle() = default;
  Hdf5Handle(hid_t id, Close closer) : id_(id), close_(closer) {}
  Hdf5Handle(Hdf5Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;
  ~Hdf5Handle() { close(); }

  [[nodiscard]] hid_t id() const { return id_; }
  [[nodiscard]] bool valid() const { return id_ >= 0; }
  herr_t close() { return id_ >= 0 ? close_(std::exchange(id_, -1)) : 0; }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

/// A numeric dataset open for reading.
class Hdf5Dataset {
 public:
  [[nodiscard]] const std::vector<std::int64_t>& shape() const { return shape_; }
  [[nodiscard]] bool is_integer() const { return is_integer_; }
  /// "file: /path", for messages.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// A block, converted to double, C order. `start` and `count` have one entry per axis.
  void read(std::span<const std::int64_t> start, std::span<const std::int64_t> count, double* out) const;
  [[nodiscard]] std::vector<double> read_all() const;

 private:
  friend class Hdf5File;
  Hdf5Handle handle_;
  std::vector<std::int64_t> shape_;
  bool is_integer_ = false;
  std::string name_;
};

class Hdf5File {
 public:
  /// Read-only. Throws FileError when missing, truncated or not HDF5.
  static Hdf5File open(const std::filesystem::path& path);
  /// A new file in place of what is there, in the layouts of HDF5 1.10: all metadata carry checksums.
  static Hdf5File create(const std::filesystem::path& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] bool is_group(const std::string& object) const;
  [[nodiscard]] bool is_dataset(const std::string& object) const;
  /// Names of a group's members, sorted.
  [[nodiscard]] std::vector<std::string> children(const std::string& group) const;
  /// Throws FileError when missing, not numeric, without stored data, or stored outside this file.
  [[nodiscard]] Hdf5Dataset dataset(const std::string& object) const;
  /// A scalar text dataset; nothing when it is absent or not text.
  [[nodiscard]] std::optional<std::string> text(const std::string& object) const;
  /// An attribute's strings (one for a scalar); nothing when it is absent or not text.
  [[nodiscard]] std::optional<std::vector<std::string>> text_attribute(const std::string& object,
                                                                       const std::string& name) const;
  /// A scalar numeric attribute. Throws FileError when it is there and not one number.
  [[nodiscard]] std::optional<double> number_attribute(const std::string& object,
                                                       const std::string& name) const;
  /// A numeric attribute of `count` numbers. Throws FileError when it is there and not that.
  [[nodiscard]] std::optional<std::vector<double>> numbers_attribute(const std::string& object,
                                                                     const std::string& name,
                                                                     std::size_t count) const;

  void create_group(const std::string& group);
  /// Chunked by `chunk`, with the Fletcher32 checksum.
  void write(const std::string& object, std::span<const std::int64_t> shape,
             std::span<const std::int64_t> chunk, const float* values);
  /// One chunk, with the Fletcher32 checksum.
  void write(const std::string& object, std::span<const double> values);
  void write_attribute(const std::string& object, const std::string& name, const std::string& text);
  void write_attribute(const std::string& object, const std::string& name, double value);
  /// Flushes and closes; throws ResourceError when that fails. The destructor closes silently.
  void close();

 private:
  [[nodiscard]] std::string named(const std::string& object) const { return path_ + ": " + object; }
  [[nodiscard]] Hdf5Handle open_object(const std::string& object) const;
  Hdf5Handle file_, links_;  // links_: access list that refuses external links
  std::string path_;
};

}  // namespace vdvr::io
