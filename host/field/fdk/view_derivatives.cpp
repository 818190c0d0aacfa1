#include "host/field/fdk/view_derivatives.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>

#include "host/base/system/wide.hpp"

namespace vdvr {
namespace {

constexpr double unit = 0x1p-53;
constexpr int highest = 6;
// Of a matrix' row times (x, y, z, 1): four products, three sums, and what the quotient adds.
constexpr double row_rounding = 8 * unit;
// One bound: fewer than 200 operations one after another on numbers >= 0, each of which may round down by a
// factor of 1 - 2^-53. Underflow is left out: it lies some 250 decades below what fp32 projections hold.
constexpr double bound_rounding = 1 + 200 * unit;

// Coefficients of U^p W^r; of sups, that of d_u^p d_v^r.
using Table = std::array<std::array<double, highest + 1>, highest + 1>;
// (a U + b W + l)^2
using Square = std::array<std::array<double, 3>, 3>;

double power(double x, int n) {
  double product = 1;
  for (int i = 0; i < n; ++i) product *= x;
  return product;
}

double factorial_ratio(int n, int m) {  // n! / m!
  double product = 1;
  for (int i = m + 1; i <= n; ++i) product *= i;
  return product;
}

// [p][r] = (n+1)! / (p+r+1)! sup |q_{u^p v^r}|, p + r <= n. Bernstein's inequality takes a factor of pi, the
// Nyquist frequency, for each order; it may start from the value or from any derivative whose sup is known.
Table weighted_sups(const DetectorSups& sups, int n) {
  constexpr double square = std::numbers::pi * std::numbers::pi;
  // Each as a fourth derivative's.
  const double from_value = square * square * sups.value, from_u = square * sups.second_u,
               from_v = square * sups.second_v;
  Table table{};
  double order_power = 1 / (square * square);  // pi^(order - 4)
  for (int order = 0; order <= n; ++order, order_power *= std::numbers::pi) {
    const double factor = factorial_ratio(n + 1, order + 1) * order_power;
    for (int p = 0; p <= order; ++p) {
      const int r = order - p;
      double least = from_value;
      if (p >= 2) least = std::min(least, from_u);
      if (r >= 2) least = std::min(least, from_v);
      if (p >= 4) least = std::min(least, sups.fourth_u);
      if (p >= 2 && r >= 2) least = std::min(least, sups.second_uv);
      if (r >= 4) least = std::min(least, sups.fourth_v);
      table[static_cast<std::size_t>(p)][static_cast<std::size_t>(r)] = factor * least;
    }
  }
  return table;
}

Square square_of(const ViewBox& box, std::size_t e) {
  const double a = box.along_u[e], b = box.along_v[e], l = box.growth[e];
  return {{{l * l, 2 * b * l, b * b}, {2 * a * l, 2 * a * b, 0}, {a * a, 0, 0}}};
}

// A row of the matrix times (x, y, z, 1), and the largest sum of magnitudes.
double row_at(const ViewMatrix& matrix, std::size_t row, const Vec3& x, double& magnitude) {
  double sum = matrix[row][3], terms = std::abs(matrix[row][3]);
  for (std::size_t e = 0; e < 3; ++e) {
    sum += matrix[row][e] * x[e];
    terms += std::abs(matrix[row][e] * x[e]);
  }
  magnitude = std::max(magnitude, terms);
  return sum;
}

// lambda is affine: least at a corner. No number where a corner is none.
double least_lambda(const ViewMatrix& matrix, std::span<const Vec3> corners) {
  double least = HUGE_VAL, magnitude = 0;
  for (const Vec3& x : corners) {
    const double lambda = row_at(matrix, 2, x, magnitude);
    if (!(lambda >= least)) least = lambda;
    if (std::isnan(lambda)) return lambda;
  }
  return least - row_rounding * magnitude;
}

// The sum over i, j of square[i][j] table[p + i][r + j], for p + r <= left: multiplying polynomials by
// `square` first and pairing them with `table` then is the same.
template <std::size_t left>
void contract(const Square& square, const Table& table, Table& out) {
  for (std::size_t p = 0; p <= left; ++p)
    for (std::size_t r = 0; p + r <= left; ++r)
      out[p][r] = square[0][0] * table[p][r] + square[0][1] * table[p][r + 1] +
                  square[0][2] * table[p][r + 2] + square[1][0] * table[p + 1][r] +
                  square[1][1] * table[p + 1][r + 1] + square[2][0] * table[p + 2][r];
}

}  // namespace

Corners box_corners(const Vec3& low, const Vec3& high) {
  Corners corners;
  for (std::size_t c = 0; c < 8; ++c)
    corners.push_back(
        {(c & 1) != 0 ? high[0] : low[0], (c & 2) != 0 ? high[1] : low[1], (c & 4) != 0 ? high[2] : low[2]});
  return corners;
}

namespace {

// What some views see of a piece: of u and v the lowest and the highest; of each row of the matrix, lambda's
// too, the largest sum of magnitudes.
constexpr std::size_t together = 8;
using OfViews = std::array<double, together>;
struct Seen {
  std::array<OfViews, 2> low{}, high{};
  std::array<OfViews, 3> magnitude{};
  OfViews lambda{};  // the least
};

// row_at of all views, in its order. `matrix`: [row][column].
using Matrices = std::array<std::array<OfViews, 4>, 3>;
inline __attribute__((always_inline)) void rows_at(const std::array<OfViews, 4>& row, const Vec3& x,
                                                   OfViews& sum, OfViews& magnitude) {
  for (std::size_t k = 0; k < together; ++k) {
    const double a = row[0][k] * x[0], b = row[1][k] * x[1], c = row[2][k] * x[2];
    sum[k] = row[3][k] + a + b + c;
    const double terms = std::abs(row[3][k]) + std::abs(a) + std::abs(b) + std::abs(c);
    magnitude[k] = terms > magnitude[k] || terms != terms ? terms : magnitude[k];  // NaN stays
  }
}

VDVR_WIDE void look(const Matrices& matrix, const Vec3* corners, std::size_t count, Seen& out) {
  Seen s = out;
  for (std::size_t c = 0; c < count; ++c) {
    OfViews lambda, place;
    rows_at(matrix[2], corners[c], lambda, s.magnitude[2]);
    for (std::size_t k = 0; k < together; ++k)
      s.lambda[k] = lambda[k] < s.lambda[k] ? lambda[k] : s.lambda[k];
    for (std::size_t i = 0; i < 2; ++i) {
      rows_at(matrix[i], corners[c], place, s.magnitude[i]);
      for (std::size_t k = 0; k < together; ++k) {
        const double at = place[k] / lambda[k];
        s.low[i][k] = at < s.low[i][k] ? at : s.low[i][k];
        s.high[i][k] = s.high[i][k] < at ? at : s.high[i][k];
      }
    }
  }
  out = s;
}

// u and v are quotients of affine functions whose denominator, lambda, is positive on the piece: on a segment
// they rise all along, or fall. So their extremes over the piece lie at corners, and the largest |X_e|,
// X_e being affine in u and v, where u and v are extreme. lambda is affine too.
ViewBox box_of(const ViewMatrix& matrix, const Seen& seen, std::size_t k) {
  ViewBox box;
  // NaN of a corner stays in the magnitude.
  box.lambda_min = seen.lambda[k] - row_rounding * seen.magnitude[2][k];
  if (!(box.lambda_min > 0)) return box;
  for (std::size_t i = 0; i < 2; ++i) {
    const double least = seen.low[i][k], most = seen.high[i][k];
    const double largest = std::max(std::abs(least), std::abs(most));
    const double error =
        row_rounding * (seen.magnitude[i][k] + largest * seen.magnitude[2][k]) / box.lambda_min;
    for (std::size_t e = 0; e < 3; ++e) {
      const double l = matrix[2][e];
      const double x = std::max(std::abs(matrix[i][e] - l * least), std::abs(matrix[i][e] - l * most));
      // X may cancel, so its rounding is that of its terms.
      (i == 0 ? box.along_u : box.along_v)[e] =
          x + std::abs(l) * error + 4 * unit * (std::abs(matrix[i][e]) + std::abs(l) * largest);
    }
  }
  for (std::size_t e = 0; e < 3; ++e) box.growth[e] = std::abs(matrix[2][e]);
  return box;
}

}  // namespace

void view_boxes(std::span<const ViewMatrix> views, std::span<const Vec3> corners, std::span<ViewBox> out) {
  if (out.size() != views.size()) throw std::logic_error("view_boxes: one box for each view");
  for (std::size_t first = 0; first < views.size(); first += together) {
    const std::size_t n = std::min(together, views.size() - first);
    Matrices matrices;
    for (std::size_t k = 0; k < together; ++k)
      for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t e = 0; e < 4; ++e) matrices[row][e][k] = views[first + std::min(k, n - 1)][row][e];
    Seen seen;
    for (std::size_t i = 0; i < 2; ++i) {
      seen.low[i].fill(HUGE_VAL);
      seen.high[i].fill(-HUGE_VAL);
    }
    seen.lambda.fill(HUGE_VAL);
    look(matrices, corners.data(), corners.size(), seen);
    for (std::size_t k = 0; k < n; ++k) out[first + k] = box_of(views[first + k], seen, k);
  }
}

