// Bands of rows, smoothed, binned, differentiated.
#include "host/scan/center/row_bands.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace vdvr::center {

RowBands average_rows(const ProjectionSet& scan, const std::vector<std::int64_t>& views,
                      std::int64_t most_bands) {
  const auto& g = scan.geometry;
  RowBands out{static_cast<std::int64_t>(views.size()), std::min(most_bands, g.rows), g.columns, {}};
  out.data.assign(static_cast<std::size_t>(out.views * out.bands * out.columns), 0.0);
  std::vector<double> rows(static_cast<std::size_t>(out.bands), 0.0);
  for (std::int64_t v = 0; v < g.rows; ++v) ++rows[static_cast<std::size_t>(v * out.bands / g.rows)];
  for (std::int64_t k = 0; k < out.views; ++k)
    for (std::int64_t v = 0; v < g.rows; ++v) {
      const std::int64_t band = v * out.bands / g.rows;
      const float* from = scan.data.data() + (views[static_cast<std::size_t>(k)] * g.rows + v) * g.columns;
      double* to = out.data.data() + (k * out.bands + band) * g.columns;
      const double share = 1 / rows[static_cast<std::size_t>(band)];
      for (std::int64_t i = 0; i < g.columns; ++i) to[i] += share * static_cast<double>(from[i]);
    }
  return out;
}

void smooth_columns(RowBands& set) {
  constexpr std::int64_t reach = 4;
  std::array<double, reach + 1> weight{};
  for (std::int64_t d = 0; d <= reach; ++d)
    weight[static_cast<std::size_t>(d)] = std::exp(-0.5 * static_cast<double>(d * d));
  std::vector<double> row(static_cast<std::size_t>(set.columns));
  for (std::int64_t r = 0; r < set.views * set.bands; ++r) {
    double* data = set.data.data() + r * set.columns;
    for (std::int64_t i = 0; i < set.columns; ++i) {
      double sum = 0, total = 0;
      for (std::int64_t j = std::max<std::int64_t>(0, i - reach); j <= std::min(set.columns - 1, i + reach);
           ++j) {
        const double w = weight[static_cast<std::size_t>(std::abs(i - j))];
        sum += w * data[j];
        total += w;
      }
      row[static_cast<std::size_t>(i)] = sum / total;
    }
    std::copy(row.begin(), row.end(), data);
  }
}

RowBands binned_columns(const RowBands& set, std::int64_t factor) {
  RowBands out{set.views, set.bands, set.columns / factor, {}};
  for (std::int64_t r = 0; r < set.views * set.bands; ++r)
    for (std::int64_t i = 0; i < out.columns; ++i) {
      const double* from = set.data.data() + r * set.columns + i * factor;
      out.data.push_back(std::accumulate(from, from + factor, 0.0) / static_cast<double>(factor));
    }
  return out;
}

RowBands differences(const RowBands& set) {
  RowBands out{set.views, set.bands, set.columns - 1, {}};
  for (std::int64_t r = 0; r < set.views * set.bands; ++r)
    for (std::int64_t i = 0; i < out.columns; ++i) {
      const double* from = set.data.data() + r * set.columns + i;
      out.data.push_back(from[1] - from[0]);
    }
  return out;
}

std::vector<std::int64_t> by_angle(const std::vector<double>& theta) {
  std::vector<std::int64_t> order(theta.size());
  std::iota(order.begin(), order.end(), std::int64_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::int64_t a, std::int64_t b) {
    return theta[static_cast<std::size_t>(a)] < theta[static_cast<std::size_t>(b)];
  });
  return order;
}

double median_step(std::vector<double> theta) {
  for (double& t : theta) t -= 2 * pi * std::floor(t / (2 * pi));
  std::sort(theta.begin(), theta.end());
  std::vector<double> gaps;
  for (std::size_t k = 1; k < theta.size(); ++k)
    if (const double gap = theta[k] - theta[k - 1]; gap > 1e-9)
      gaps.push_back(gap);  // repeated views are no step
  if (gaps.empty()) return 0;
  std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2), gaps.end());
  return gaps[gaps.size() / 2];
}

double parabola_peak(double a, double b, double c) {
  const double bend = a - 2 * b + c;
  return bend == 0 ? 0 : std::clamp(0.5 * (a - c) / bend, -0.5, 0.5);
}

}  // namespace vdvr::center
