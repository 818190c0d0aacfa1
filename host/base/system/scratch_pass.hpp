// A pass over arrays in scratch that reads or writes faster than the keeper of scratch looks
// (vdvr/expert/scratch.hpp): it lets go of them by itself, so that what is resident does not depend on who
// gets a core.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

#include "vdvr/expert/sample_array.hpp"

namespace vdvr {

/// Threads of one pass share it. Arrays in memory are left alone.
class ScratchPass {
 public:
  /// Bytes that are touched before all is let go of.
  static constexpr std::uint64_t at_once = std::uint64_t{64} << 20;

  template <class T>
  void add(const Samples<T>& samples) {
    // Mapped from a page's first byte on.
    if (samples.scratch()) arrays_.emplace_back(samples.data(), sizeof(T) * samples.size());
  }
  /// All that for_each_array() finds in it.
  template <class Arrays>
  void add_all(const Arrays& arrays) {
    for_each_array(arrays, [&](const auto& samples) { add(samples); });
  }

  void touched(std::uint64_t bytes) {
    if (arrays_.empty()) return;
    const std::uint64_t before = touched_.fetch_add(bytes);
    if (before / at_once != (before + bytes) / at_once) let_go();
  }
  /// A shared page keeps what was written into it: only this process's view of it goes.
  void let_go() const {
    for (const auto& [first, bytes] : arrays_)
      ::madvise(const_cast<void*>(first), bytes, MADV_DONTNEED);  // NOLINT: nothing is written
  }

 private:
  std::vector<std::pair<const void*, std::uint64_t>> arrays_;
  std::atomic<std::uint64_t> touched_ = 0;
};

}  // namespace vdvr
