// Directions and wedges of a scan; see angular_gaps.hpp. Every comparison is between gaps of the scan itself,
// by the angle that they cover and not by their number: of a scan that sees a direction many times most gaps
// are tiny.
#include "host/scan/geometry/angular_gaps.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <utility>

namespace vdvr {
namespace {

// Views within a thousandth of the gaps at both their ends share one weight, and so do three or more within a
// quarter of these: their spread e adds w e^2 / 24 q'' to the error of the sum over directions, whose own is
// w g^2 / 24 q'', a sixteenth of it. Two share alike without that.
constexpr double coincident = 1e-3, nearly_coincident = 0.25;
// For the search for wedges views within a hundredth of the gaps at both their ends are one direction.
constexpr double one_direction = 0.01;
// What is four times as wide as what it is compared with is of another kind.
constexpr double another_kind = 4;
// Views in as many bursts sample all directions by their bursts; fewer leave wedges between them.
constexpr std::size_t fewest_bursts = 8;
// So many gaps of one kind side by side are a coarse part of the scan. Fewer are a wedge with stray views.
constexpr std::size_t coarse_part = 4;
// Of uniformly random angles, which are the most irregular way to see all directions, gaps are exponential of
// some mean: half of the angle lies in gaps below 1.678 means, where (1 + x) exp(-x) = 1/2, and one of m gaps
// exceeds ln m + 8 means in one of exp(8) = 3,000 scans.
constexpr double random_median = 1.678, rare = 8;

double folded(double theta, double period) {
  const double t = std::fmod(theta, period);
  return t < 0 ? t + period : t;
}

// Points on a circle in ascending order; gap[i] leads from point i to the next.
struct Circle {
  std::vector<double> place, gap;

  Circle(std::vector<double> ascending, double period) : place(std::move(ascending)), gap(place.size()) {
    const std::size_t n = place.size();
    for (std::size_t i = 0; i + 1 < n; ++i) gap[i] = place[i + 1] - place[i];
    gap[n - 1] = place[0] + period - place[n - 1];
  }
  [[nodiscard]] std::size_t size() const { return place.size(); }
  [[nodiscard]] std::size_t next(std::size_t i) const { return i + 1 < size() ? i + 1 : 0; }
  [[nodiscard]] std::size_t previous(std::size_t i) const { return (i > 0 ? i : size()) - 1; }
};

// Joins points by ascending gaps; each cluster is a run of points.
class Clusters {
 public:
  explicit Clusters(const Circle& circle)
      : circle_(circle),
        parent_(circle.size()),
        first_(circle.size()),
        last_(circle.size()),
        extent_(circle.size(), 0.0) {
    for (auto* list : {&parent_, &first_, &last_}) std::iota(list->begin(), list->end(), std::size_t{0});
  }
  // The clusters at both sides of the gap behind point i. Returns the name of what they become.
  std::size_t join(std::size_t i) {
    const std::size_t a = find(i), b = find(circle_.next(i));
    parent_[b] = a;
    last_[a] = last_[b];
    extent_[a] += circle_.gap[i] + extent_[b];
    return a;
  }
  [[nodiscard]] std::size_t first(std::size_t a) const { return first_[a]; }
  [[nodiscard]] std::size_t last(std::size_t a) const { return last_[a]; }
  [[nodiscard]] double extent(std::size_t a) const { return extent_[a]; }
  // The narrower of the gaps at both ends.
  [[nodiscard]] double aside(std::size_t a) const {
    return std::min(circle_.gap[circle_.previous(first_[a])], circle_.gap[last_[a]]);
  }

 private:
  std::size_t find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  const Circle& circle_;
  std::vector<std::size_t> parent_, first_, last_;
  std::vector<double> extent_;
};

// How narrow a run must be, as a share of the gaps at both its ends: one of two points, one of more.
struct Narrow {
  double two, more;
};

// Which gaps lie within the widest runs that are so narrow. Runs do not reach across `wedge`, and at least
// one gap stays open.
std::vector<bool> closed_gaps(const Circle& circle, Narrow narrow, const std::vector<bool>& wedge) {
  const std::size_t n = circle.size();
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < n; ++i)
    if (!wedge[i]) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return circle.gap[a] < circle.gap[b]; });
  Clusters clusters(circle);
  std::vector<bool> closed(n, false);
  std::size_t left = n;
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  for (const std::size_t i : order) {
    if (left-- == 1) break;
    const std::size_t a = clusters.join(i);
    const bool two = circle.next(clusters.first(a)) == clusters.last(a);
    if (clusters.extent(a) <= (two ? narrow.two : narrow.more) * clusters.aside(a))
      runs.emplace_back(clusters.first(a), clusters.last(a));
  }
  // Later runs hold earlier ones. Backwards, what is closed already need not be walked again.
  for (auto run = runs.rbegin(); run != runs.rend(); ++run)
    for (std::size_t i = run->first; i != run->second && !closed[i]; i = circle.next(i)) closed[i] = true;
  return closed;
}

