#include "host/picture/pixel/range_table.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "host/base/system/outward.hpp"
#include "shared/certify_params.h"

namespace vdvr {
namespace {

constexpr float kNone = -std::numeric_limits<float>::infinity();
// Stands for an extinction without end: exp2 of minus its product with any length that fp32 tells from 0 is
// 0.
constexpr float kOpaque = 1e30f;

double halvings(double opacity) { return -std::log1p(-opacity) / std::log(2.0); }

/// The eight numbers of a row, whose larger ones hold for both of two rows.
using Row = std::array<float, 8>;
constexpr Row kEmpty{0, kNone, kNone, kNone, kNone, kNone, kNone, kNone};

Row joined(const Row& a, const Row& b) {
  Row r{};
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = std::max(a[i], b[i]);
  return r;
}

/// Takes in the values of a straight piece from `a` to `b`.
void add_piece(Row& row, const TransferPoint& a, const TransferPoint& b) {
  for (const TransferPoint* p : {&a, &b}) {
    // An opacity between two points is rounded. At 0 none is: there it is what the points say.
    const double most = p->opacity > 0 ? std::min(1.0, p->opacity + 0x1p-50) : 0,
                 least = std::max(0.0, p->opacity - 0x1p-50);
    row[0] = std::max(row[0], most <= 0   ? 0.0f
                              : most >= 1 ? kOpaque
                                          : std::min(kOpaque, up(halvings(most) * (1 + 0x1p-40))));
    row[1] = std::max(
        row[1],
        -std::max(0.0f, down(std::min(static_cast<double>(kOpaque), halvings(least) * (1 - 0x1p-40)))));
  }
  // Beside an end at which nothing shows its colour does.
  if (!(a.opacity > 0 || b.opacity > 0)) return;
  for (const TransferPoint* p : {&a, &b})
    for (std::size_t c = 0; c < 3; ++c) {
      row[2 + c] = std::max(row[2 + c], up(p->rgb[c]));
      row[5 + c] = std::max(row[5 + c], -down(p->rgb[c]));
    }
}

TransferPoint between(const TransferPoint& a, const TransferPoint& b, double value) {
  if (value <= a.value) return a;
  if (value >= b.value) return b;
  const double t = (value - a.value) / (b.value - a.value);
  TransferPoint p;
  p.value = value;
  for (std::size_t c = 0; c < 3; ++c) p.rgb[c] = (1 - t) * a.rgb[c] + t * b.rgb[c];
  p.opacity = (1 - t) * a.opacity + t * b.opacity;
  return p;
}

/// All values of [from, to], both closed. `first` is a piece before which nothing lies in it, and moves on.
Row row_between(const std::vector<TransferPoint>& points, double from, double to, std::size_t& first) {
  Row row = kEmpty;
  if (from <= points.front().value) add_piece(row, points.front(), points.front());
  if (to >= points.back().value) add_piece(row, points.back(), points.back());
  while (first + 1 < points.size() && points[first + 1].value < from) ++first;
  for (std::size_t i = first; i + 1 < points.size() && points[i].value <= to; ++i) {
    const TransferPoint &a = points[i], &b = points[i + 1];
    if (b.value < from) continue;
    if (a.value == b.value) continue;  // of a jump the pieces beside it, or the ends, have either side
    add_piece(row, between(a, b, from), between(a, b, to));
  }
  return row;
}

/// Of the straight piece that begins at a value or holds it.
TransferPoint above(const std::vector<TransferPoint>& points, double value) {
  std::size_t next = 0;
  while (next < points.size() && points[next].value <= value) ++next;
  if (next == 0) return points.front();
  return next == points.size() ? points.back() : between(points[next - 1], points[next], value);
}

/// Edges and bends, in rows behind those of ranges.
class Stretches {
 public:
  Stretches(const std::vector<TransferPoint>& points, RangeTable& table) : points_(points), t_(table) {}

