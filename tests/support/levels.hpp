// Levels of 255 by pixel, for the tables of how tight intervals are.
#pragma once

#include <algorithm>
#include <vector>

namespace vdvr::support {

struct Levels {
  std::vector<double> values;
  [[nodiscard]] double mean() const {
    double sum = 0;
    for (const double x : values) sum += x / static_cast<double>(values.size());
    return sum;
  }
  [[nodiscard]] double at(double share) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  }
  [[nodiscard]] double most() const { return *std::max_element(values.begin(), values.end()); }
  /// Per cent.
  [[nodiscard]] double within(double bound) const {
    const auto count = std::count_if(values.begin(), values.end(), [&](double x) { return x <= bound; });
    return 100.0 * static_cast<double>(count) / static_cast<double>(values.size());
  }
};

}  // namespace vdvr::support
