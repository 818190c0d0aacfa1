// SHA-256, incremental, by OpenSSL.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include "vdvr/api.hpp"

namespace vdvr {

class VDVR_API Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;
  void update(const void* data, std::size_t bytes);
  /// 64 lower-case hexadecimal digits; the object is spent afterwards.
  std::string hex();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Throws FileError when the file cannot be read.
VDVR_API std::string sha256_of_file(const std::filesystem::path& path);
VDVR_API std::string sha256_of_text(const std::string& text);

}  // namespace vdvr