  template <class Edge>
  void add(const Edge& edge) {
    t_.first_edge = static_cast<int>(t_.rows.size());
    put(points_.front());
    for (int i = 1; i < t_.bins; ++i) put(above(points_, edge(i)));
    put(points_.back());
    t_.first_bend = static_cast<int>(t_.rows.size());
    std::vector<cl_int> bends(static_cast<std::size_t>(t_.bins) + 1, 0);
    for (std::size_t i = 0; i < points_.size();) {
      std::size_t end = i + 1;
      while (end < points_.size() && points_[end].value == points_[i].value) ++end;
      put(points_[i]);
      put(points_[end - 1]);
      ++bends[static_cast<std::size_t>(bin_of(points_[i].value, edge)) + 1];
      i = end;
    }
    std::partial_sum(bends.begin(), bends.end(), bends.begin());
    t_.next_shown.insert(t_.next_shown.end(), bends.begin(), bends.end());
  }

 private:
  /// A bend at the edge of two bins is in the lower one, and the edge above it.
  template <class Edge>
  [[nodiscard]] int bin_of(double value, const Edge& edge) const {
    int low = 0, high = t_.bins - 1;
    while (low < high) {
      const int middle = (low + high) / 2;
      if (value <= edge(middle + 1)) high = middle;
      else low = middle + 1;
    }
    return low;
  }
  void put(const TransferPoint& p) {
    const double t = std::min(static_cast<double>(kOpaque), halvings(p.opacity));
    t_.rows.push_back({{static_cast<float>(t), static_cast<float>(p.rgb[0]), static_cast<float>(p.rgb[1]),
                        static_cast<float>(p.rgb[2])}});
    // An opacity between two points is rounded, by 2^-50 at most.
    if (p.opacity > 0 && p.opacity < 1) {
      const double most =
          std::min(static_cast<double>(kOpaque), halvings(std::min(1.0, p.opacity + 0x1p-50)));
      t_.extinction_error = std::max(t_.extinction_error, up((most - t) * (1 + 0x1p-20)));
    }
  }

  const std::vector<TransferPoint>& points_;
  RangeTable& t_;
};

}  // namespace

RangeTable make_range_table(const TransferFunction& transfer, double bound, bool or_clear) {
  const auto& points = transfer.points;
  RangeTable t;
  const double first = points.front().value, width = std::max(points.back().value - first, 1e-30);
  const double wanted = bound > 0 ? 32 * width / bound : 16384.0;
  t.bins = static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::clamp(wanted, 2048.0, 16384.0))));
  t.lo = down(first);
  t.scale = down(t.bins / width);
  const auto edge = [&](int i) { return static_cast<double>(t.lo) + i / static_cast<double>(t.scale); };
  constexpr double endless = std::numeric_limits<double>::infinity();
  std::vector<Row> rows;
  std::size_t piece = 0;
  for (int i = 0; i < t.bins; ++i)
    rows.push_back(
        row_between(points, i == 0 ? -endless : edge(i), i + 1 == t.bins ? endless : edge(i + 1), piece));
  // What is clear has no extinction and no colour.
  if (or_clear)
    for (Row& row : rows) row[1] = 0;
  Row all = kEmpty;
  t.next_shown.assign(static_cast<std::size_t>(t.bins), t.bins);
  for (int i = t.bins - 1, next = t.bins; i >= 0; --i) {
    const Row& row = rows[static_cast<std::size_t>(i)];
    all = joined(all, row);
    if (row[0] > 0) next = i;
    t.next_shown[static_cast<std::size_t>(i)] = next;
  }
  for (std::size_t c = 0; c < 3; ++c) {
    t.colour_hi[c] = all[2 + c];
    t.colour_lo[c] = -all[5 + c];
  }
  for (int run = 1; run <= t.bins; run *= 2) {
    for (const Row& r : rows) {
      t.rows.push_back({{r[0], r[1], r[2], r[3]}});
      t.rows.push_back({{r[4], r[5], r[6], r[7]}});
    }
    std::vector<Row> twice = rows;
    for (std::size_t i = 0; i < rows.size(); ++i)
      twice[i] = joined(rows[i], rows[std::min(i + static_cast<std::size_t>(run), rows.size() - 1)]);
    rows = std::move(twice);
  }
  Stretches(points, t).add(edge);
  return t;
}

bool RangeTable::is_clear(float from, float to) const {
  const auto bin = [&](float value, float outward) {
    const float x = (value - lo) * scale + outward;
    return static_cast<std::size_t>(std::min(x > 0 ? x : 0.0f, static_cast<float>(bins - 1)));
  };
  return next_shown[bin(from, -VDVR_BIN_MARGIN)] > static_cast<cl_int>(bin(to, VDVR_BIN_MARGIN));
}

}  // namespace vdvr
