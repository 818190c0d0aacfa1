#include "host/scan/prepare/stripes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "host/base/system/casts.hpp"
#include "host/scan/prepare/view_filters.hpp"

namespace vdvr {
namespace {

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

// Whether at least half of a column's unrest are errors that differ from view to view: of such of mean
// magnitude m, second differences have sqrt(6) m. What moves on from view to view has next to none.
std::vector<bool> mostly_noise(const Sinogram& s, const std::vector<double>& own) {
  std::vector<double> sum(at(s.columns), 0.0);
  for (std::int64_t k = 0; k < s.views; ++k) {
    const double *before = s.row(mirrored(k - 1, s.views)), *after = s.row(mirrored(k + 1, s.views)),
                 *row = s.row(k);
    for (std::int64_t c = 0; c < s.columns; ++c)
      sum[at(c)] += std::abs(before[c] - 2 * row[c] + after[c]) / std::sqrt(6.0);
  }
  std::vector<bool> noisy(at(s.columns));
  for (std::size_t c = 0; c < noisy.size(); ++c) noisy[c] = sum[c] > 0 && 2 * sum[c] >= own[c];
  return noisy;
}

// Of the columns found those in runs, up to half of `window` wide, that end abruptly on both sides: dead ones
// at a quarter of their neighbours, fluctuating ones at twice these, and at least half of it by errors that
// differ from view to view. The limb of an object rises on one side only, or moves on from view to view.
std::vector<bool> ending_abruptly(const std::vector<bool>& found, const std::vector<double>& own,
                                  const Sinogram& s, int window) {
  const std::vector<bool> noisy = mostly_noise(s, own);
  const std::size_t n = own.size(), widest = static_cast<std::size_t>(window / 2);
  std::vector<bool> stripe(n, false);
  for (std::size_t first = 0; first < n; ++first)
    for (std::size_t last = first; last < n && found[last] && last - first < widest; ++last) {
      std::vector<double> beside;
      if (first > 0) beside.push_back(own[first - 1]);
      if (last + 1 < n) beside.push_back(own[last + 1]);
      if (beside.empty()) continue;
      const auto [low, high] = std::minmax_element(beside.begin(), beside.end());
      bool dead = true, fluctuating = true;
      for (std::size_t c = first; c <= last; ++c) {
        dead = dead && 4 * own[c] <= *low;
        fluctuating = fluctuating && own[c] >= 2 * *high && noisy[c];
      }
      if (dead || fluctuating)
        for (std::size_t c = first; c <= last; ++c) stripe[c] = true;
    }
  return stripe;
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

// One offset that values share: their median, if their middle half lies within half of it; else 0.
double shared_offset(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  const double middle = values[n / 2];
  return values[n - 1 - n / 4] - values[n / 4] < std::abs(middle) ? middle : 0;
}

// By how much column c lies above its two neighbours, in most views.
double median_above_neighbours(const Sinogram& s, std::int64_t c, std::vector<double>& values) {
  for (std::int64_t k = 0; k < s.views; ++k)
    values[at(k)] =
        s.row(k)[c] - 0.5 * (s.row(k)[mirrored(c - 1, s.columns)] + s.row(k)[mirrored(c + 1, s.columns)]);
  std::nth_element(values.begin(), values.begin() + s.views / 2, values.end());
  return values[at(s.views / 2)];
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

std::vector<bool> outstanding(const std::vector<double>& values, double ratio, double least_rise) {
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
               noise = std::max(high - low, least_rise);
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
  // As a logarithm (the paper: the quotient): a dead column is as far from 1 as a fluctuating one. What is
  // within the rounding of the largest value is no unrest: of noise-free data beside the object both are 0.
  constexpr double least = 1e-3;
  const double rounding = 1e-6 * largest_magnitude(s) * static_cast<double>(s.views);
  std::vector<double> share(own.size(), 0.0);
  for (std::size_t c = 0; c < own.size(); ++c)
    if (around[c] > rounding) share[c] = std::log(std::max(own[c] / around[c], least));
  // The middle half of normal numbers of deviation d is a line that rises by 2.7 d, and the mean magnitude of
  // n errors has a deviation of sqrt(pi / 2 - 1) / sqrt(n): columns of pure noise differ by that.
  const double chance = 2.7 * std::sqrt((0.5 * std::numbers::pi - 1) / static_cast<double>(s.views));
  const std::vector<bool> found = ending_abruptly(outstanding(share, ratio, chance), own, s, window),
                          bad = widened(found);
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
  const std::vector<bool> found = outstanding(most, ratio, 1e-6 * largest_magnitude(s)), bad = widened(found);
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
  std::vector<double> values(at(s.views));
  // In noise all columns; else what is left of clean ones would be the difference between an object's ranks.
  std::vector<bool> stripe = mostly_noise(s, unrest(s));
  for (std::int64_t c = 0; c < s.columns; ++c) {
    for (std::int64_t r = 0; r < s.views; ++r) values[at(r)] = sorted.ranks.row(r)[c] - smooth.row(r)[c];
    const double offset = shared_offset(values);
    if (!stripe[at(c)] && offset != 0)
      stripe[at(c)] = 2 * median_above_neighbours(s, c, values) / offset >= 1;
  }
  for (std::int64_t c = 0; c < s.columns; ++c)
    if (stripe[at(c)]) put_back(s, sorted, smooth, c);
}

}  // namespace vdvr
