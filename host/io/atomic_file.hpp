// An output file that appears only whole: written under a temporary name in the same folder, flushed,
// renamed.
#pragma once

#include <filesystem>

#include "vdvr/output_file.hpp"

namespace vdvr::io {

class AtomicFile {
 public:
  /// Throws FileError when the folder does not exist or cannot be written.
  explicit AtomicFile(std::filesystem::path target);
  /// Removes the temporary file unless commit() was called.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Where to write; close it before commit().
  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }
  /// fsync, rename over the target, fsync the folder. Throws ResourceError (disk).
  void commit();

 private:
  std::filesystem::path target_, temporary_;
  bool committed_ = false;
};

/// Removes temporary files that killed writers of `target` left in its folder. Only for whoever knows that no
/// other process writes it now.
void remove_leftovers(const std::filesystem::path& target);

}  // namespace vdvr::io
