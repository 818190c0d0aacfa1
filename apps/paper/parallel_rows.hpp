// A loop over the rows of a field on all cores. Called by fields.cpp and upsample_volume.cpp.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr::paper {

/// Runs body(row) for 0 <= row < rows. `progress` is called by the calling thread alone; what it or a body
/// throws ends the loop and reaches the caller.
template <class Body>
void parallel_rows(std::int64_t rows, const Progress& progress, const std::string& stage, Body&& body) {
  std::atomic<std::int64_t> next{0};
  const auto work = [&](bool reports) {
    try {
      for (std::int64_t row = next++; row < rows; row = next++) {
        throw_if_stopped();
        body(row);
        if (reports) report(progress, stage, static_cast<double>(row + 1) / static_cast<double>(rows));
      }
    } catch (...) {
      next = rows;
      throw;
    }
  };
  std::vector<std::future<void>> others;
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  for (unsigned t = 1; t < cores; ++t)
    others.push_back(std::async(std::launch::async | std::launch::deferred, work, false));
  work(true);
  for (auto& other : others) other.get();
}

}  // namespace vdvr::paper
