// What the programs for files of geometry share: a stack of 4 views of 3 x 2 pixels, and a scan.json that
// names the file.
#pragma once

#include "tests/fuzz/target.hpp"
#include "tests/support/scan_files.hpp"

namespace vdvr::fuzz {

inline void write_cone_folder(const std::filesystem::path& folder, const char* member, const char* file) {
  std::ofstream(folder / "stack.mha", std::ios::binary)
      << support::stack_bytes(3, 2, 4, "Offset = -0.5 -0.25 0\nElementSpacing = 0.5 0.5 1\n");
  std::ofstream(folder / "scan.json")
      << nlohmann::json{{"projections", "stack.mha"}, {"description", "line integrals"}, {member, file}};
}

inline void read_cone_folder(const std::filesystem::path& file) {
  ScanOptions options;
  options.max_memory_bytes = memory_limit;
  static_cast<void>(read_scan(file.parent_path(), options));
}

}  // namespace vdvr::fuzz
