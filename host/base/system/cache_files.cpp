#include "host/base/system/cache_files.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string_view>
#include <system_error>

namespace vdvr {
namespace {

namespace fs = std::filesystem;

fs::path absolute_from(const char* variable) {
  const char* text = std::getenv(variable);
  const fs::path path = text == nullptr ? "" : text;
  return path.is_absolute() ? path : fs::path();  // as the XDG specification says
}

// A name of this process alone beside `path`.
fs::path unfinished(const fs::path& path) {
  static std::atomic<unsigned> count{0};
  return path.string() + fmt::format(".{}-{}.part", ::getpid(), ++count);
}

}  // namespace

fs::path cache_folder() {
  const char* wanted = std::getenv("VDVR_CACHE");
  if (wanted != nullptr && std::string_view(wanted) == "off") return {};
  if (const fs::path xdg = absolute_from("XDG_CACHE_HOME"); !xdg.empty()) return xdg / "vdvr";
  const fs::path home = absolute_from("HOME");
  return home.empty() ? fs::path() : home / ".cache" / "vdvr";
}

std::optional<std::string> read_cached(const std::string& name) {
  const fs::path folder = cache_folder();
  if (folder.empty()) return std::nullopt;
  std::ifstream file(folder / name, std::ios::binary);
  if (!file) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  if (!file || !text) return std::nullopt;
  return std::move(text).str();
}

void write_cached(const std::string& name, const std::string& bytes) noexcept {
  try {
    const fs::path folder = cache_folder();
    if (folder.empty()) return;
    const fs::path path = folder / name, part = unfinished(path);
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    if (error) return;
    std::ofstream file(part, std::ios::binary);
    file << bytes;
    file.close();
    if (file) fs::rename(part, path, error);
    if (!file || error) fs::remove(part, error);
  } catch (...) {  // no memory for a name: nothing is remembered
  }
}

}  // namespace vdvr
