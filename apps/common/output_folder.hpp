// A folder that a command fills file by file, so that what lies in it is whole or not there.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vdvr::cli {

/// A folder output. Made at once; taken away again when nothing came to lie in it.
class OutputFolder {
 public:
  /// `names`: every file that will be written; refused when one exists and not `force`.
  OutputFolder(std::filesystem::path folder, std::vector<std::string> names, bool force);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Removes what an older run left of `names`: none of it belongs to the new certificate. Call it before the
  /// first file.
  void begin();
  [[nodiscard]] std::filesystem::path file(const std::string& name) const { return folder_ / name; }
  /// Writes certificate.json, the sign that the folder is complete. Call it last.
  void finish(const std::string& certificate_json);

 private:
  std::filesystem::path folder_;
  std::vector<std::string> names_;
  bool made_ = false;
};

}  // namespace vdvr::cli
