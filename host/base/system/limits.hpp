// Sizes that come from a file's header: multiplied in 64 bits, compared with memory before anything is
// allocated.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace vdvr::io {

/// The product of a shape times `element_bytes`. Throws FileError ("what: ...") when a factor is not positive
/// or the product does not fit 63 bits.
std::uint64_t checked_bytes(std::span<const std::int64_t> shape, std::uint64_t element_bytes,
                            const std::string& what);

/// Throws ResourceError when `bytes` exceed `limit` (0: no limit) or the machine's memory.
void require_memory(std::uint64_t bytes, std::uint64_t limit, const std::string& what);

/// Bytes of memory that this machine has.
std::uint64_t physical_memory();

/// "181 x 2 x 640".
std::string shape_text(std::span<const std::int64_t> shape);

}  // namespace vdvr::io