// Points between gaps that are not closed, in ascending order. Those of the first run that lie before the
// seam come last in it.
struct Run {
  std::vector<std::size_t> points;
  std::size_t before_seam = 0;

  [[nodiscard]] std::size_t last() const {
    return before_seam > 0 ? points[points.size() - before_seam - 1] : points.back();
  }
  [[nodiscard]] double mean(const std::vector<double>& place, double period) const {
    double sum = 0;
    for (std::size_t p = 0; p < points.size(); ++p)
      sum += p < points.size() - before_seam ? place[points[p]] : place[points[p]] - period;
    return sum / static_cast<double>(points.size());
  }
};

std::vector<Run> runs_of(const std::vector<bool>& closed) {
  const std::size_t n = closed.size();
  std::vector<Run> runs{{{0}}};
  for (std::size_t i = 1; i < n; ++i) {
    if (closed[i - 1]) runs.back().points.push_back(i);
    else runs.push_back({{i}});
  }
  if (runs.size() > 1 && closed[n - 1]) {
    const auto& back = runs.back().points;
    runs.front().points.insert(runs.front().points.end(), back.begin(), back.end());
    runs.front().before_seam = back.size();
    runs.pop_back();
  }
  return runs;
}

// More than half of what the gaps cover lies in gaps of at most that, where each wedge beside them counts as
// one such gap.
double usual_gap(std::span<const double> descending, std::size_t wedges) {
  const double whole = std::accumulate(descending.begin(), descending.end(), 0.0);
  // Of equal gaps half is half whatever their rounding.
  constexpr double more_than_half = 0.5 + 1e-9;
  double sum = 0;
  for (std::size_t i = descending.size(); i-- > 0;) {
    sum += descending[i];
    if (sum > more_than_half * (whole + static_cast<double>(wedges) * descending[i])) return descending[i];
  }
  return descending.empty() ? 0 : descending.front();
}

// Whether gap i lies among at least `coarse_part` side by side that are of its kind or wider.
bool in_coarse_part(const Circle& circle, std::size_t i) {
  const double least = circle.gap[i] / another_kind;
  std::size_t run = 1;
  for (std::size_t k = circle.next(i); k != i && circle.gap[k] >= least; k = circle.next(k))
    if (++run >= coarse_part) return true;
  for (std::size_t k = circle.previous(i); k != i && circle.gap[k] >= least; k = circle.previous(k))
    if (++run >= coarse_part) return true;
  return false;
}

// The widest gaps, as many as possible, are wedges if they stand apart from all others: by a void of a factor
// four in the order of widths, or by what uniformly random angles would have.
std::vector<bool> wedges_of(const Circle& circle) {
  const std::size_t m = circle.size();
  std::vector<std::size_t> order(m);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return circle.gap[a] > circle.gap[b]; });
  std::vector<double> descending;
  for (const std::size_t i : order) descending.push_back(circle.gap[i]);
  const double limit = (std::log(static_cast<double>(m)) + rare) / random_median;
  std::size_t found = 0;
  for (std::size_t j = 1; j < std::min(fewest_bursts, m) &&
                          (j == 1 || another_kind * static_cast<double>(j) <= static_cast<double>(m));
       ++j) {
    if (in_coarse_part(circle, order[j - 1])) break;
    const double narrowest = descending[j - 1], next = descending[j];
    if (narrowest > another_kind * next ||
        (narrowest > 2 * next && narrowest > limit * usual_gap(std::span(descending).subspan(j), j)))
      found = j;
  }
  std::vector<bool> wedge(m, false);
  for (std::size_t j = 0; j < found; ++j) wedge[order[j]] = true;
  return wedge;
}

