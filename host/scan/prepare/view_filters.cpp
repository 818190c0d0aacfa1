// Filters of one view, each a plain loop. Layouts in the header.
#include "host/scan/prepare/view_filters.hpp"

#include <algorithm>
#include <cmath>

namespace vdvr {
namespace {

View like(const View& view) { return {view.columns, view.rows, std::vector<double>(view.data.size())}; }

std::vector<double> gaussian_kernel(double sigma) {
  const auto radius = static_cast<std::int64_t>(std::ceil(5 * sigma));
  std::vector<double> kernel;
  double sum = 0;
  for (std::int64_t k = -radius; k <= radius; ++k) {
    const double x = static_cast<double>(k) / sigma;
    kernel.push_back(std::exp(-x * x / 2));
    sum += kernel.back();
  }
  for (double& w : kernel) w /= sum;
  return kernel;
}

// The pixels a window of the given radius sees along an axis: index[position - ... + radius], mirrored at the
// ends.
std::vector<std::int64_t> window_index(std::int64_t n, std::int64_t radius) {
  std::vector<std::int64_t> index;
  for (std::int64_t i = -radius; i < n + radius; ++i) index.push_back(mirrored(i, n));
  return index;
}

}  // namespace

std::int64_t mirrored(std::int64_t i, std::int64_t n) {
  const std::int64_t m = ((i % (2 * n)) + 2 * n) % (2 * n);
  return m < n ? m : 2 * n - 1 - m;
}

View median_filtered(const View& view, int side) {
  View out = like(view);
  const std::int64_t radius = side / 2;
  const auto u = window_index(view.columns, radius), v = window_index(view.rows, radius);
  std::vector<double> window(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (std::int64_t j = 0; j < view.rows; ++j)
    for (std::int64_t i = 0; i < view.columns; ++i) {
      std::size_t n = 0;
      for (std::int64_t b = 0; b < side; ++b)
        for (std::int64_t a = 0; a < side; ++a)
          window[n++] = view.at(u[static_cast<std::size_t>(i + a)], v[static_cast<std::size_t>(j + b)]);
      const auto middle = window.begin() + static_cast<std::ptrdiff_t>(n / 2);
      std::nth_element(window.begin(), middle, window.end());
      out.at(i, j) = *middle;
    }
  return out;
}

View gaussian_filtered(const View& view, double sigma_u, double sigma_v) {
  View out = view;
  if (sigma_u > 0) {
    const auto kernel = gaussian_kernel(sigma_u);
    const auto u = window_index(view.columns, static_cast<std::int64_t>(kernel.size() / 2));
    for (std::int64_t j = 0; j < view.rows; ++j)
      for (std::int64_t i = 0; i < view.columns; ++i) {
        double sum = 0;
        for (std::size_t k = 0; k < kernel.size(); ++k)
          sum += kernel[k] * view.at(u[static_cast<std::size_t>(i) + k], j);
        out.at(i, j) = sum;
      }
  }
  if (!(sigma_v > 0)) return out;
  View both = like(view);
  const auto kernel = gaussian_kernel(sigma_v);
  const auto v = window_index(view.rows, static_cast<std::int64_t>(kernel.size() / 2));
  for (std::int64_t j = 0; j < view.rows; ++j)
    for (std::size_t k = 0; k < kernel.size(); ++k)
      for (std::int64_t i = 0; i < view.columns; ++i)
        both.at(i, j) += kernel[k] * out.at(i, v[static_cast<std::size_t>(j) + k]);
  return both;
}

View binned(const View& view, int factor) {
  View out{view.columns / factor, view.rows / factor, {}};
  out.data.resize(static_cast<std::size_t>(out.columns * out.rows));
  for (std::int64_t j = 0; j < out.rows * factor; ++j)
    for (std::int64_t i = 0; i < out.columns * factor; ++i) out.at(i / factor, j / factor) += view.at(i, j);
  for (double& value : out.data) value /= static_cast<double>(factor) * factor;
  return out;
}

}  // namespace vdvr
