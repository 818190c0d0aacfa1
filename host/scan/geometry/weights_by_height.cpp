// W_k by taking views away in the order of their tau: a direction's weight changes with its neighbours alone.
#include "host/scan/geometry/weights_by_height.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/scan/geometry/angular_gaps.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
constexpr double hit = 1e-9;  // of a row
constexpr double most_rows_of_taper = 10;
// As angular_gaps.cpp has it: what is four times as wide is of another kind. Rounding makes no gap wider.
constexpr double wider_kind = 4 * (1 + 1e-9);

double folded_angle(double theta, double period) {
  const double t = std::fmod(theta, period);
  return t < 0 ? t + period : t;
}

double taper(double row, std::int64_t rows) {
  const double last = static_cast<double>(rows - 1), y = std::clamp(row, 0.0, last),
               length = std::min(most_rows_of_taper, 0.25 * last),
               r = std::min(1.0, (std::min(y, last - y) + 0.5) / (length + 0.5));
  return r * r * r * (10 + r * (6 * r - 15));
}

// Angles in ascending order, those that lie within same_direction_rad of the first of them as one.
struct Joined {
  std::vector<std::size_t> of;  // by angle
  std::vector<double> place;    // ascending
};
Joined joined(const std::vector<double>& theta, double period) {
  std::vector<double> angle(theta.size());
  std::transform(theta.begin(), theta.end(), angle.begin(),
                 [&](double t) { return folded_angle(t, period); });
  std::vector<std::size_t> order(theta.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return angle[a] < angle[b]; });
  Joined out{std::vector<std::size_t>(theta.size()), {}};
  for (const std::size_t k : order) {
    // Across the seam those that come last belong to the first.
    const bool to_first = !out.place.empty() && angle[k] - out.place.front() > period - same_direction_rad;
    if (!to_first && (out.place.empty() || angle[k] - out.place.back() > same_direction_rad))
      out.place.push_back(angle[k]);
    out.of[k] = to_first ? 0 : out.place.size() - 1;
  }
  return out;
}

}  // namespace

/// Views that see a height.
struct WeightsByHeight::Height {
  std::vector<std::int64_t> views;
  double widest_rad = 0;  ///< gap between directions
  bool all_around = false;
};

namespace {

// Directions on a circle, from which views are taken away.
class WeighedDirections {
 public:
  WeighedDirections(const std::vector<double>& place, double period) : place_(place), period_(period) {
    const std::size_t n = place.size();
    for (std::size_t i = 0; i < n; ++i) {
      before_.push_back((i + n - 1) % n);
      after_.push_back((i + 1) % n);
    }
    views_.assign(n, 0);
    since_.assign(n, 0.0);
    sum_.assign(n, 0.0);
  }
  void add_view(std::size_t d) { ++views_[d]; }
  [[nodiscard]] double gap(std::size_t d) const {
    const double g = place_[after_[d]] - place_[d];
    return g > 0 ? g : g + period_;
  }
  // What a view of the direction has weighed up to the share x.
  double up_to(std::size_t d, double x) {
    const double width = 0.5 * (gap(before_[d]) + gap(d));
    sum_[d] += (x - since_[d]) * width / static_cast<double>(views_[d]);
    since_[d] = x;
    return sum_[d];
  }
  // Of a direction's only view: the gap that it leaves.
  [[nodiscard]] double left_by(std::size_t d) const { return views_[d] > 1 ? 0 : gap(before_[d]) + gap(d); }
  // After up_to(d, x).
  void take_view(std::size_t d, double x) {
    if (--views_[d] > 0) return;
    const std::size_t a = before_[d], b = after_[d];
    // With the gaps that they had.
    for (const std::size_t other : {a, b})
      if (other != d) up_to(other, x);
    after_[a] = b;
    before_[b] = a;
  }

 private:
  const std::vector<double>& place_;
  double period_;
  std::vector<std::size_t> before_, after_;
  std::vector<int> views_;
  std::vector<double> since_, sum_;
};

}  // namespace

WeightsByHeight::WeightsByHeight(const HeightSeries& series)
    : series_(series), period_(series.full_turn ? 2 * pi : pi) {
  const std::int64_t K = std::ssize(series.theta_rad), V = series.rows;
  const auto [least, most_shift] = std::minmax_element(series.row_shift.begin(), series.row_shift.end());
  if (!(*most_shift - *least <= static_cast<double>(K * V)))
    throw InputError(
        fmt::format("heights: the sample moves by {:.4g} rows, and {} views of {} rows cannot see them all",
                    *most_shift - *least, K, V));
  for (std::int64_t k = 0; k < K; ++k) {
    const double at_zero = place(k, 0);
    window_.push_back({static_cast<std::int64_t>(std::ceil(-at_zero - hit)),
                       static_cast<std::int64_t>(std::floor(static_cast<double>(V - 1) - at_zero + hit))});
  }
  const auto by = [](auto member) {
    return [member](const Window& a, const Window& b) { return a.*member < b.*member; };
  };
  first_ = std::min_element(window_.begin(), window_.end(), by(&Window::first))->first;
  heights_ = std::max_element(window_.begin(), window_.end(), by(&Window::last))->last - first_ + 1;
  const Joined directions = joined(series.theta_rad, period_);
  direction_ = directions.of;
  direction_place_ = directions.place;
  join_views();

  std::vector<Height> height(at(heights_));
  parallel_for(heights_, {}, "", [&](std::int64_t i) {
    height[at(i)] = look(first_ + i);
    height[at(i)].views = {};  // of thousands of heights
  });
  std::vector<double> widest;
  for (const Height& h : height)
    if (h.all_around) widest.push_back(h.widest_rad);
  share_.assign(at(K * V), 0.0);
  if (widest.empty()) return;
  const auto middle = widest.begin() + std::ssize(widest) / 2;
  std::nth_element(widest.begin(), middle, widest.end());
  usual_rad_ = *middle;
  // Sparser heights, at the ends of a helix, are no measurement of the same kind.
  const double most = wider_kind * usual_rad_;
  for (std::int64_t i = 0; i < heights_; ++i) {
    if (!height[at(i)].all_around || height[at(i)].widest_rad > most) continue;
    if (!covered_.empty() && covered_.back().first + covered_.back().count == first_ + i)
      ++covered_.back().count;
    else covered_.push_back({first_ + i, 1});
  }
  const std::vector<double> w = vdvr::view_weights(theta_rad_, period_).weight;
  for (const Run& run : covered_)
    parallel_for(run.count, {}, "", [&](std::int64_t i) { set_shares(run.first + i, w); });
}