ViewBox view_box(const ViewMatrix& matrix, std::span<const Vec3> corners) {
  ViewBox box;
  view_boxes({&matrix, 1}, corners, {&box, 1});
  return box;
}

double derivative_bound(const ViewBox& box, const std::array<int, 3>& orders, const DetectorSups& sups) {
  const int n = orders[0] + orders[1] + orders[2];
  if (*std::min_element(orders.begin(), orders.end()) < 0 || n > highest)
    throw std::logic_error("derivative_bound: orders below 0 or together above 6");
  if (!(box.lambda_min > 0)) return HUGE_VAL;
  Table product{};  // of the linear factors
  product[0][0] = 1;
  for (std::size_t e = 0; e < 3; ++e)
    for (int i = 0; i < orders[e]; ++i)
      for (std::size_t p = highest + 1; p-- > 0;)  // downwards, so that lower coefficients are still old
        for (std::size_t r = highest + 1; r-- > 0;)
          product[p][r] = box.growth[e] * product[p][r] + (p > 0 ? box.along_u[e] * product[p - 1][r] : 0) +
                          (r > 0 ? box.along_v[e] * product[p][r - 1] : 0);
  const Table table = weighted_sups(sups, n);
  double sum = 0;
  for (std::size_t p = 0; p <= highest; ++p)
    for (std::size_t r = 0; p + r <= highest; ++r) sum += product[p][r] * table[p][r];
  return sum / power(box.lambda_min, 2 + n) * bound_rounding;
}

