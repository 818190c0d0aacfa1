// Which file and which object a path of an HDF5 file leads to. Links are followed here, step by step, and not
// by the HDF5 library, which looks for a linked file in folders that the environment names: what is read is
// what is hashed.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host/files/hdf5/hdf5.hpp"

namespace vdvr::io::hdf5 {

/// How an object may be reached.
enum class Links {
  hard,           ///< a soft or external link on the path is refused, and so is what cannot be opened
  within_folder,  ///< soft links too, and external links and virtual datasets to files of the scan's folder
  anywhere        ///< to any file
};

/// An open file of a scan, closed when nobody holds it.
struct LinkedFile {
  Handle id;
  std::filesystem::path path;  ///< as it was reached
  std::string name;            ///< in the scan's hash
};
using FilePointer = std::shared_ptr<const LinkedFile>;

/// Where a path led. Neither object nor problem: nothing bears that name.
struct Place {
  Handle object;
  FilePointer file;                                                    ///< that holds the object
  std::string path;                                                    ///< within it
  std::vector<std::pair<std::string, std::filesystem::path>> through;  ///< name and path of each file passed
  std::string problem;  ///< of a link out of a file, or of an object that is there and does not open
};

/// Name in the hash, path: every file of a scan whose content was used.
using UsedFiles = std::vector<std::pair<std::string, std::filesystem::path>>;

class LinkedFiles {
 public:
  /// Names in the hash are relative to `root`, the scan's folder; empty: that of `first`. Throws FileError
  /// when `first` cannot be opened.
  LinkedFiles(const std::filesystem::path& first, const std::filesystem::path& root, Links links);

  [[nodiscard]] const FilePointer& first() const { return first_; }
  /// The object at `path` of `from`.
  [[nodiscard]] Place follow(const FilePointer& from, const std::string& path) const;
  /// The same in the file that `from` calls `name`; "." is `from` itself.
  [[nodiscard]] Place follow(const FilePointer& from, const std::string& name, const std::string& path) const;

  /// Notes that something in these files was used.
  void use(const Place& place) const;
  [[nodiscard]] const UsedFiles& used() const { return used_; }

 private:
  struct Target {
    std::filesystem::path path, real;
    std::string problem;
  };
  [[nodiscard]] Target target_of(const LinkedFile& from, const std::string& name) const;
  [[nodiscard]] std::string name_of(const Target& target, const std::string& stated) const;
  /// Null, and `problem` says why.
  [[nodiscard]] FilePointer open(const LinkedFile& from, const std::string& name, std::string& problem) const;
  void walk(Place& place, const std::string& path) const;

  std::filesystem::path root_, real_root_;
  Links links_;
  FilePointer first_;
  mutable std::map<std::filesystem::path, std::weak_ptr<const LinkedFile>> open_;  ///< by real path
  mutable UsedFiles used_;
};

/// For reading. A folder whose file system has no locks is no reason to refuse. Invalid where the file cannot
/// be opened: `why` then says so, and what to do about locks and files left open by their writer.
Handle open_to_read(const std::filesystem::path& path, bool strong, std::string& why);

}  // namespace vdvr::io::hdf5
