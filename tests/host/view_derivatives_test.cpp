// Derivatives of a cone-beam view: the identity they rest on, and bounds that waves do not exceed but reach.
#define BOOST_TEST_MODULE view_derivatives
#include "host/field/fdk/view_derivatives.hpp"

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "tests/support/cone_scans.hpp"
#include "tests/support/tolerance.hpp"

namespace vdvr {
namespace {

using Long = boost::multiprecision::cpp_bin_float_100;
using testing::cone_of;
using testing::ConeShape;

constexpr double pi = std::numbers::pi;

// q = amplitude cos(w_u u + w_v v + phase)
struct Wave {
  double amplitude = 1, w_u = 0, w_v = 0, phase = 0;
  /// With those of the fourth derivatives, or as if nobody had looked.
  [[nodiscard]] DetectorSups sups(bool fourth = false) const {
    const double a = std::abs(amplitude), u = w_u * w_u, v = w_v * w_v;
    return fourth ? DetectorSups{a, a * u, a * v, a * u * u, a * u * v, a * v * v}
                  : DetectorSups{a, a * u, a * v};
  }
};

template <typename T>
T row_of(const ViewMatrix& m, std::size_t i, const std::array<T, 3>& x) {
  return m[i][0] * x[0] + m[i][1] * x[1] + m[i][2] * x[2] + m[i][3];
}

// The cosine's n-th derivative.
template <typename T>
T cosine(const T& x, int n) {
  using std::cos;
  using std::sin;
  switch (n % 4) {
    case 0:
      return cos(x);
    case 1:
      return -sin(x);
    case 2:
      return -cos(x);
    default:
      return sin(x);
  }
}

template <typename T>
T field(const ViewMatrix& m, const Wave& q, const std::array<T, 3>& x) {
  const T lambda = row_of(m, 2, x);
  const T argument = q.w_u * row_of(m, 0, x) / lambda + q.w_v * row_of(m, 1, x) / lambda + q.phase;
  return q.amplitude * cosine(argument, 0) / (lambda * lambda);
}

// The theorem, subset by subset: D_S of a wave along X_e is a product of w . X_e.
template <typename T>
T derivative(const ViewMatrix& m, const Wave& q, const std::array<T, 3>& x,
             const std::vector<std::array<double, 3>>& directions) {
  const int n = static_cast<int>(directions.size());
  const T lambda = row_of(m, 2, x), u = row_of(m, 0, x) / lambda, v = row_of(m, 1, x) / lambda;
  std::vector<T> along, growth;
  for (const auto& e : directions) {
    std::array<T, 3> d{};
    for (std::size_t i = 0; i < 3; ++i) d[i] = row_of(m, i, std::array<T, 3>{e[0], e[1], e[2]}) - m[i][3];
    along.push_back(q.w_u * (d[0] - d[2] * u) + q.w_v * (d[1] - d[2] * v));
    growth.push_back(d[2]);
  }
  T sum = 0;
  for (unsigned subset = 0; subset < 1U << n; ++subset) {
    T product = q.amplitude;
    int size = 0;
    for (int i = 0; i < n; ++i) {
      const bool inside = (subset >> i) % 2 == 1;
      product *= inside ? along[static_cast<std::size_t>(i)] : -growth[static_cast<std::size_t>(i)];
      size += inside;
    }
    for (int i = size + 2; i <= n + 1; ++i) product *= i;
    sum += product * cosine(T(q.w_u * u + q.w_v * v + q.phase), size);
  }
  for (int i = 0; i < n + 2; ++i) sum /= lambda;
  return sum;
}

class Chance {
 public:
  explicit Chance(unsigned seed) : generator_(seed) {}
  double number(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(generator_);
  }
  // Of no symmetry, with lambda within 1 +- .3 on |x|, |y|, |z| <= 1.
  ViewMatrix matrix() {
    ViewMatrix m{};
    for (auto& row : m)
      for (double& x : row) x = number(-2, 2);
    for (std::size_t e = 0; e < 3; ++e) m[2][e] = number(-0.1, 0.1);
    m[2][3] = 1;
    return m;
  }
  Wave wave(double most) { return {number(0.5, 2), number(-most, most), number(-most, most), number(0, 7)}; }

