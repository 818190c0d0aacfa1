// A journal beside an output: what long work has finished so far, record by record, so that after a crash the
// same work can go on where it stopped (docs/file-format.md, journal). Written by build; opened and removed
// by whoever writes the output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"

namespace vdvr {

/// What the work depends on: name and value. A journal is resumed only by work with an equal head.
using JournalHead = std::map<std::string, std::string>;

class VDVR_API Journal {
 public:
  /// Opens and locks the file, or makes an empty one. Nothing in it is changed before begin().
  /// `resume`: its records are to be used; else they are replaced. Throws InputError when another process
  /// holds it or the file is no journal, FileError when it cannot be opened.
  Journal(std::filesystem::path path, bool resume);
  /// Leaves the file for a later resume, unless no record is in it.
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Whether the file names an unfinished work: its head is whole.
  [[nodiscard]] bool found() const { return head_.has_value(); }
  [[nodiscard]] bool resumes() const { return resume_ && found(); }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Call it once, before next(). Throws InputError naming every entry that differs when the journal is to be
  /// resumed but belongs to other work.
  void begin(const JournalHead& head);
  /// The next record of the earlier work, in the order they were appended; none: the rest is still to be
  /// done. A torn or altered record ends the journal: it and what follows is cut off.
  std::optional<std::vector<std::byte>> next();
  /// The record that next() gave as the `number`th, from 0 on, once more. Throws FileError where it cannot be
  /// read.
  [[nodiscard]] std::vector<std::byte> at(std::size_t number) const;
  /// Adds a record, after next() gave none. Survives the end of the process at once, of the machine after at
  /// most a second or so. Throws ResourceError naming the file when the disk is full; what was whole stays.
  void append(const std::vector<std::byte>& record);
  /// The work is done and its output in place.
  void remove();

  /// Records that next() gave, and those in the file.
  [[nodiscard]] std::int64_t replayed() const { return replayed_; }
  [[nodiscard]] std::int64_t records() const { return records_; }

 private:
  void lock();
  std::optional<std::vector<std::byte>> read_record();
  void write_record(const std::vector<std::byte>& record);
  void sync();

  std::filesystem::path path_;
  bool resume_ = false, reading_ = false, begun_ = false;
  int file_ = -1;
  std::optional<JournalHead> head_;
  std::uint64_t end_ = 0;    // of the last whole record read or written
  std::uint32_t chain_ = 0;  // its checksum, on which the next one builds
  std::int64_t replayed_ = 0, records_ = 0;
  std::vector<std::uint64_t> starts_;  // of the records that next() gave
  std::int64_t synced_at_ns_ = 0;
};

}  // namespace vdvr
