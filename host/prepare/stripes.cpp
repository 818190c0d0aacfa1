#include "host/prepare/stripes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/prepare/view_filters.hpp"

namespace vdvr {
namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

// Median of `window` neighbours, mirrored at the ends.
std::vector<double> median_along(const double* row, std::int64_t n, int window) {
  std::vector<double> out(at(n)), values(static_cast<std::size_t>(window));
  const std::int64_t reach = window / 2;
  for (std::int64_t i = 0; i < n; ++i) {
    for (std::int64_t d = -reach; d <= reach; ++d) values[at(d + reach)] = row[mirrored(i + d, n)];
    std::nth_element(values.begin(), values.begin() + reach, values.end());
    out[at(i)] = values[at(reach)];
  }
  return out;
}

// Columns with their values in ascending order, and the views that these came from.
struct Sorted {
  Sinogram ranks;                  // ranks.row(r)[column]: the r-th smallest value of the column
  std::vector<std::int32_t> view;  // [column][rank]
};

Sorted sorted_columns(const Sinogram& s) {
  Sorted out{{s.views, s.columns, std::vector<double>(s.data.size())},
             std::vector<std::int32_t>(s.data.size())};
  for (std::int64_t c = 0; c < s.columns; ++c) {
    const auto first = out.view.begin() + c * s.views, last = first + s.views;
    std::iota(first, last, 0);
    std::stable_sort(first, last, [&](std::int32_t a, std::int32_t b) { return s.row(a)[c] < s.row(b)[c]; });
    for (std::int64_t r = 0; r < s.views; ++r) out.ranks.row(r)[c] = s.row(*(first + r))[c];
  }
  return out;
}

Sinogram smoothed_ranks(const Sinogram& ranks, int window) {
  Sinogram out{ranks.views, ranks.columns, std::vector<double>(ranks.data.size())};
  for (std::int64_t r = 0; r < ranks.views; ++r) {
    const auto row = median_along(ranks.row(r), ranks.columns, window);
    std::copy(row.begin(), row.end(), out.row(r));
  }
  return out;
}

void put_back(Sinogram& s, const Sorted& sorted, const Sinogram& ranks, std::int64_t column) {
  for (std::int64_t r = 0; r < s.views; ++r)
    s.row(sorted.view[at(column * s.views + r)])[column] = ranks.row(r)[column];
}

// A stripe leaks into its neighbours.
std::vector<bool> widened(const std::vector<bool>& mask) {
  std::vector<bool> out = mask;
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i]) {
      if (i > 0) out[i - 1] = true;
      if (i + 1 < mask.size()) out[i + 1] = true;
    }
  return out;
}

double largest_magnitude(const Sinogram& s) {
  double most = 0;
  for (const double p : s.data) most = std::max(most, std::abs(p));
  return most;
}

// How much a column moves about its own mean of eleven views.
std::vector<double> unrest(const Sinogram& s) {
  constexpr std::int64_t reach = 5;
  std::vector<double> sum(at(s.columns), 0.0), mean(at(s.columns));
  for (std::int64_t k = 0; k < s.views; ++k) {
    std::fill(mean.begin(), mean.end(), 0.0);
    for (std::int64_t d = -reach; d <= reach; ++d) {
      const double* row = s.row(mirrored(k + d, s.views));
      for (std::int64_t c = 0; c < s.columns; ++c) mean[at(c)] += row[c] / (2 * reach + 1);
    }
    for (std::int64_t c = 0; c < s.columns; ++c) sum[at(c)] += std::abs(s.row(k)[c] - mean[at(c)]);
  }
  return sum;
}

void interpolate_columns(Sinogram& s, const std::vector<bool>& bad) {
  for (std::int64_t c = 0; c < s.columns; ++c) {
    if (!bad[at(c)]) continue;
    std::int64_t left = c, right = c;
    while (left >= 0 && bad[at(left)]) --left;
    while (right < s.columns && bad[at(right)]) ++right;
    if (left < 0) left = right;
    if (right >= s.columns) right = left;
    const double share = right > left ? static_cast<double>(c - left) / static_cast<double>(right - left) : 0;
    for (std::int64_t k = 0; k < s.views; ++k) {
      double* row = s.row(k);
      row[c] = (1 - share) * row[left] + share * row[right];
    }
  }
}

// Means of consecutive views: bin b of n those from b views / n.
Sinogram binned_views(const Sinogram& s, std::int64_t bins) {
  Sinogram out{bins, s.columns, std::vector<double>(at(bins * s.columns), 0.0)};
  for (std::int64_t b = 0; b < bins; ++b) {
    const std::int64_t first = b * s.views / bins, last = (b + 1) * s.views / bins;
    for (std::int64_t k = first; k < last; ++k)
      for (std::int64_t c = 0; c < s.columns; ++c)
        out.row(b)[c] += s.row(k)[c] / static_cast<double>(last - first);
  }
  return out;
}