 private:
  std::mt19937 generator_;
};

std::vector<std::array<double, 3>> axes_of(const std::array<int, 3>& orders) {
  std::vector<std::array<double, 3>> out;
  for (std::size_t e = 0; e < 3; ++e)
    for (int i = 0; i < orders[e]; ++i) {
      out.push_back({0, 0, 0});
      out.back()[e] = 1;
    }
  return out;
}

std::vector<std::array<int, 3>> orders_up_to_six() {
  std::vector<std::array<int, 3>> out;
  for (int a = 0; a <= 6; ++a)
    for (int b = 0; a + b <= 6; ++b)
      for (int c = 0; a + b + c <= 6; ++c) out.push_back({a, b, c});
  return out;
}

const std::vector<std::array<int, 3>> even_sixth{{6, 0, 0}, {0, 6, 0}, {0, 0, 6}, {4, 2, 0}, {4, 0, 2},
                                                 {2, 4, 0}, {0, 4, 2}, {2, 0, 4}, {0, 2, 4}, {2, 2, 2}};

// Differences over 2e-10 both ways err by 1e-20 of the derivative of two orders more; 100 digits leave 40.
BOOST_AUTO_TEST_CASE(the_identity_holds_for_any_matrix_wave_and_directions) {
  Chance chance(1);
  const Long step("1e-10");
  for (int n = 1; n <= 6; ++n)
    for (int trial = 0; trial < 6; ++trial) {
      const ViewMatrix m = chance.matrix();
      const Wave q = chance.wave(pi);
      const std::array<Long, 3> x{chance.number(-1, 1), chance.number(-1, 1), chance.number(-1, 1)};
      std::vector<std::array<double, 3>> directions;
      for (int i = 0; i < n; ++i) {
        if (i > 0 && trial % 2 == 0 && i % 2 == 1) directions.push_back(directions.back());
        else directions.push_back({chance.number(-1, 1), chance.number(-1, 1), chance.number(-1, 1)});
      }
      Long difference = 0;
      for (unsigned signs = 0; signs < 1U << n; ++signs) {
        std::array<Long, 3> y = x;
        int sign = 1;
        for (int i = 0; i < n; ++i) {
          const bool plus = (signs >> i) % 2 == 1;
          sign *= plus ? 1 : -1;
          for (std::size_t e = 0; e < 3; ++e)
            y[e] += (plus ? step : Long(-step)) * directions[static_cast<std::size_t>(i)][e];
        }
        difference += sign * field(m, q, y);
      }
      for (int i = 0; i < n; ++i) difference /= 2 * step;
      const Long identity = derivative(m, q, x, directions);
      BOOST_TEST(abs(Long(difference - identity)) <= Long("1e-14") * (1 + abs(identity)));
    }
}

BOOST_AUTO_TEST_CASE(no_wave_exceeds_a_bound_in_any_box) {
  Chance chance(2);
  double nearest = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const ViewMatrix m = chance.matrix();
    Wave q = chance.wave(pi);
    if (trial % 3 == 0) q.w_u = trial % 2 == 0 ? pi : -pi;
    if (trial % 5 == 0) q.w_v = trial % 2 == 0 ? pi : 0;
    Vec3 low{}, high{};
    const double width = std::pow(10, chance.number(-4, 0));
    for (std::size_t e = 0; e < 3; ++e) {
      low[e] = chance.number(-1, 1 - width);
      high[e] = low[e] + width;
    }
    const ViewBox box = view_box(m, low, high);
    BOOST_TEST_REQUIRE(box.lambda_min > 0);
    for (const auto& orders : orders_up_to_six()) {
      const double bound = derivative_bound(box, orders, q.sups(trial % 2 == 0));
      for (int point = 0; point < 12; ++point) {
        std::array<double, 3> x{};
        for (std::size_t e = 0; e < 3; ++e) {  // corners first
          const double inside = chance.number(low[e], high[e]);
          x[e] = point < 8 ? ((point >> e) % 2 == 0 ? low[e] : high[e]) : inside;
        }
        q.phase = chance.number(0, 7);
        const double truth = std::abs(derivative(m, q, x, axes_of(orders)));
        BOOST_TEST(truth <= bound);
        nearest = std::max(nearest, truth / bound);
      }
    }
  }
  BOOST_TEST_MESSAGE("largest derivative / bound: " << nearest);
  BOOST_TEST(nearest > 0.9);
}

// Where lambda does not change, a wave of a frequency along u or v alone, or a top wave along both, has
// nothing that its bound does not count.
BOOST_AUTO_TEST_CASE(waves_of_a_distant_source_reach_their_bounds) {
  ViewMatrix m{};
  m[0] = {0.8, 0.3, -0.1, 5};
  m[1] = {0.2, 0.1, 0.9, 7};
  m[2] = {0, 0, 0, 1};
  const Vec3 low{-3, 2, 1}, high{4, 3, 2};
  const double rounding = tolerance::fp64_sum(1000, 1);
  const ViewBox box = view_box(m, low, high);
  for (const Wave& q : {Wave{1, pi, 0, 0}, Wave{3, 0, pi, 0}, Wave{2, pi, pi, 0}})
    for (const auto& orders : orders_up_to_six()) {
      double product = q.amplitude;
      for (std::size_t e = 0; e < 3; ++e)
        product *= std::pow(q.w_u * std::abs(m[0][e]) + q.w_v * std::abs(m[1][e]), orders[e]);
      const double bound = derivative_bound(box, orders, q.sups());
      BOOST_TEST(product <= bound);
      if (q.w_u > 0 && q.w_v > 0) BOOST_TEST(bound <= product * (1 + rounding));
    }
  // Of a slow wave, the second derivative's sup serves: two orders less of Bernstein's inequality.
  const Wave slow{1, 0.5, 0, 0};
  ViewMatrix along_u = m;
  along_u[1] = {0, 0, 0, 7};
  const double bound = derivative_bound(view_box(along_u, low, high), {6, 0, 0}, slow.sups());
  const double expected = std::pow(0.8, 6) * std::pow(pi, 4) * 0.25;
  BOOST_TEST(std::abs(bound - expected) <= rounding * expected);
}

// A top wave of a scan with half a fan of 11 degrees, at the corner of a brick: the bound counts what comes
// of lambda beside the wave's own derivative, though one is at its largest where the other is not.
BOOST_AUTO_TEST_CASE(top_waves_of_a_cone_come_near_their_bounds) {
  const ConeGeometry cone = cone_of({});
  double least = 1;
  for (const ViewMatrix& m : cone.views) {
    const Vec3 low{5, -3, 2}, high{6, -2, 3};
    const Wave q{1, pi, pi, 0};
    const ViewBox box = view_box(m, low, high);
    for (const auto& orders : even_sixth) {
      double reached = 0;
      for (int corner = 0; corner < 8; ++corner)
        for (int turn = 0; turn < 64; ++turn)
          for (const double sign : {-1.0, 1.0}) {
            std::array<double, 3> x{};
            for (std::size_t e = 0; e < 3; ++e) x[e] = (corner >> e) % 2 == 0 ? low[e] : high[e];
            const Wave here{1, pi, sign * pi, turn * pi / 32};
            reached = std::max(reached, std::abs(derivative(m, here, x, axes_of(orders))));
          }
      const double bound = derivative_bound(box, orders, q.sups());
      BOOST_TEST(reached <= bound);
      least = std::min(least, reached / bound);
    }
    // Along the axis neither lambda nor u changes: as in parallel beam.
    const double plain = std::pow(pi, 6) / std::pow(box.lambda_min, 8);
    BOOST_TEST(std::abs(derivative_bound(box, {0, 0, 6}, q.sups()) - plain) <=
               tolerance::fp64_sum(1000, plain));
  }
  BOOST_TEST_MESSAGE("least of largest derivative / bound: " << least);
  BOOST_TEST(least >= 0.2);
}

// At one point, with all terms of the identity in step, which no single wave brings about.
BOOST_AUTO_TEST_CASE(at_a_point_the_bound_is_the_sum_of_all_terms) {
  Chance chance(4);
  for (int trial = 0; trial < 20; ++trial) {
    const ViewMatrix m = chance.matrix();
    const std::array<double, 3> x{chance.number(-1, 1), chance.number(-1, 1), chance.number(-1, 1)};
    const double lambda = row_of(m, 2, x), u = row_of(m, 0, x) / lambda, v = row_of(m, 1, x) / lambda;
    const ViewBox box = view_box(m, x, x);
    for (const auto& orders : orders_up_to_six()) {
      const auto directions = axes_of(orders);
      const int n = static_cast<int>(directions.size());
      double sum = 0;
      for (unsigned subset = 0; subset < 1U << n; ++subset) {
        double product = 1;
        int size = 0;
        for (int i = 0; i < n; ++i) {
          std::size_t e = 0;
          while (directions[static_cast<std::size_t>(i)][e] == 0) ++e;
          const double l = m[2][e], wave = pi * (std::abs(m[0][e] - l * u) + std::abs(m[1][e] - l * v));
          product *= (subset >> i) % 2 == 1 ? wave : std::abs(l);
          size += static_cast<int>((subset >> i) % 2);
        }
        sum += product * std::tgamma(n + 2) / std::tgamma(size + 2);
      }
      sum /= std::pow(lambda, n + 2);
      const double bound = derivative_bound(box, orders, {1, pi * pi, pi * pi});
      BOOST_TEST(std::abs(bound - sum) <= tolerance::fp64_sum(4000, sum));
    }
  }
}

// Along a ray nothing of q changes: what is left is the derivative of lambda^-2.
BOOST_AUTO_TEST_CASE(along_a_ray_bounds_are_those_of_the_weight) {
  const double l = -1.0 / 60;
  ViewMatrix m{};
  m[0] = {1, 11.5 * l, 0, 11.5};
  m[1] = {0, 9.5 * l, 1, 9.5};
  m[2] = {0, l, 0, 1};
  const ViewBox box = view_box(m, {0, -4, 0}, {0, 7, 0});
  double expected = 1 / std::pow(1 + 7 * l, 2);
  for (int n = 0; n <= 6; ++n, expected *= (n + 1) * std::abs(l) / (1 + 7 * l)) {
    const double bound = derivative_bound(box, {0, n, 0}, {1, 1, 1});
    BOOST_TEST(expected <= bound);
    BOOST_TEST(bound <= expected * (1 + 1e-9));  // rounding of X, which cancels
  }
}

BOOST_AUTO_TEST_CASE(boxes_that_reach_the_sources_plane_have_no_bound) {
  ViewMatrix m{};
  m[0] = {1, 0, 0, 0};
  m[1] = {0, 0, 1, 0};
  m[2] = {0, 0.25, 0, 1};  // the source's plane: y = -4
  const DetectorSups sups{1, 1, 1};
  const std::vector<ViewMatrix> views(1, m);
  const std::vector<DetectorSups> all(1, sups);
  const std::vector<double> values(1, 2.0);
  for (const double reach : {-4.0, -4.1, -1e9}) {
    const Vec3 low{0, reach, 0}, high{1, 1, 1};
    BOOST_TEST(!(view_box(m, low, high).lambda_min > 0));
    BOOST_TEST(std::isinf(derivative_bound(view_box(m, low, high), {2, 0, 0}, sups)));
    BOOST_TEST(std::isinf(sixth_sups(views, all, low, high).at({2, 2, 2})));
    BOOST_TEST(std::isinf(sum_of_weights(views, values, low, high, 2)));
  }
  const Vec3 low{0, -3.99, 0}, high{1, 1, 1};
  BOOST_TEST(std::isfinite(derivative_bound(view_box(m, low, high), {2, 0, 0}, sups)));
  BOOST_TEST(std::isfinite(sixth_sups(views, all, low, high).at({2, 2, 2})));
  BOOST_TEST(sum_of_weights(views, values, low, high, 2) >= 2 / (0.0025 * 0.0025) * (1 - 1e-9));
  const double nan = std::nan("");
  BOOST_TEST(!(view_box(m, {0, nan, 0}, high).lambda_min > 0));
  BOOST_CHECK_THROW(derivative_bound(view_box(m, low, high), {3, 3, 1}, sups), std::logic_error);
  BOOST_CHECK_THROW(static_cast<void>(sixth_sups(views, all, low, high).at({2, 2, 0})), std::logic_error);
  BOOST_CHECK_THROW(static_cast<void>(sixth_sups(views, all, low, high).at({3, 3, 0})), std::logic_error);
}

BOOST_AUTO_TEST_CASE(sums_are_those_of_the_views) {
  ConeShape shape;
  shape.views = 360;
  shape.in_plane_deg = 2;
  shape.out_of_plane_deg = 3;
  const ConeGeometry cone = cone_of(shape);
  Chance chance(3);
  std::vector<DetectorSups> sups;
  std::vector<double> values;
  for (std::size_t k = 0; k < cone.views.size(); ++k) {
    sups.push_back({chance.number(0.1, 1), chance.number(0.1, 9), chance.number(0.1, 9)});
    values.push_back(sups.back().value);
  }
  const double rounding = tolerance::fp64_sum(4 * 360 + 2000, 1);
  for (int trial = 0; trial < 20; ++trial) {
    Vec3 low{}, high{};
    for (std::size_t e = 0; e < 3; ++e) {
      low[e] = chance.number(-9, 5);
      high[e] = low[e] + chance.number(0, 4);
    }
    const SixthSups sums = sixth_sups(cone.views, sups, low, high);
    for (const auto& orders : even_sixth) {
      double sum = 0;
      for (std::size_t k = 0; k < cone.views.size(); ++k)
        sum += derivative_bound(view_box(cone.views[k], low, high), orders, sups[k]);
      BOOST_TEST(std::abs(sums.at(orders) - sum) <= rounding * sum);
    }
    BOOST_TEST(sums.along(1, 0, 1) == sums.at({2, 4, 0}));
    BOOST_TEST(sums.along(2, 2, 2) == sums.at({0, 0, 6}));
    BOOST_TEST(sums.along(2, 0, 1) == sums.at({2, 2, 2}));
    for (int power = 0; power <= 8; ++power) {
      double sum = 0, least = 0;
      for (std::size_t k = 0; k < cone.views.size(); ++k) {
        const double lambda = view_box(cone.views[k], low, high).lambda_min;
        sum += values[k] * std::pow(lambda, -power);
        double smallest = HUGE_VAL;
        for (int corner = 0; corner < 8; ++corner)
          smallest = std::min(smallest, row_of<double>(cone.views[k], 2,
                                                       {corner % 2 == 0 ? low[0] : high[0],
                                                        corner / 2 % 2 == 0 ? low[1] : high[1],
                                                        corner < 4 ? low[2] : high[2]}));
        least += values[k] * std::pow(smallest, -power);
      }
      const double weights = sum_of_weights(cone.views, values, low, high, power);
      BOOST_TEST(std::abs(weights - sum) <= rounding * sum);
      BOOST_TEST(weights >= least * (1 - tolerance::fp64_sum(16, 1)));
    }
  }
  const auto start = std::chrono::steady_clock::now();
  constexpr int boxes = 200;
  double all = 0;
  for (int i = 0; i < boxes; ++i)
    all += sixth_sups(cone.views, sups, {i * 0.01, 0, 0}, {5, 4, 3}).at({2, 2, 2});
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  BOOST_TEST(all > 0);
  BOOST_TEST_MESSAGE("sixth_sups: " << seconds.count() / boxes / 360 * 1e6 << " microseconds a view and box");
}

}  // namespace
}  // namespace vdvr
