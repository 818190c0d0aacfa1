// An output file or folder that appears only whole: written under a temporary name in the same folder,
// flushed, renamed. Nothing appears once a stop was requested (stop.hpp).
#pragma once

#include <filesystem>
#include <list>
#include <string>

#include "vdvr/api.hpp"

namespace vdvr::io {

class VDVR_API AtomicFile {
 public:
  /// Throws FileError when the folder does not exist or cannot be written.
  explicit AtomicFile(std::filesystem::path target);
  /// Removes the temporary file unless commit() was called.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Where to write; close it before commit().
  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }
  /// fsync, rename over the target, fsync the folder. Throws ResourceError (disk), Interrupted.
  void commit();

 private:
  friend class AtomicFiles;
  void put_in_place();
  std::filesystem::path target_, temporary_;
  bool committed_ = false;
};

/// Files that belong together: all of them appear, or none.
class VDVR_API AtomicFiles {
 public:
  /// Where to write what will be `target`, with any writer that takes a path. Throws as AtomicFile.
  [[nodiscard]] const std::filesystem::path& add(const std::filesystem::path& target);
  /// Puts all in place, in the order of add(). Throws as AtomicFile::commit.
  void commit();

 private:
  std::list<AtomicFile> files_;
};

/// The same for a folder, with all that is put into it.
class VDVR_API AtomicFolder {
 public:
  /// Throws FileError when the folder around it does not exist or cannot be written.
  explicit AtomicFolder(std::filesystem::path target);
  /// Removes the temporary folder and what is in it unless commit() was called.
  ~AtomicFolder();
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  /// Where to put files; close them before commit().
  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }
  /// Flushes, and puts it in the place of the target, which is removed with all that is in it: whoever calls
  /// this has looked whether it may be. Throws ResourceError (disk), Interrupted.
  void commit();

 private:
  void put_in_place(const std::filesystem::path& aside);
  std::filesystem::path target_, temporary_;
  bool committed_ = false;
};

/// Removes temporary files that killed writers of `target` left in its folder. Only for whoever knows that no
/// other process writes it now.
VDVR_API void remove_leftovers(const std::filesystem::path& target);

/// For a program that ends without unwinding: what remove_temporaries removes, files, and folders if they are
/// empty. Every AtomicFile notes its temporary file, and every AtomicFolder its temporary folder, which goes
/// with all that is in it.
VDVR_API void note_temporary(const std::filesystem::path& path);
VDVR_API void forget_temporary(const std::filesystem::path& path);
VDVR_API void remove_temporaries();

/// Writes bytes atomically.
VDVR_API void write_file(const std::filesystem::path& path, const std::string& bytes);

}  // namespace vdvr::io
