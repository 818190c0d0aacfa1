// The detector's noise.
#include "host/scan/simulate/simulate_detector.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace vdvr {

void add_noise(View& view, double sigma, std::uint64_t seed, std::int64_t view_index) {
  const auto index = static_cast<std::uint64_t>(view_index);
  std::seed_seq words{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                      static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32)};
  std::mt19937_64 random(words);
  // 53 random bits at the middles of their intervals: never 0, so that the logarithm is finite.
  const auto uniform = [&random] { return (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53; };
  for (std::size_t i = 0; i < view.data.size(); i += 2) {
    const double radius = sigma * std::sqrt(-2 * std::log(uniform())),
                 angle = 2 * std::numbers::pi * uniform();
    view.data[i] += radius * std::cos(angle);
    if (i + 1 < view.data.size()) view.data[i + 1] += radius * std::sin(angle);
  }
}

}  // namespace vdvr