std::size_t SixthSups::place(const std::array<int, 3>& orders) {
  for (const int order : orders)
    if (order < 0 || order % 2 != 0) throw std::logic_error("SixthSups: an order that is odd or below 0");
  if (orders[0] + orders[1] + orders[2] != highest)
    throw std::logic_error("SixthSups: orders not 6 together");
  return static_cast<std::size_t>(2 * orders[0] + orders[1] / 2);
}

double SixthSups::along(int e, int f, int g) const {
  std::array<int, 3> orders{};
  for (const int axis : {e, f, g}) orders.at(static_cast<std::size_t>(axis)) += 2;
  return at(orders);
}

SixthSups sixth_sups(std::span<const ViewMatrix> views, std::span<const DetectorSups> sups,
                     std::span<const Vec3> corners) {
  if (views.size() != sups.size()) throw std::logic_error("sixth_sups: one set of sups for each view");
  SixthSups out;
  constexpr std::array<std::size_t, 3> step{4, 1, 0};  // to a place with one more square along an axis
  std::vector<ViewBox> boxes(views.size());
  view_boxes(views, corners, boxes);
  for (std::size_t k = 0; k < views.size(); ++k) {
    const ViewBox& box = boxes[k];
    if (!(box.lambda_min > 0)) {
      out.sums_.fill(HUGE_VAL);
      return out;
    }
    const Table table = weighted_sups(sups[k], highest);
    const double weight = 1 / power(box.lambda_min, 2 + highest);
    const std::array<Square, 3> square{square_of(box, 0), square_of(box, 1), square_of(box, 2)};
    Table four, two, none;  // pairs with what is left of order 4, 2 and 0
    for (std::size_t e = 0; e < 3; ++e) {
      contract<4>(square[e], table, four);
      for (std::size_t f = e; f < 3; ++f) {
        contract<2>(square[f], four, two);
        for (std::size_t g = f; g < 3; ++g) {
          contract<0>(square[g], two, none);
          out.sums_[step[e] + step[f] + step[g]] += weight * none[0][0];
        }
      }
    }
  }
  // A sum of K terms >= 0 rounds down by a factor of 1 - K 2^-53 at most.
  for (double& sum : out.sums_) sum *= bound_rounding + static_cast<double>(views.size()) * unit;
  return out;
}

double sum_of_weights(std::span<const ViewMatrix> views, std::span<const double> values,
                      std::span<const Vec3> corners, int power_of_lambda) {
  if (views.size() != values.size()) throw std::logic_error("sum_of_weights: one value for each view");
  double sum = 0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const double lambda = least_lambda(views[k], corners);
    if (!(lambda > 0)) return HUGE_VAL;
    sum += values[k] / power(lambda, power_of_lambda);
  }
  return sum * (bound_rounding + static_cast<double>(views.size()) * unit);
}

}  // namespace vdvr
