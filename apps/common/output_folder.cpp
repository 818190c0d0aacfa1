#include "apps/common/output_folder.hpp"

#include <fmt/format.h>

#include <system_error>

#include "vdvr/error.hpp"
#include "vdvr/expert/output_file.hpp"

namespace fs = std::filesystem;

namespace vdvr::cli {

OutputFolder::OutputFolder(fs::path folder, std::vector<std::string> names, bool force)
    : folder_(std::move(folder)), names_(std::move(names)) {
  std::error_code error;
  if (fs::exists(folder_, error) && !fs::is_directory(folder_, error))
    throw InputError(fmt::format("{}: is a file, not a folder", folder_.string()));
  for (const auto& name : names_)
    if (fs::exists(folder_ / name, error) && !force)
      throw InputError(fmt::format("{}: exists already; --force overwrites it", (folder_ / name).string()));
  made_ = fs::create_directories(folder_, error);
  if (error) throw InputError(fmt::format("{}: cannot be created: {}", folder_.string(), error.message()));
  if (made_) io::note_temporary(folder_);
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (made_) fs::remove(folder_, ignored);  // fails, as it should, unless empty
  io::forget_temporary(folder_);
}

void OutputFolder::begin() {
  std::error_code ignored;
  for (const auto& name : names_) fs::remove(folder_ / name, ignored);
}

void OutputFolder::finish(const std::string& certificate) {
  io::write_file(folder_ / "certificate.json", certificate + "\n");
}

}  // namespace vdvr::cli
