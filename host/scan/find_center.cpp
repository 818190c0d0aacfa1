// Centre of rotation from opposite views: p(theta + 180)(i) = p(theta)(2c - i). Where such pairs were
// measured, they are registered by normalised cross-correlation. A half turn 0 <= theta < 180 has none: it is
// continued by its own mirror image to a full turn, whose 2D spectrum has an empty double wedge |k| > R |w|
// exactly when c is right (Vo et al., Optics Express 22, 2014, 19078). Deviation: the mirrored half is
// shifted by a phase factor, so the search needs one transform in all.
#include "host/scan/find_center.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

namespace vdvr {
namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

// Views averaged over bands of rows: the centre is the same in all, and the mean has less noise.
// bands[view][band][column].
struct Banded {
  std::int64_t views = 0, bands = 0, columns = 0;
  std::vector<double> data;
  [[nodiscard]] const double* row(std::int64_t view, std::int64_t band) const {
    return data.data() + (view * bands + band) * columns;
  }
};

Banded average_rows(const ProjectionSet& scan, std::int64_t most_bands) {
  const auto& g = scan.geometry;
  Banded out{g.views(), std::min(most_bands, g.rows), g.columns, {}};
  out.data.assign(static_cast<std::size_t>(out.views * out.bands * out.columns), 0.0);
  for (std::int64_t k = 0; k < out.views; ++k)
    for (std::int64_t v = 0; v < g.rows; ++v) {
      const std::int64_t band = v * out.bands / g.rows;
      const float* from = scan.data.data() + (k * g.rows + v) * g.columns;
      double* to = out.data.data() + (k * out.bands + band) * g.columns;
      for (std::int64_t i = 0; i < g.columns; ++i) to[i] += static_cast<double>(from[i]);
    }
  return out;
}

double median_gap(std::vector<double> theta) {
  for (double& t : theta) t -= 2 * pi * std::floor(t / (2 * pi));
  std::sort(theta.begin(), theta.end());
  std::vector<double> gaps;
  for (std::size_t k = 1; k < theta.size(); ++k)
    if (const double gap = theta[k] - theta[k - 1]; gap > 1e-9)
      gaps.push_back(gap);  // repeated views are no step
  if (gaps.empty()) return 0;
  std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2), gaps.end());
  return gaps[gaps.size() / 2];
}

/// The extremum of the parabola through (-1, a), (0, b), (1, c), within half a step.
double parabola_peak(double a, double b, double c) {
  const double bend = a - 2 * b + c;
  return bend == 0 ? 0 : std::clamp(0.5 * (a - c) / bend, -0.5, 0.5);
}

// --- opposite views ---

struct Pair {
  std::int64_t a, b;
};

// Calls `take(i, j, mismatch)` for all pairs of views that are opposite to within `tolerance`.
template <typename Take>
void for_opposite_views(const std::vector<double>& theta, double tolerance, const Take& take) {
  for (std::size_t i = 0; i < theta.size(); ++i)
    for (std::size_t j = i + 1; j < theta.size(); ++j) {
      const double mismatch = std::abs(std::remainder(theta[j] - theta[i] - pi, 2 * pi));
      if (mismatch <= tolerance) take(static_cast<std::int64_t>(i), static_cast<std::int64_t>(j), mismatch);
    }
}

// The best-matching opposite views within half a step. A mismatch moves features on the two sides of the axis
// in opposite directions, and pairs off by +d and -d come together, so it blurs but does not bias.
std::vector<Pair> opposite_views(const std::vector<double>& theta, std::int64_t most) {
  const double step = median_gap(theta);
  constexpr double slack = 1 + 1e-6;  // an odd number of views over a turn is off by half a step to rounding
  double best = step / 2 * slack;
  for_opposite_views(theta, best,
                     [&](std::int64_t, std::int64_t, double mismatch) { best = std::min(best, mismatch); });
  std::vector<Pair> pairs;
  for_opposite_views(theta, std::min(std::max(best * slack, step / 20), step / 2 * slack),
                     [&](std::int64_t i, std::int64_t j, double) {
                       pairs.push_back({i, j});
                     });
  const auto count = static_cast<std::int64_t>(pairs.size());
  if (count <= most) return pairs;
  std::vector<Pair> spread;
  for (std::int64_t k = 0; k < most; ++k) spread.push_back(pairs[static_cast<std::size_t>(k * count / most)]);
  return spread;
}

// Gaussian of one column: interpolation between columns then neither adds nor removes noise to speak of,
// which would pull the correlation's peak to half columns.
void smooth_columns(Banded& set) {
  constexpr std::int64_t reach = 4;
  std::array<double, reach + 1> weight{};
  for (std::int64_t d = 0; d <= reach; ++d)
    weight[static_cast<std::size_t>(d)] = std::exp(-0.5 * static_cast<double>(d * d));
  std::vector<double> row(static_cast<std::size_t>(set.columns));
  for (std::int64_t r = 0; r < set.views * set.bands; ++r) {
    double* data = set.data.data() + r * set.columns;
    for (std::int64_t i = 0; i < set.columns; ++i) {
      double sum = 0, total = 0;
      for (std::int64_t j = std::max<std::int64_t>(0, i - reach); j <= std::min(set.columns - 1, i + reach);
           ++j) {
        const double w = weight[static_cast<std::size_t>(std::abs(i - j))];
        sum += w * data[j];
        total += w;
      }
      row[static_cast<std::size_t>(i)] = sum / total;
    }
    std::copy(row.begin(), row.end(), data);
  }
}

