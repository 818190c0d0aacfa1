#include "host/verify/witness/series_to_verify.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/scan/geometry/angular_gaps.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "host/verify/witness/upright_to_verify.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr long double pi_turn = std::numbers::pi_v<long double>;
// Four times as wide, but for rounding, as build has it.
constexpr long double row_hit = 1e-9L, one_direction = 2e-6L, wider = 4 * (1 + 1e-9L);

// Of 30 s^2 (1 - s)^2 from 0 to r.
long double share_of_row(long double row, std::int64_t rows) {
  const long double from_edge = std::max(0.0L, std::min(row, static_cast<long double>(rows - 1) - row)),
                    length = std::min(10.0L, static_cast<long double>(rows - 1) / 4),
                    r = std::min(1.0L, (from_edge + 0.5L) / (length + 0.5L));
  return 10 * std::pow(r, 3.0L) - 15 * std::pow(r, 4.0L) + 6 * std::pow(r, 5.0L);
}

// The smallest angle of those that are one direction, by view.
std::vector<long double> directions_of(const std::vector<double>& theta, long double period) {
  std::vector<std::pair<long double, std::size_t>> angle;
  for (std::size_t k = 0; k < theta.size(); ++k) {
    // Folded as the angles are, in double.
    const double t = std::fmod(theta[k], static_cast<double>(period));
    angle.emplace_back(t < 0 ? t + static_cast<double>(period) : t, k);
  }
  std::sort(angle.begin(), angle.end());
  std::vector<long double> direction(theta.size());
  const long double least = angle.front().first;
  long double of_run = least;
  for (const auto& [a, k] : angle) {
    if (a - of_run > one_direction) of_run = a;
    direction[k] = a - least > period - one_direction ? least : of_run;
  }
  return direction;
}

struct Seen {
  std::size_t view;
  long double share;  // tau
};

class HeightsToVerify {
 public:
  HeightsToVerify(const ParallelGeometry& g, bool full_turn)
      : g_(g), period_(full_turn ? 2 * pi_turn : pi_turn), direction_(directions_of(g.theta_rad, period_)) {}

  [[nodiscard]] long double place(std::size_t k, std::int64_t n) const {
    return static_cast<long double>(n) + (g_.row_shift[k] - g_.row_shift.front());
  }
  [[nodiscard]] bool sees(std::size_t k, std::int64_t n) const {
    const long double y = place(k, n);
    return y >= -row_hit && y <= static_cast<long double>(g_.rows - 1) + row_hit;
  }
  [[nodiscard]] std::vector<Seen> seen(std::int64_t n) const {
    std::vector<Seen> out;
    for (std::size_t k = 0; k < g_.theta_rad.size(); ++k)
      if (sees(k, n)) out.push_back({k, share_of_row(place(k, n), g_.rows)});
    return out;
  }
  // The widest gap between directions of these views whose share is at least that.
  [[nodiscard]] long double widest(const std::vector<Seen>& seen, long double share) const {
    const std::vector<long double> d = present(seen, share);
    long double found = d.front() + period_ - d.back();
    for (std::size_t i = 1; i < d.size(); ++i) found = std::max(found, d[i] - d[i - 1]);
    return found;
  }
  // Whether nothing is missing is the same judgement as of any scan; weights are not.
  [[nodiscard]] bool all_around(const std::vector<Seen>& seen) const {
    if (seen.size() < 2) return false;
    std::vector<double> theta;
    for (const Seen& s : seen) theta.push_back(g_.theta_rad[s.view]);
    const AngularGaps gaps = angular_gaps(theta, static_cast<double>(period_));
    return !gaps.one_direction && gaps.wedges_rad().empty();
  }
  // W by view; `usual`: the widest gap of half the heights.
  [[nodiscard]] std::vector<long double> weights(const std::vector<Seen>& seen, long double usual) const {
    std::set<long double> levels;
    for (const Seen& s : seen) levels.insert(s.share);
    const long double limit = wider * std::min(usual, widest(seen, 0));
    std::vector<long double> sum(g_.theta_rad.size(), 0.0L);
    long double below = 0;
    for (const long double level : levels) {
      if (widest(seen, level) > limit) break;
      const std::vector<long double> d = present(seen, level);
      const auto index = [&](const Seen& one) {
        return std::lower_bound(d.begin(), d.end(), direction_[one.view]) - d.begin();
      };
      std::vector<std::int64_t> sharing(d.size(), 0);
      for (const Seen& one : seen)
        if (one.share >= level) ++sharing[at(index(one))];
      for (const Seen& one : seen) {
        if (one.share < level) continue;
        const auto i = index(one);
        const long double previous = i > 0 ? d[at(i - 1)] : d.back() - period_,
                          after = i + 1 < std::ssize(d) ? d[at(i + 1)] : d.front() + period_;
        sum[one.view] += (level - below) * (after - previous) / 2 / static_cast<long double>(sharing[at(i)]);
      }
      below = level;
    }
    for (long double& w : sum) w /= below;
    return sum;
  }

