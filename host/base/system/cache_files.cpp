#include "host/base/system/cache_files.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string_view>
#include <system_error>
#include <tuple>
#include <vector>

#include "vdvr/expert/hash.hpp"

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

namespace {
constexpr std::size_t seal_size = 65;
}  // namespace

std::string sealed(const std::string& text) { return text + sha256_of_text(text) + '\n'; }

std::optional<std::string> unsealed(const std::string& text) {
  if (text.size() < seal_size) return std::nullopt;
  std::string inside = text.substr(0, text.size() - seal_size);
  if (sealed(inside) != text) return std::nullopt;
  return inside;
}

void forget_oldest(const std::string& folder, std::uintmax_t bytes) noexcept {
  try {
    const fs::path all = cache_folder();
    if (all.empty()) return;
    std::vector<std::tuple<fs::file_time_type, std::uintmax_t, fs::path>> files;
    std::uintmax_t size = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(all / folder)) {
      if (!entry.is_regular_file()) continue;
      files.emplace_back(entry.last_write_time(), entry.file_size(), entry.path());
      size += entry.file_size();
    }
    std::sort(files.begin(), files.end());
    for (const auto& [time, own, path] : files) {
      if (size <= bytes) return;
      std::error_code error;
      fs::remove(path, error);
      size -= own;
    }
  } catch (...) {  // another process removes them too, or there is no memory
  }
}

bool behind_a_layer() {
  for (const char* variable : {"LD_PRELOAD", "LD_AUDIT", "OPENCL_LAYERS"})
    if (const char* value = std::getenv(variable); value != nullptr && *value != '\0') return true;
  return false;
}

}  // namespace vdvr