void WeightsByHeight::join_views() {
  const Joined turned = joined(series_.theta_rad, 2 * pi);
  std::map<std::pair<std::size_t, double>, std::int64_t> views;
  for (std::size_t k = 0; k < series_.theta_rad.size(); ++k) {
    const double shift = series_.column_shift.empty() ? 0 : series_.column_shift[k];
    const auto [view, is_new] = views.try_emplace({turned.of[k], shift}, std::ssize(theta_rad_));
    if (is_new) {
      theta_rad_.push_back(series_.theta_rad[k]);
      measured_.emplace_back();
    }
    view_of_.push_back(view->second);
    measured_[at(view->second)].push_back(static_cast<std::int64_t>(k));
  }
}

const std::vector<std::int64_t>& WeightsByHeight::measured(std::int64_t view) const {
  return measured_[at(view)];
}

double WeightsByHeight::place(std::int64_t view, std::int64_t height) const {
  return static_cast<double>(height) + (series_.row_shift[at(view)] - series_.row_shift.front());
}

double WeightsByHeight::share(std::int64_t view, std::int64_t height) const {
  const Window& w = window_[at(view)];
  if (height < w.first || height > w.last) return 0;
  return share_[at(view * series_.rows + height - w.first)];
}

double WeightsByHeight::shares(std::int64_t view, std::int64_t height) const {
  double sum = 0;
  for (const std::int64_t k : measured(view)) sum += share(k, height);
  return sum;
}

WeightsByHeight::Height WeightsByHeight::look(std::int64_t height) const {
  Height out;
  std::vector<double> theta;
  std::vector<bool> present(direction_place_.size(), false);
  for (std::int64_t k = 0; k < std::ssize(window_); ++k) {
    if (height < window_[at(k)].first || height > window_[at(k)].last) continue;
    out.views.push_back(k);
    theta.push_back(series_.theta_rad[at(k)]);
    present[direction_[at(k)]] = true;
  }
  if (theta.size() < 2) return out;
  const AngularGaps gaps = angular_gaps(theta, period_);
  out.all_around = !gaps.one_direction && gaps.wedges_rad().empty();
  double first = -1, last = 0;
  for (std::size_t d = 0; d < present.size(); ++d) {
    if (!present[d]) continue;
    const double p = direction_place_[d];
    if (first < 0) first = p;
    else out.widest_rad = std::max(out.widest_rad, p - last);
    last = p;
  }
  out.widest_rad = std::max(out.widest_rad, first + period_ - last);
  return out;
}

void WeightsByHeight::set_shares(std::int64_t height, const std::vector<double>& w) {
  Height h = look(height);
  std::vector<std::size_t> own(direction_place_.size(), 0);
  for (const std::int64_t k : h.views) own[direction_[at(k)]] = 1;
  std::vector<double> place;
  for (std::size_t d = 0; d < own.size(); ++d) {
    if (own[d] == 0) continue;
    own[d] = place.size();
    place.push_back(direction_place_[d]);
  }
  WeighedDirections on_circle(place, period_);
  std::vector<double> tau(window_.size(), 0.0);
  for (const std::int64_t k : h.views) {
    tau[at(k)] = taper(this->place(k, height), series_.rows);
    on_circle.add_view(own[direction_[at(k)]]);
  }
  std::stable_sort(h.views.begin(), h.views.end(),
                   [&](std::int64_t a, std::int64_t b) { return tau[at(a)] < tau[at(b)]; });
  const double most = wider_kind * std::min(h.widest_rad, usual_rad_);
  std::vector<double> weight(window_.size(), 0.0);
  double x = 0;
  std::size_t taken = 0;
  for (; taken < h.views.size(); ++taken) {
    const auto k = at(h.views[taken]);
    const std::size_t d = own[direction_[k]];
    x = tau[k];
    if (on_circle.left_by(d) > most) break;
    weight[k] = on_circle.up_to(d, x);
    on_circle.take_view(d, x);
  }
  // A view at a time: the others of its direction have the same sum.
  for (std::size_t i = taken; i < h.views.size(); ++i) {
    const auto k = at(h.views[i]);
    weight[k] = on_circle.up_to(own[direction_[k]], x);
  }
  for (const std::int64_t k : h.views)
    share_[at(k * series_.rows + height - window_[at(k)].first)] = weight[at(k)] / x / w[at(view_of_[at(k)])];
}

}  // namespace vdvr
