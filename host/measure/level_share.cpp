#include "host/measure/level_share.hpp"

#include <algorithm>
#include <cmath>

namespace vdvr {
namespace {

// Of the largest corner: far above what some dozens of interpolations in double precision lose.
constexpr double rounding = 0x1p-40;
// A slope below this share of all counts as distance from the affine function: the closed form divides by it.
constexpr double flat = 1e-4;
// What the closed form may err by: 2^-50 over six times the product of slopes that are not flat.
constexpr double closed_form_error = 1e-10;

// The share of the unit cube where m1 x + m2 y + m3 z <= a, of 0 <= m1 <= m2 <= m3 with sum 1 and a <= 1/2
// (Scardovelli and Zaleski, J. Comput. Phys. 164, 2000). m1, or m1 and m2, may be 0, else at least `flat`.
double share_below_half(double a, double m1, double m2, double m3) {
  if (a <= 0) return 0;
  if (m2 == 0) return a;
  if (m1 == 0) return a < m2 ? a * a / (2 * m2 * m3) : (2 * a - m2) / (2 * m3);
  const double m12 = m1 + m2;
  if (a < m1) return a * a * a / (6 * m1 * m2 * m3);
  if (a < m2) return a * (a - m1) / (2 * m2 * m3) + m1 * m1 / (6 * m2 * m3);
  if (a >= m12 && m12 <= m3) return (2 * a - m12) / (2 * m3);
  const double sum = m1 * m1 * (m1 - 3 * a) + m2 * m2 * (m2 - 3 * a) +
                     (a < m3 ? a * a * (3 * m12 - a) : a * a * (3 - 2 * a) + m3 * m3 * (m3 - 3 * a));
  return sum / (6 * m1 * m2 * m3);
}

// The share where the affine function is at least t, slopes positive in ascending order with flat ones 0.
double share_sorted(double middle, const Vec3& m, double t) {
  const double reach = m[0] + m[1] + m[2];
  if (!(reach > 0)) return middle >= t ? 1 : 0;
  const double a = 0.5 + 0.5 * (middle - t) / reach;
  if (a <= 0) return 0;
  if (a >= 1) return 1;
  const double x = m[0] / reach, y = m[1] / reach, z = m[2] / reach;
  return a <= 0.5 ? share_below_half(a, x, y, z) : 1 - share_below_half(1 - a, x, y, z);
}

// Absolute slopes in ascending order; what is flat is 0, and its reach is in the last entry.
struct SortedSlopes {
  Vec3 slope{};
  double dropped = 0;
};
SortedSlopes sorted(const Vec3& slope) {
  SortedSlopes out;
  for (std::size_t a = 0; a < 3; ++a) out.slope[a] = std::abs(slope[a]);
  std::sort(out.slope.begin(), out.slope.end());
  const double least = flat * (out.slope[0] + out.slope[1] + out.slope[2]);
  for (double& s : out.slope) {
    if (s >= least) break;
    out.dropped += s;
    s = 0;
  }
  return out;
}

}  // namespace

AffineForm affine_of(const Corners& v) {
  AffineForm form;
  const double x0 = v[1] - v[0], x1 = v[3] - v[2], x2 = v[5] - v[4], x3 = v[7] - v[6];
  const double y0 = v[2] - v[0], y1 = v[3] - v[1], y2 = v[6] - v[4], y3 = v[7] - v[5];
  form.slope = {(x0 + x1 + x2 + x3) / 8, (y0 + y1 + y2 + y3) / 8,
                (v[4] + v[5] + v[6] + v[7] - v[0] - v[1] - v[2] - v[3]) / 8};
  form.middle = (v[0] + v[1] + v[2] + v[3] + v[4] + v[5] + v[6] + v[7]) / 8;
  // What is left are the products xy, xz, yz and xyz: a trilinear function again, largest and least at
  // corners.
  const double xy = (x1 - x0 + x3 - x2) / 8, xz = (x2 - x0 + x3 - x1) / 8, yz = (y2 - y0 + y3 - y1) / 8,
               xyz = (x3 - x2 - x1 + x0) / 8;
  const auto [least, largest] = std::minmax_element(v.begin(), v.end());
  const double lost = rounding * std::max(std::abs(*least), std::abs(*largest));
  for (std::size_t i = 0; i < 8; ++i) {
    const double x = (i & 1) != 0 ? 1 : -1, y = (i & 2) != 0 ? 1 : -1, z = (i & 4) != 0 ? 1 : -1,
                 rest = x * y * xy + x * z * xz + y * z * yz + x * y * z * xyz;
    form.below = std::max(form.below, -rest);
    form.above = std::max(form.above, rest);
  }
  form.below += lost;
  form.above += lost;
  form.bend = {std::abs(xy) + std::abs(xz), std::abs(xy) + std::abs(yz), std::abs(xz) + std::abs(yz)};
  form.least = *least - lost;
  form.largest = *largest + lost;
  return form;
}

Interval share_above(const AffineForm& f, double t) {
  if (f.least >= t) return {1, 1};
  if (f.largest < t) return {0, 0};
  const SortedSlopes m = sorted(f.slope);
  const double lo = share_sorted(f.middle, m.slope, t + f.below + m.dropped),
               hi = share_sorted(f.middle, m.slope, t - f.above - m.dropped);
  return {std::max(0.0, lo - closed_form_error), std::min(1.0, hi + closed_form_error)};
}

std::size_t most_bent(const AffineForm& form) {
  return static_cast<std::size_t>(std::max_element(form.bend.begin(), form.bend.end()) - form.bend.begin());
}

// The plane's section of the box over its steepest slope: the largest section is 1 there, one that cuts off a
// corner is a triangle.
double open_near(const AffineForm& f, double t) {
  if (f.least >= t || f.largest < t) return 0;
  const double x = std::abs(f.slope[0]), y = std::abs(f.slope[1]), z = std::abs(f.slope[2]),
               steepest = std::max({x, y, z}), width = f.below + f.above;
  if (!(width < 2 * steepest)) return 1;
  const double corner = std::max(0.0, 0.5 * (x + y + z - std::abs(t - f.middle) + width)),
               section = corner * corner * steepest;
  // Slopes are half of what the function changes by along a side.
  const double share = section < 2 * x * y * z ? section / (2 * x * y * z) : 1;
  return width / (2 * steepest) * share;
}

std::array<Part, 2> split(const Part& part, std::size_t axis, double at) {
  std::array<Part, 2> out{part, part};
  const double f = std::clamp((at - part.low[axis]) / (part.high[axis] - part.low[axis]), 0.0, 1.0);
  out[0].high[axis] = out[1].low[axis] = at;
  const std::size_t bit = std::size_t{1} << axis;
  for (std::size_t i = 0; i < 8; ++i) {
    if (i & bit) continue;
    const double between = (1 - f) * part.value[i] + f * part.value[i | bit];
    out[0].value[i | bit] = out[1].value[i] = between;
  }
  return out;
}

std::array<Part, 2> halves(const Part& part, std::size_t axis) {
  return split(part, axis, part.low[axis] + 0.5 * (part.high[axis] - part.low[axis]));
}

std::size_t longest_side(const Part& part) {
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a)
    if (part.high[a] - part.low[a] > part.high[axis] - part.low[axis]) axis = a;
  return axis;
}

Part clipped_to(const Part& part, const Vec3& low, const Vec3& high) {
  Part out = part;
  for (std::size_t a = 0; a < 3; ++a) {
    if (low[a] >= out.high[a] || high[a] <= out.low[a]) {
      out.high = out.low;
      return out;
    }
    if (low[a] > out.low[a]) out = split(out, a, low[a])[1];
    if (high[a] < out.high[a]) out = split(out, a, high[a])[0];
  }
  return out;
}

}  // namespace vdvr