 private:
  [[nodiscard]] std::vector<long double> present(const std::vector<Seen>& seen, long double share) const {
    std::vector<long double> d;
    for (const Seen& s : seen)
      if (s.share >= share) d.push_back(direction_[s.view]);
    std::sort(d.begin(), d.end());
    d.erase(std::unique(d.begin(), d.end()), d.end());
    return d;
  }

  const ParallelGeometry& g_;
  long double period_;
  std::vector<long double> direction_;
};

// Heights from the lowest that any view sees on; which of them are covered.
struct Range {
  std::int64_t first = 0, count = 0;
  long double usual = 0;  // the widest gap of half the heights
};

Range covered(const HeightsToVerify& heights, const ParallelGeometry& g) {
  const auto [least, most_shift] = std::minmax_element(g.row_shift.begin(), g.row_shift.end());
  if (!(*most_shift - *least <= static_cast<double>(g.views() * g.rows)))
    throw InputError("rows_to_verify: the sample moves by more rows than all views have");
  std::int64_t low = INT64_MAX, high = INT64_MIN;
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
    const long double row_of_zero = heights.place(k, 0);
    low = std::min(low, static_cast<std::int64_t>(std::ceil(-row_of_zero - row_hit)));
    high = std::max(high, static_cast<std::int64_t>(
                              std::floor(static_cast<long double>(g.rows - 1) - row_of_zero + row_hit)));
  }
  std::vector<long double> gap(at(high - low + 1), 0.0L);  // 0: not all around
  parallel_for(std::ssize(gap), {}, "", [&](std::int64_t i) {
    const std::vector<Seen> seen = heights.seen(low + i);
    if (heights.all_around(seen)) gap[at(i)] = heights.widest(seen, 0);
  });
  std::vector<long double> sorted;
  std::copy_if(gap.begin(), gap.end(), std::back_inserter(sorted), [](long double x) { return x > 0; });
  if (sorted.empty()) throw InputError("rows_to_verify: no height is seen from every direction");
  std::sort(sorted.begin(), sorted.end());
  const long double usual = sorted[sorted.size() / 2], limit = wider * usual;
  const auto is_covered = [&](long double x) { return x > 0 && x <= limit; };
  const auto begin = std::find_if(gap.begin(), gap.end(), is_covered),
             end = std::find_if_not(begin, gap.end(), is_covered);
  if (std::any_of(end, gap.end(), is_covered))
    throw InputError("rows_to_verify: the heights that are seen from every direction are no one run");
  return {low + (begin - gap.begin()), end - begin, usual};
}

