// Memory that several processes of a machine, or several devices of one, read and write.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace vdvr {

/// Memory that others have too, zeros at first, and what keeps it; empty: none is to be had.
struct CommonMemory {
  std::span<std::byte> bytes{};
  std::shared_ptr<void> owner{};
  int sharers = 1;  ///< who may have it, this one included
};

}  // namespace vdvr