// Whether gaps between bursts of views, four times as wide as any gap beside them, make up a third of the
// period. (Of uniformly random angles such gaps make up a sixth.) `views` without the gaps of wedges.
bool in_bursts(const Circle& views, const std::vector<bool>& wedge, double period) {
  const auto groups = runs_of(closed_gaps(views, {nearly_coincident, nearly_coincident}, wedge));
  const std::size_t m = groups.size();
  double sum = 0;
  for (std::size_t g = 0; g < m; ++g) {
    const auto gap = [&](std::size_t i) { return views.gap[groups[i % m].last()]; };
    if (!wedge[groups[g].last()] && gap(g) > another_kind * std::max(gap(g + m - 1), gap(g + 1)))
      sum += gap(g);
  }
  return 3 * sum > period;
}

// In descending order.
std::vector<double> gaps_of(const std::vector<Direction>& directions, bool wedges) {
  std::vector<double> gaps;
  for (const Direction& direction : directions)
    if (direction.wedge_after == wedges) gaps.push_back(direction.gap_after_rad);
  std::sort(gaps.begin(), gaps.end(), std::greater<>());
  return gaps;
}

}  // namespace

std::vector<double> AngularGaps::wedges_rad() const { return gaps_of(directions, true); }

double AngularGaps::widest_filled_rad() const {
  const std::vector<double> gaps = gaps_of(directions, false);
  return gaps.empty() ? 0 : gaps.front();
}

AngularGaps angular_gaps(const std::vector<double>& theta_rad, double period) {
  const std::size_t n = theta_rad.size();
  AngularGaps out;
  if (n == 0) return out;
  std::vector<double> angle(n);
  std::transform(theta_rad.begin(), theta_rad.end(), angle.begin(),
                 [&](double theta) { return folded(theta, period); });
  std::vector<std::size_t> view(n);
  std::iota(view.begin(), view.end(), std::size_t{0});
  std::stable_sort(view.begin(), view.end(),
                   [&](std::size_t a, std::size_t b) { return angle[a] < angle[b]; });
  std::vector<double> ascending(n);
  for (std::size_t i = 0; i < n; ++i) ascending[i] = angle[view[i]];

  // Wedges are sought between directions, and views joined afterwards: a short arc is not one direction
  // because what is missing is wide.
  Circle views(std::move(ascending), period);
  std::vector<bool> wedge(n, false);
  const std::vector<Run> directions = runs_of(closed_gaps(views, {one_direction, one_direction}, wedge));
  std::vector<double> places;
  for (const Run& run : directions) places.push_back(run.mean(views.place, period));
  const Circle between(std::move(places), period);
  const std::vector<bool> found = wedges_of(between);
  std::vector<double> seen;
  for (std::size_t r = 0; r < directions.size(); ++r) {
    if (!found[r]) seen.push_back(between.gap[r]);
    wedge[directions[r].last()] = found[r];
  }
  std::sort(seen.begin(), seen.end(), std::greater<>());
  // Beside a wedge views are as near to each other as they are elsewhere.
  const double usual = usual_gap(seen, directions.size() - seen.size());
  for (std::size_t i = 0; i < n; ++i)
    if (wedge[i]) views.gap[i] = std::min(views.gap[i], usual);
  const std::vector<bool> closed = closed_gaps(views, {coincident, nearly_coincident}, wedge);

  for (const Run& run : runs_of(closed)) {
    Direction direction;
    direction.place_rad = run.mean(views.place, period);
    direction.wedge_after = wedge[run.last()];
    for (const std::size_t i : run.points) direction.views.push_back(view[i]);
    out.directions.push_back(std::move(direction));
  }
  const std::size_t m = out.directions.size();
  if (m == 1) out.directions[0].gap_after_rad = period;
  for (std::size_t d = 0; m > 1 && d < m; ++d)
    out.directions[d].gap_after_rad =
        (d + 1 < m ? out.directions[d + 1].place_rad : out.directions[0].place_rad + period) -
        out.directions[d].place_rad;
  const std::vector<double> filled = gaps_of(out.directions, false);
  out.usual_rad = usual_gap(filled, m - filled.size());
  out.doubtful = out.widest_filled_rad() > another_kind * out.usual_rad || in_bursts(views, wedge, period);
  out.one_direction = directions.size() == 1;
  return out;
}

}  // namespace vdvr