// lasting.row(b)[c]: by how much column c lies above those around it in most of the bins around b. What a
// view's neighbours differ by is made of stripes' sides, which stay, and of the object's, which move on: a
// median along the views leaves the former, whose sum across is the stripes' profile.
Sinogram lasting_differences(const Sinogram& binned, int window) {
  constexpr int along = 61;  // bins of 120
  Sinogram out{binned.views, binned.columns, std::vector<double>(binned.data.size(), 0.0)};
  std::vector<double> column(at(binned.views));
  for (std::int64_t c = 1; c < binned.columns; ++c) {
    for (std::int64_t b = 0; b < binned.views; ++b) column[at(b)] = binned.row(b)[c] - binned.row(b)[c - 1];
    const auto lasting = median_along(column.data(), binned.views, along);
    for (std::int64_t b = 0; b < binned.views; ++b) out.row(b)[c] = out.row(b)[c - 1] + lasting[at(b)];
  }
  for (std::int64_t b = 0; b < binned.views; ++b) {
    const auto around = median_along(out.row(b), binned.columns, window);
    for (std::int64_t c = 0; c < binned.columns; ++c) out.row(b)[c] -= around[at(c)];
  }
  return out;
}

}  // namespace

std::vector<bool> outstanding(const std::vector<double>& values, double ratio, double scale) {
  const std::size_t n = values.size();
  std::vector<bool> mask(n, false);
  if (n < 8) return mask;
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  // The line through the middle half, by least squares, carried to both ends.
  const std::size_t first = n / 4, last = n - n / 4;
  double mean_x = 0, mean_y = 0, xy = 0, xx = 0;
  const auto count = static_cast<double>(last - first);
  for (std::size_t i = first; i < last; ++i)
    mean_x += static_cast<double>(i) / count, mean_y += sorted[i] / count;
  for (std::size_t i = first; i < last; ++i) {
    const double x = static_cast<double>(i) - mean_x;
    xy += x * (sorted[i] - mean_y), xx += x * x;
  }
  const double slope = xy / xx, low = mean_y - slope * mean_x,
               high = mean_y + slope * (static_cast<double>(n - 1) - mean_x),
               noise = std::max(high - low, 1e-6 * scale);
  if (!(noise > 0)) return mask;
  const bool above = sorted.back() - high >= ratio * noise, below = low - sorted.front() >= ratio * noise;
  // Half the distance from there on: what belongs to a stripe that was found need not stand out alone.
  for (std::size_t i = 0; i < n; ++i)
    mask[i] =
        (above && values[i] > high + 0.5 * ratio * noise) || (below && values[i] < low - 0.5 * ratio * noise);
  return mask;
}

std::int64_t remove_dead_stripes(Sinogram& s, double ratio, int window) {
  const std::vector<double> own = unrest(s), around = median_along(own.data(), s.columns, window);
  // As a logarithm (the paper: the quotient): a dead column is as far from 1 as a fluctuating one.
  constexpr double least = 1e-3;
  std::vector<double> share(own.size(), 0.0);
  for (std::size_t c = 0; c < own.size(); ++c)
    if (around[c] > 0) share[c] = std::log(std::max(own[c] / around[c], least));
  const std::vector<bool> found = outstanding(share, ratio, 1);
  std::vector<bool> bad = widened(found);
  if (std::find(bad.begin(), bad.end(), false) == bad.end()) return 0;
  interpolate_columns(s, bad);
  return std::count(found.begin(), found.end(), true);
}

std::int64_t remove_lasting_stripes(Sinogram& s, double ratio, int window) {
  constexpr std::int64_t most_bins = 120;
  const std::int64_t bins = std::min(s.views, most_bins);
  const Sinogram lasting = lasting_differences(binned_views(s, bins), window);
  std::vector<double> most(at(s.columns), 0.0);
  for (std::int64_t b = 0; b < bins; ++b)
    for (std::int64_t c = 0; c < s.columns; ++c)
      most[at(c)] = std::max(most[at(c)], std::abs(lasting.row(b)[c]));
  const std::vector<bool> found = outstanding(most, ratio, largest_magnitude(s)), bad = widened(found);
  for (std::int64_t k = 0; k < s.views; ++k) {
    const std::int64_t b = std::min(bins - 1, k * bins / s.views);
    for (std::int64_t c = 0; c < s.columns; ++c)
      if (bad[at(c)]) s.row(k)[c] -= lasting.row(b)[c];
  }
  return std::count(found.begin(), found.end(), true);
}

void remove_small_stripes(Sinogram& s, int window) {
  const Sorted sorted = sorted_columns(s);
  const Sinogram smooth = smoothed_ranks(sorted.ranks, window);
  for (std::int64_t c = 0; c < s.columns; ++c) put_back(s, sorted, smooth, c);
}

}  // namespace vdvr