// Cubic (Catmull-Rom) interpolation at j + f; columns j - 1 to j + 2 must exist.
double cubic_at(const double* p, std::int64_t j, double f) {
  const double a = p[j - 1], b = p[j], c = p[j + 1], d = p[j + 2];
  return b + 0.5 * f * (c - a + f * (2 * a - 5 * b + 4 * c - d + f * (3 * (b - c) + d - a)));
}

// The normalised cross-correlation of the first views with the mirrored second ones about c = s / 2, over
// their overlap.
double mirror_correlation(const Banded& set, const std::vector<Pair>& pairs, double s) {
  const std::int64_t U = set.columns;
  const auto whole = static_cast<std::int64_t>(std::floor(s));
  const double f = s - static_cast<double>(whole);
  const std::int64_t margin = f > 0 ? 2 : 0;
  const std::int64_t first = std::max<std::int64_t>(0, whole - (U - 1) + margin),
                     last = std::min(U - 1, whole - margin);
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  for (const Pair& pair : pairs)
    for (std::int64_t band = 0; band < set.bands; ++band) {
      const double *p = set.row(pair.a, band), *q = set.row(pair.b, band);
      for (std::int64_t i = first; i <= last; ++i) {
        const double a = p[i], b = f > 0 ? cubic_at(q, whole - i, f) : q[whole - i];
        x += a, y += b, xx += a * a, yy += b * b, xy += a * b;
      }
      n += static_cast<double>(std::max<std::int64_t>(0, last - first + 1));
    }
  if (!(n > 0)) return -1;
  const double spread = (xx - x * x / n) * (yy - y * y / n);
  return spread > 0 ? (xy - x * y / n) / std::sqrt(spread) : -1;
}

std::optional<CenterEstimate> from_opposite_views(const ProjectionSet& scan) {
  constexpr std::int64_t most_pairs = 16, most_bands = 16;
  const auto pairs = opposite_views(scan.geometry.theta_rad, most_pairs);
  const std::int64_t U = scan.geometry.columns;
  if (pairs.empty() || U < 8) return std::nullopt;
  Banded set = average_rows(scan, most_bands);
  smooth_columns(set);
  double best = -1, at = 0;
  const auto look = [&](double s) {
    const double r = mirror_correlation(set, pairs, s);
    if (r > best) best = r, at = s;
  };
  for (std::int64_t s = U / 2; s <= 3 * U / 2 - 2; ++s) look(static_cast<double>(s));
  constexpr double fine = 1.0 / 8;
  const double coarse = at;
  for (int k = -8; k <= 8; ++k) look(coarse + k * fine);
  at += fine * parabola_peak(mirror_correlation(set, pairs, at - fine), best,
                             mirror_correlation(set, pairs, at + fine));
  const double quality = best > 0 ? best * best : 0;
  if (!(quality >= 0.5)) return std::nullopt;
  return CenterEstimate{
      at / 2, fmt::format("{} pair{} of opposite views", pairs.size(), pairs.size() == 1 ? "" : "s"),
      quality};
}

// --- a half turn ---

// True for views in order of angle, equally spaced, that fill half a turn without repeating its end.
bool is_half_turn(const std::vector<double>& theta) {
  const auto n = static_cast<double>(theta.size());
  const double step = (theta.back() - theta.front()) / (n - 1);
  if (!(std::abs(std::abs(step) * n - pi) <= std::abs(step) / 4)) return false;
  for (std::size_t k = 1; k < theta.size(); ++k)
    if (!(std::abs(theta[k] - theta[k - 1] - step) <= std::abs(step) / 4)) return false;
  return true;
}

std::vector<Complex> roots_of_unity(std::int64_t n) {
  std::vector<Complex> roots(static_cast<std::size_t>(n));
  for (std::int64_t k = 0; k < n; ++k)
    roots[static_cast<std::size_t>(k)] =
        std::polar(1.0, -2 * pi * static_cast<double>(k) / static_cast<double>(n));
  return roots;
}

