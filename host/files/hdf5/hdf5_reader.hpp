// Reads HDF5 files and refuses: every failure is a FileError naming file and object. What links may lead to
// (hdf5_links.hpp) is one policy for a whole Reader. A dataset comes in one of two ways: checksummed, as our
// writer makes them, checked down to its stored bytes; or numeric, as others make them, read and converted by
// HDF5. Either is handed out only after its declaration has been checked, so that callers can size memory by
// it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/files/hdf5/hdf5_links.hpp"

namespace vdvr::io::hdf5 {

class Reader {
 public:
  /// `root`: the scan's folder, for names in its hash and for Links::within_folder; empty: the file's own.
  Reader(const std::filesystem::path& path, Links links, const std::filesystem::path& root = {});

  [[nodiscard]] bool has(const std::string& path) const { return static_cast<bool>(find(path)); }
  [[nodiscard]] bool is_group(const std::string& path) const;
  /// Throws where a link on the path leads out of the file and cannot be followed.
  [[nodiscard]] bool is_dataset(const std::string& path) const;
  void require_group(const std::string& path) const;
  /// Link names in a group, sorted.
  [[nodiscard]] std::vector<std::string> members(const std::string& group) const;

  // --- attributes that must be there ---
  [[nodiscard]] bool has_attribute(const std::string& object, const std::string& name) const;
  [[nodiscard]] std::int64_t integer(const std::string& object, const std::string& name) const;
  [[nodiscard]] std::vector<std::int64_t> integers(const std::string& object, const std::string& name,
                                                   std::uint64_t count) const;
  [[nodiscard]] std::vector<double> reals(const std::string& object, const std::string& name,
                                          std::uint64_t count) const;
  [[nodiscard]] std::string text_attribute(const std::string& object, const std::string& name) const;
  /// Every attribute of an object, by name; one that is no number and no text is refused.
  [[nodiscard]] std::vector<Attribute> attributes(const std::string& object) const;

  // --- attributes that may be there ---
  /// Its texts, one for a scalar; none when it is absent or not text.
  [[nodiscard]] std::vector<std::string> find_texts(const std::string& object, const std::string& name) const;
  /// The first of them.
  [[nodiscard]] std::optional<std::string> find_text(const std::string& object,
                                                     const std::string& name) const;
  /// The attribute NX_class, for a search: does not make the file one of those whose content was used.
  [[nodiscard]] std::optional<std::string> nexus_class(const std::string& object) const;
  /// Refused when it is there and not `count` numbers.
  [[nodiscard]] std::optional<std::vector<double>> find_reals(const std::string& object,
                                                              const std::string& name,
                                                              std::uint64_t count) const;
  [[nodiscard]] std::optional<double> find_real(const std::string& object, const std::string& name) const;

  // --- datasets ---
  /// A checksummed one: chunked, of a known packing, as many chunks as its shape needs, shape without a zero.
  /// A chunk's content is checked when it is read.
  [[nodiscard]] Dataset dataset(const std::string& path) const;
  /// All of such a one, each chunk against its checksum, into dataset.bytes bytes.
  void read(const Dataset& dataset, void* values) const;
  /// Any with numbers, where links may lead to them; Dataset::read converts them. Not with Links::hard.
  [[nodiscard]] Dataset numeric_dataset(const std::string& path) const;
  /// One boolean, as h5py writes it (an enumeration) or as a whole number.
  [[nodiscard]] bool flag(const std::string& path) const;
  /// A string dataset, fixed or variable length, scalar or of one element, of at most `max_bytes`.
  [[nodiscard]] std::string text(const std::string& path, std::uint64_t max_bytes) const;

  // --- files that links led to; not with Links::hard ---
  /// The file itself, and each whose datasets or attributes were handed out.
  [[nodiscard]] const UsedFiles& used() const { return files_->used(); }
  /// Why the first link out of a file that was met could not be followed; empty when all could.
  [[nodiscard]] const std::string& broken_link() const { return broken_link_; }

  /// Throws FileError: "path: object: what".
  [[noreturn]] void refuse(const std::string& object, const std::string& what) const;
  [[nodiscard]] const std::string& path() const { return shown_; }
  [[nodiscard]] std::uint64_t file_bytes() const { return file_bytes_; }

 private:
  [[nodiscard]] bool hard_linked(const std::string& path) const;
  /// What the policy lets be reached; its object is invalid where nothing is.
  [[nodiscard]] Place locate(const std::string& path) const;
  [[nodiscard]] Handle find(const std::string& path) const { return locate(path).object; }
  /// The same, refused where nothing is; its files are used from then on.
  [[nodiscard]] Place require(const std::string& path) const;
  [[nodiscard]] Handle open_object(const std::string& path) const { return require(path).object; }
  [[nodiscard]] Dataset declared(const std::string& path) const;
  [[nodiscard]] std::vector<std::string> texts_at(const Place& place, const std::string& object,
                                                  const std::string& name) const;

  Silence silence_;
  std::string shown_;
  Links links_;
  std::uint64_t file_bytes_ = 0;
  Handle file_;                               // of Links::hard
  std::shared_ptr<const LinkedFiles> files_;  // of the others
  mutable std::string broken_link_;
};

}  // namespace vdvr::io::hdf5
