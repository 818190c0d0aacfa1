#include "host/certify/bounds/tap_design.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

namespace vdvr {
namespace {

using Complex = std::complex<double>;
using Vector = std::vector<double>;

// (2 sin(kappa / 2) / kappa)^order
double difference_ratio(double kappa, int order) {
  return kappa == 0 ? 1 : std::pow(2 * std::sin(kappa / 2) / kappa, order);
}

// Rows of r(kappa) + 1 as a function of the taps, at frequencies that are dense towards the band's edge.
struct Rows {
  std::size_t taps, count;
  std::vector<Complex> wave;  // [frequency][tap]

  explicit Rows(const TapTask& task)
      : taps(static_cast<std::size_t>(task.taps)), count(4 * taps), wave(count * taps) {
    for (std::size_t i = 0; i < count; ++i) {
      const double share = (static_cast<double>(i) + 0.5) / (static_cast<double>(count) - 0.5);
      const double kappa = task.band * std::sin(std::numbers::pi / 2 * share);
      for (std::size_t n = 0; n < taps; ++n)
        wave[i * taps + n] =
            std::polar(difference_ratio(kappa, task.order),
                       kappa * (static_cast<double>(n) + 1 - static_cast<double>(taps / 2) - task.place));
    }
  }
  [[nodiscard]] const Complex* row(std::size_t i) const { return wave.data() + i * taps; }
  [[nodiscard]] Complex residual(std::size_t i, const Vector& h) const {
    Complex sum = -1;
    for (std::size_t n = 0; n < taps; ++n) sum += h[n] * row(i)[n];
    return sum;
  }
  [[nodiscard]] Vector residuals(const Vector& h) const {
    Vector out(count);
    for (std::size_t i = 0; i < count; ++i) out[i] = std::abs(residual(i, h));
    return out;
  }
};

// From `first` on, in four sums, of which none waits for the last product.
double product_of(const Vector& a, const Vector& b, std::size_t first) {
  std::array<double, 4> sums{};
  std::size_t r = first;
  for (; r + 4 <= a.size(); r += 4)
    for (std::size_t k = 0; k < 4; ++k) sums[k] += a[r + k] * b[r + k];
  for (; r < a.size(); ++r) sums[0] += a[r] * b[r];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

// Least squares by Householder's reflections. a: [column][row], the last column is the right-hand side.
Vector least_squares(std::vector<Vector>& a) {
  const std::size_t columns = a.size() - 1, rows = a[0].size();
  Vector diagonal(columns);
  for (std::size_t k = 0; k < columns; ++k) {
    const double norm = std::copysign(std::sqrt(product_of(a[k], a[k], k)), -a[k][k]);
    diagonal[k] = norm;
    a[k][k] -= norm;  // the reflection's vector, of squared length -2 norm a[k][k]
    for (std::size_t c = k + 1; c <= columns; ++c) {
      const double product = product_of(a[k], a[c], k) / (norm * a[k][k]);
      for (std::size_t r = k; r < rows; ++r) a[c][r] += product * a[k][r];
    }
  }
  Vector x(columns);
  for (std::size_t k = columns; k-- > 0;) {
    double sum = a[columns][k];
    for (std::size_t c = k + 1; c < columns; ++c) sum -= a[c][k] * x[c];
    x[k] = sum / diagonal[k];
  }
  return x;
}

// The ridge keeps narrow bands well-posed: it costs 1e-9 |h| of error, far below the rounding of taps to
// fp32.
constexpr double ridge = 1e-9;

// weight: of |r|^2 at a frequency, adding to 1.
Vector weighted_taps(const Rows& rows, const Vector& weight) {
  std::vector<Vector> a(rows.taps + 1, Vector(2 * rows.count + rows.taps));
  for (std::size_t i = 0; i < rows.count; ++i) {
    const double w = std::sqrt(weight[i]);
    for (std::size_t n = 0; n < rows.taps; ++n) {
      a[n][2 * i] = w * rows.row(i)[n].real();
      a[n][2 * i + 1] = w * rows.row(i)[n].imag();
    }
    a[rows.taps][2 * i] = w;
  }
  for (std::size_t n = 0; n < rows.taps; ++n) a[n][2 * rows.count + n] = ridge;
  return least_squares(a);
}

// The barrier  weight sum sqrt(h^2 + soft^2) - sum log(eta^2 - |r|^2), infinite outside.
struct Barrier {
  const Rows& rows;
  double eta;
  double weight = 1, soft = 1;

  [[nodiscard]] double value(const Vector& h) const {
    double sum = 0;
    for (const double x : h) sum += weight * std::hypot(x, soft);
    for (std::size_t i = 0; i < rows.count; ++i) {
      const double room = eta * eta - std::norm(rows.residual(i, h));
      if (!(room > 0)) return HUGE_VAL;
      sum -= std::log(room / (eta * eta));
    }
    return sum;
  }

  // Gradient into the last column, Hessian (lower half) before it: [row][column].
  void derivatives(const Vector& h, std::vector<Vector>& out) const {
    const std::size_t n = rows.taps;
    for (std::size_t a = 0; a < n; ++a) {
      std::fill(out[a].begin(), out[a].end(), 0.0);
      const double length = std::hypot(h[a], soft);
      out[a][a] = weight * soft * soft / (length * length * length);
      out[a][n] = weight * h[a] / length;
    }
    Vector slope(n);
    for (std::size_t i = 0; i < rows.count; ++i) {
      const Complex r = rows.residual(i, h), *wave = rows.row(i);
      const double per_room = 1 / (eta * eta - std::norm(r));
      for (std::size_t a = 0; a < n; ++a) {
        slope[a] = 2 * per_room * (r.real() * wave[a].real() + r.imag() * wave[a].imag());
        out[a][n] += slope[a];
        for (std::size_t b = 0; b <= a; ++b)
          out[a][b] += slope[a] * slope[b] +
                       2 * per_room * (wave[a].real() * wave[b].real() + wave[a].imag() * wave[b].imag());
      }
    }
  }
};

// -H^-1 g by Cholesky's factorisation, of what Barrier::derivatives made. A pivot that rounding has made too
// small is raised: the step gets shorter, no more.
Vector newton_step(std::vector<Vector>& m) {
  const std::size_t n = m.size();
  Vector step(n);
  for (std::size_t a = 0; a < n; ++a) {
    const double floor = 1e-14 * m[a][a];
    for (std::size_t b = 0; b <= a; ++b) {
      double sum = m[a][b];
      for (std::size_t k = 0; k < b; ++k) sum -= m[a][k] * m[b][k];
      m[a][b] = a == b ? std::sqrt(std::max(sum, floor)) : sum / m[b][b];
    }
    double sum = -m[a][n];
    for (std::size_t k = 0; k < a; ++k) sum -= m[a][k] * step[k];
    step[a] = sum / m[a][a];
  }
  for (std::size_t a = n; a-- > 0;) {
    for (std::size_t k = a + 1; k < n; ++k) step[a] -= m[k][a] * step[k];
    step[a] /= m[a][a];
  }
  return step;
}

// Newton's method with halved steps until it falls by little.
void descend(const Barrier& barrier, Vector& h) {
  std::vector<Vector> matrix(h.size(), Vector(h.size() + 1));
  double value = barrier.value(h);
  for (int i = 0; i < 30; ++i) {
    barrier.derivatives(h, matrix);
    const Vector step = newton_step(matrix);
    double length = 1, next = HUGE_VAL;
    Vector to(h.size());
    for (; length > 1e-6; length /= 2) {
      for (std::size_t n = 0; n < h.size(); ++n) to[n] = h[n] + length * step[n];
      next = barrier.value(to);
      if (next < value) break;
    }
    if (!(next < value)) return;
    const double fallen = value - next;
    h = to;
    value = next;
    if (fallen < 0.01) return;
  }
}

}  // namespace

std::vector<double> least_error_taps(const TapTask& task, double enough) {
  const Rows rows(task);
  Vector weight(rows.count, 1.0 / static_cast<double>(rows.count)), best;
  double least = HUGE_VAL;
  for (int round = 0; round < 30 && least > enough; ++round) {
    const Vector h = weighted_taps(rows, weight);
    const Vector residuals = rows.residuals(h);
    const double largest = *std::ranges::max_element(residuals);
    if (largest < least) {
      least = largest;
      best = h;
    }
    double sum = 0;
    for (std::size_t i = 0; i < rows.count; ++i) {
      weight[i] = std::max(weight[i] * residuals[i] / largest, 1e-12);
      sum += weight[i];
    }
    for (double& w : weight) w /= sum;
  }
  return best;
}

std::vector<double> least_norm_taps(const TapTask& task, double eta, const std::vector<double>& start) {
  const Rows rows(task);
  Barrier barrier{rows, eta};
  Vector h = start;
  // The sum of magnitudes ends within 2 count / weight of the least.
  for (const double excess : {1.0, 0.1, 0.02, 0.004}) {
    barrier.weight = 2 * static_cast<double>(rows.count) / excess;
    barrier.soft = excess / 16;
    descend(barrier, h);
  }
  return h;
}

double relative_error(const TapTask& task, const std::vector<double>& taps) {
  constexpr int steps = 2048;
  const double first = 1 - task.taps / 2 - task.place, step = task.band / steps;
  double largest = 0, second = 0;
  for (int s = 0; s <= steps; ++s) {
    const double kappa = step * s;
    const Complex turn = std::polar(1.0, kappa);
    Complex wave = std::polar(difference_ratio(kappa, task.order), kappa * first), sum = -1;
    for (const double h : taps) {
      sum += h * wave;
      wave = {wave.real() * turn.real() - wave.imag() * turn.imag(),
              wave.real() * turn.imag() + wave.imag() * turn.real()};
    }
    largest = std::max(largest, std::abs(sum));
  }
  // (2 sin(kappa / 2) / kappa)^order exp(i kappa x) is the mean of exp(i kappa (x + y)) over y of variance
  // order / 12.
  double magnitude = 0;
  for (std::size_t n = 0; n < taps.size(); ++n) {
    const double x = first + static_cast<double>(n);
    second += std::abs(taps[n]) * (x * x + task.order / 12.0);
    magnitude += std::abs(taps[n]);
  }
  const double rounding = 8 * static_cast<double>(taps.size() + 8) * 0x1p-53 * (1 + magnitude);
  return largest + step * step / 8 * second + rounding;
}

}  // namespace vdvr
