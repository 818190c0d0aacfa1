// Files that need not fit memory, held to what they say of themselves. Called by commands; calls
// vdvr_file.cpp.
#include "vdvr/read_large.hpp"

#include <fmt/format.h>

#include "vdvr/error.hpp"

namespace vdvr {

VdvrFile read_large_certified(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                              const std::filesystem::path& scratch) {
  VdvrFile file = read_large_vdvr(path, max_memory_bytes, scratch, Altered::refuse);
  if (const std::string what = contradiction(file.certificate); !what.empty())
    throw MismatchError(fmt::format("{}: the certificate contradicts itself: {}", path.string(), what));
  return file;
}

}  // namespace vdvr