// Column frequencies 1 .. count of every view and of its mirror image: out[frequency][view]. Tapered over a
// sixteenth at both ends, where a truncated projection would otherwise jump.
void column_spectra(const Banded& set, std::int64_t band, std::int64_t count, std::vector<Complex>& plain,
                    std::vector<Complex>& mirrored) {
  const std::int64_t U = set.columns, taper = std::max<std::int64_t>(1, U / 16);
  const auto roots = roots_of_unity(U);
  std::vector<double> row(static_cast<std::size_t>(U));
  for (std::int64_t k = 0; k < set.views; ++k) {
    const double* p = set.row(k, band);
    for (std::int64_t i = 0; i < U; ++i) {
      const std::int64_t edge = std::min(i, U - 1 - i);
      const double w =
          edge < taper
              ? 0.5 - 0.5 * std::cos(pi * (static_cast<double>(edge) + 0.5) / static_cast<double>(taper))
              : 1;
      row[static_cast<std::size_t>(i)] = w * p[i];
    }
    for (std::int64_t f = 1; f <= count; ++f) {
      Complex sum = 0;
      for (std::int64_t i = 0; i < U; ++i)
        sum += row[static_cast<std::size_t>(i)] * roots[static_cast<std::size_t>(f * i % U)];
      const auto at = static_cast<std::size_t>((f - 1) * set.views + k);
      plain[at] = sum;
      // sum p(U-1-i) r^i = r^(U-1) conj(sum p(i) r^i) for real p.
      mirrored[at] = roots[static_cast<std::size_t>(f * (U - 1) % U)] * std::conj(sum);
    }
  }
}

// The energy in the wedge is E + 2 Re sum_f cross[f] exp(-i w_f s) for a mirrored half shifted by s columns.
struct Wedge {
  double energy = 0;
  std::vector<Complex> cross;
};

void add_band(const Banded& set, std::int64_t band, Wedge& wedge) {
  const std::int64_t K = set.views;
  const auto count = static_cast<std::int64_t>(wedge.cross.size());
  std::vector<Complex> plain(static_cast<std::size_t>(count * K)), mirrored(plain.size());
  column_spectra(set, band, count, plain, mirrored);
  const auto roots = roots_of_unity(2 * K);
  for (std::int64_t f = 1; f <= count; ++f) {
    const Complex *a = plain.data() + (f - 1) * K, *b = mirrored.data() + (f - 1) * K;
    // |k| > R w with R = U/2: beyond what a point at the detector's edge can do; 2 more for the taper's
    // leakage.
    const auto lowest = static_cast<std::int64_t>(std::ceil(pi * static_cast<double>(f))) + 3;
    for (std::int64_t k = lowest; k < 2 * K - lowest + 1; ++k) {
      Complex A = 0, B = 0;
      for (std::int64_t n = 0; n < K; ++n) {
        const Complex& r = roots[static_cast<std::size_t>(k * n % (2 * K))];
        A += a[n] * r;
        B += b[n] * r;
      }
      if (k % 2 != 0) B = -B;
      wedge.energy += std::norm(A) + std::norm(B);
      wedge.cross[static_cast<std::size_t>(f - 1)] += std::conj(A) * B;
    }
  }
}

std::optional<CenterEstimate> from_half_turn(const ProjectionSet& scan) {
  const auto& g = scan.geometry;
  constexpr std::int64_t most_bands = 4, most_frequencies = 48, fewest_views = 16;
  if (g.views() < fewest_views || g.columns < 8 || !is_half_turn(g.theta_rad)) return std::nullopt;
  // Above frequency K / pi the wedge is empty: there the sinogram itself is undersampled in angle.
  const auto useful = static_cast<std::int64_t>(static_cast<double>(g.views() - 4) / pi);
  const std::int64_t count = std::min({useful, most_frequencies, g.columns / 2 - 1});
  if (count < 1) return std::nullopt;
  Wedge wedge{0, std::vector<Complex>(static_cast<std::size_t>(count), 0)};
  const Banded set = average_rows(scan, most_bands);
  for (std::int64_t band = 0; band < set.bands; ++band) add_band(set, band, wedge);
  if (!(wedge.energy > 0)) return std::nullopt;
  const double U = static_cast<double>(g.columns);
  const auto rest = [&](double c) {
    double sum = wedge.energy;
    for (std::size_t f = 0; f < wedge.cross.size(); ++f)
      sum += 2 * std::real(wedge.cross[f] *
                           std::polar(1.0, -2 * pi * static_cast<double>(f + 1) / U * (2 * c - (U - 1))));
    return sum / wedge.energy;
  };
  constexpr double step = 0.25;
  double best = 3, at = 0;
  for (double c = (U - 1) / 4; c <= 3 * (U - 1) / 4; c += step)
    if (const double r = rest(c); r < best) best = r, at = c;
  // The curve is a sum of few slow waves: a parabola through a coarse and then a fine step finds its lowest
  // point.
  for (const double h : {step, step / 16}) at += h * parabola_peak(rest(at - h), rest(at), rest(at + h));
  const double quality = std::clamp(1 - rest(at), 0.0, 1.0);
  if (!(quality >= 0.5)) return std::nullopt;
  return CenterEstimate{at, "the mirror symmetry of a half turn", quality};
}

}  // namespace

std::optional<CenterEstimate> find_center(const ProjectionSet& scan) {
  if (scan.geometry.views() < 2) return std::nullopt;
  if (auto found = from_opposite_views(scan)) return found;
  return from_half_turn(scan);
}

}  // namespace vdvr
