// What a reconstruction fills, and what times it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include "host/base/opencl/kernel.hpp"
#include "host/base/system/huge_pages.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {

/// Where a slab's planes go, zeros so far, and what is done once they are there.
struct Planes {
  std::function<float*(std::int64_t first, std::int64_t count)> target;
  std::function<void(std::int64_t first, std::int64_t count)> done = [](std::int64_t, std::int64_t) {};
  std::uint64_t bytes = 0;  ///< that a plane takes beside the slab; 0: counted elsewhere
};

/// Laps of device work; without a receiver nothing waits.
class StageWatch {
 public:
  explicit StageWatch(StageSeconds* seconds) : seconds_(seconds) {}
  void lap(opencl::State& state, const std::string& stage) {
    if (!seconds_) return;
    opencl::finish(state, stage);
    const auto now = Clock::now();
    (*seconds_)[stage] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;
  StageSeconds* seconds_;
  Clock::time_point last_{Clock::now()};
};

/// All of them as a volume.
class WholeVolume {
 public:
  // Fresh pages cost a core's time, which the device leaves between its kernels; later where no thread is
  // left.
  explicit WholeVolume(const Grid& grid) {
    volume_.grid = grid;
    const auto n = static_cast<std::size_t>(grid.sample_count());
    samples_ = std::async(std::launch::async | std::launch::deferred, [n] { return large_zeros(n); });
  }
  [[nodiscard]] Planes planes() {
    Planes out;
    out.target = [this](std::int64_t first, std::int64_t) {
      if (samples_.valid()) volume_.samples = samples_.get();
      const Index3 n = volume_.grid.samples();
      return volume_.samples.data() + first * n[0] * n[1];
    };
    return out;
  }
  [[nodiscard]] Volume take() { return std::move(volume_); }

 private:
  Volume volume_;
  std::future<std::vector<float>> samples_;
};

}  // namespace vdvr
