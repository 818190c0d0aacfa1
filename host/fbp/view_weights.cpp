// Angular weights from the gaps between views modulo pi or 2 pi.
#include "host/fbp/view_weights.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace vdvr {
namespace {

double folded(double theta, double period) {
  const double t = std::fmod(theta, period);
  return t < 0 ? t + period : t;
}

// The median of the gaps that are not between coincident views; a first guess of period / K tells those
// apart.
double median_gap(const std::vector<double>& sorted, double period) {
  const std::size_t n = sorted.size();
  std::vector<double> gaps;
  for (std::size_t i = 0; i < n; ++i) {
    const double gap = i + 1 < n ? sorted[i + 1] - sorted[i] : sorted[0] + period - sorted[i];
    if (gap > 1e-3 * period / static_cast<double>(n)) gaps.push_back(gap);
  }
  if (gaps.empty()) return period;
  std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2), gaps.end());
  return gaps[gaps.size() / 2];
}

}  // namespace

ViewWeights view_weights(const std::vector<double>& theta_rad, double period) {
  const std::size_t n = theta_rad.size();
  ViewWeights result;
  result.weight.assign(n, 0.0);
  if (n == 0) return result;
  if (n == 1) {
    result.weight[0] = period;
    return result;
  }
  std::vector<double> angle(n);
  std::transform(theta_rad.begin(), theta_rad.end(), angle.begin(),
                 [&](double theta) { return folded(theta, period); });
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return angle[a] < angle[b]; });
  std::vector<double> sorted(n);
  for (std::size_t i = 0; i < n; ++i) sorted[i] = angle[order[i]];

  // Group coincident views, then join the first and the last group where they meet across the seam.
  const double median = median_gap(sorted, period), near = 1e-3 * median;
  std::vector<std::vector<std::size_t>> groups{{0}};
  for (std::size_t i = 1; i < n; ++i) {
    if (sorted[i] - sorted[i - 1] < near) groups.back().push_back(i);
    else groups.push_back({i});
  }
  if (groups.size() > 1 && sorted.front() + period - sorted.back() < near) {
    for (const std::size_t i : groups.back()) {
      sorted[i] -= period;
      groups.front().push_back(i);
    }
    groups.pop_back();
  }

  std::vector<double> place(groups.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (const std::size_t i : groups[g]) place[g] += sorted[i];
    place[g] /= static_cast<double>(groups[g].size());
    if (groups[g].size() > 1) result.grouped_views += static_cast<int>(groups[g].size());
  }
  const std::size_t m = groups.size();
  for (std::size_t g = 0; g < m; ++g) {
    double before = m == 1 ? period : g > 0 ? place[g] - place[g - 1] : place[0] + period - place[m - 1];
    double after = m == 1 ? period : g + 1 < m ? place[g + 1] - place[g] : place[0] + period - place[m - 1];
    const double cap = 4 * median;
    if (m > 1 && (before > cap || after > cap)) result.limited_angle = true;
    if (m > 1) {
      before = std::min(before, cap);
      after = std::min(after, cap);
    }
    for (const std::size_t i : groups[g])
      result.weight[order[i]] = 0.5 * (before + after) / static_cast<double>(groups[g].size());
  }
  return result;
}

}  // namespace vdvr
