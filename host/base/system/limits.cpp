// Checks of sizes read from a header; see limits.hpp.
#include "host/base/system/limits.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <limits>

#include "vdvr/error.hpp"

namespace vdvr::io {

std::string shape_text(std::span<const std::int64_t> shape) {
  std::string text;
  for (const std::int64_t n : shape) text += fmt::format("{}{}", text.empty() ? "" : " x ", n);
  return text.empty() ? "scalar" : text;
}

std::uint64_t checked_bytes(std::span<const std::int64_t> shape, std::uint64_t element_bytes,
                            const std::string& what) {
  constexpr std::uint64_t largest = std::numeric_limits<std::int64_t>::max();
  std::uint64_t bytes = element_bytes;
  for (const std::int64_t n : shape) {
    if (n <= 0) throw FileError(fmt::format("{}: shape {} has an empty axis", what, shape_text(shape)));
    if (bytes > largest / static_cast<std::uint64_t>(n))
      throw FileError(fmt::format("{}: shape {} is too large to address", what, shape_text(shape)));
    bytes *= static_cast<std::uint64_t>(n);
  }
  return bytes;
}

std::uint64_t physical_memory() {
  const auto pages = static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES));
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void require_memory(std::uint64_t bytes, std::uint64_t limit, const std::string& what) {
  constexpr double mebi = 1024.0 * 1024.0;
  if (limit != 0 && bytes > limit)
    throw ResourceError(
        fmt::format("{}: needs {:.1f} MiB, the memory limit is {:.1f} MiB; raise `max_memory`", what,
                    static_cast<double>(bytes) / mebi, static_cast<double>(limit) / mebi));
  const std::uint64_t physical = physical_memory();
  if (bytes > physical)
    throw ResourceError(fmt::format("{}: needs {:.1f} MiB, this machine has {:.1f} MiB", what,
                                    static_cast<double>(bytes) / mebi, static_cast<double>(physical) / mebi));
}

}  // namespace vdvr::io
