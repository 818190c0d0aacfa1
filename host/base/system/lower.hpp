// Small letters, of ASCII alone.
#pragma once

#include <filesystem>
#include <string>

namespace vdvr {

/// With the letters A to Z small.
inline std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}
/// Of a file's name, with its dot: ".tif".
inline std::string lower_extension(const std::filesystem::path& path) {
  return lower(path.extension().string());
}

}  // namespace vdvr