// By measured view the one that it is part of; `first` the first of each.
struct Parts {
  std::vector<std::int64_t> of, first;
};
Parts parts_of(const ParallelGeometry& g) {
  const std::vector<long double> turned = directions_of(g.theta_rad, 2 * pi_turn);
  const auto shift = [&](std::int64_t k) { return g.column_shift.empty() ? 0.0 : g.column_shift[at(k)]; };
  Parts out;
  for (std::int64_t k = 0; k < g.views(); ++k) {
    const auto same = std::find_if(out.first.begin(), out.first.end(), [&](std::int64_t f) {
      return turned[at(f)] == turned[at(k)] && shift(f) == shift(k);
    });
    out.of.push_back(same - out.first.begin());
    if (same == out.first.end()) out.first.push_back(k);
  }
  return out;
}

// One measured view's row, long double out[column].
void row_at(const float* view, const ParallelGeometry& g, const SeriesWeights& series, long double place,
            std::vector<long double>& out) {
  const std::int64_t U = g.columns;
  const auto whole = static_cast<std::int64_t>(std::llround(place));
  std::fill(out.begin(), out.end(), 0.0L);
  if (std::abs(place - static_cast<long double>(whole)) <= row_hit) {
    for (std::int64_t u = 0; u < U; ++u)
      out[at(u)] = static_cast<long double>(view[std::clamp<std::int64_t>(whole, 0, g.rows - 1) * U + u]);
    return;
  }
  const std::vector<double> weights = series(place);
  for (std::int64_t v = 0; v < g.rows; ++v)
    for (std::int64_t u = 0; u < U; ++u)
      out[at(u)] += static_cast<long double>(weights[at(v)]) * static_cast<long double>(view[v * U + u]);
}

}  // namespace

void to_all_heights(ProjectionSet& scan, bool full_turn, const RowsRoom& room) {
  ParallelGeometry& g = scan.geometry;
  const HeightsToVerify heights(g, full_turn);
  const Range range = covered(heights, g);
  const Parts parts = parts_of(g);
  ParallelGeometry joined = g;
  joined.theta_rad.clear();
  joined.column_shift.clear();
  joined.row_shift.clear();
  for (const std::int64_t k : parts.first) {
    joined.theta_rad.push_back(g.theta_rad[at(k)]);
    if (!g.column_shift.empty()) joined.column_shift.push_back(g.column_shift[at(k)]);
  }
  const std::vector<double> of_all =
      view_weights(joined.theta_rad, static_cast<double>(full_turn ? 2 * pi_turn : pi_turn)).weight;
  // [height][measured view]
  std::vector<std::vector<long double>> weights(at(range.count));
  parallel_for(range.count, {}, "", [&](std::int64_t j) {
    weights[at(j)] = heights.weights(heights.seen(range.first + j), range.usual);
  });
  const std::int64_t views = std::ssize(parts.first), U = g.columns;
  const SeriesWeights series(g.rows);
  SampleArray out(at(views * range.count * U), room(views, range.count, U),
                  "the projections of a series of heights");
  parallel_for(views, {}, "heights to verify", [&](std::int64_t view) {
    std::vector<long double> row(at(U)), sum(at(U));
    for (std::int64_t j = 0; j < range.count; ++j) {
      std::fill(sum.begin(), sum.end(), 0.0L);
      for (std::int64_t k = 0; k < g.views(); ++k) {
        const long double share = parts.of[at(k)] == view ? weights[at(j)][at(k)] / of_all[at(view)] : 0.0L;
        if (share == 0) continue;
        row_at(scan.data.data() + k * g.rows * U, g, series, heights.place(at(k), range.first + j), row);
        for (std::int64_t u = 0; u < U; ++u) sum[at(u)] += share * row[at(u)];
      }
      std::transform(sum.begin(), sum.end(), out.data() + (view * range.count + j) * U,
                     [](long double p) { return static_cast<float>(p); });
    }
  });
  joined.series = {g.rows, range.first, full_turn, g.theta_rad, g.row_shift, g.column_shift};
  joined.rows = range.count;
  scan.data = std::move(out);
  g = std::move(joined);
}

}  // namespace vdvr
