// Half a turn 0 <= theta < 180 degrees is continued by its own mirror image to a full turn, whose 2D spectrum
// has an empty double wedge |k| > R |w| exactly when c is right (Vo et al., Optics Express 22, 2014, 19078).
// Deviation: the mirrored half is shifted by a phase factor, so the search needs one transform in all. And
// its ends: see from_ends.
#include "host/scan/center/half_turn.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "host/scan/center/mirror_registration.hpp"

namespace vdvr::center {
namespace {

using Complex = std::complex<double>;

// The first half turn of the views in order of angle, where they are equally spaced and fill it without
// repeating its end; else none.
std::vector<std::int64_t> half_turn_of(const std::vector<double>& theta) {
  constexpr std::size_t fewest = 16;
  const double step = median_step(theta);
  if (!(step > 0)) return {};
  std::vector<std::int64_t> views;
  double last = 0;
  for (const std::int64_t k : by_angle(theta)) {
    const double t = theta[static_cast<std::size_t>(k)];
    if (!views.empty()) {
      if (t - theta[static_cast<std::size_t>(views.front())] > pi - step / 2) break;
      if (!(std::abs(t - last - step) <= step / 4)) return {};
    }
    views.push_back(k);
    last = t;
  }
  if (views.size() < fewest || !(std::abs(step * static_cast<double>(views.size()) - pi) <= step / 4))
    return {};
  return views;
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
void column_spectra(const RowBands& set, std::int64_t band, std::int64_t count, std::vector<Complex>& plain,
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
  /// What is left of it for a centre, as a part.
  [[nodiscard]] double rest(double c, double columns) const {
    double sum = energy;
    for (std::size_t f = 0; f < cross.size(); ++f)
      sum += 2 * std::real(cross[f] * std::polar(1.0, -2 * pi * static_cast<double>(f + 1) / columns *
                                                          (2 * c - (columns - 1))));
    return sum / energy;
  }
};

void add_band(const RowBands& set, std::int64_t band, Wedge& wedge) {
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

// Where the energy in the wedge is least over c, coarse, or near `near`.
double least_rest(const Wedge& wedge, double columns, std::optional<double> near) {
  const auto rest = [&](double c) { return wedge.rest(c, columns); };
  constexpr double step = 0.25;
  const double low = near ? *near - 2 : columns / 4 - 0.5, high = near ? *near + 2 : low + columns / 2;
  double best = 3, at = low;
  for (double c = low; c <= high; c += step)
    if (const double r = rest(c); r < best) best = r, at = c;
  // The curve is a sum of few slow waves: a parabola through a coarse and then a fine step finds its lowest
  // point.
  for (const double h : {step, step / 16}) at += h * parabola_peak(rest(at - h), rest(at), rest(at + h));
  return at;
}

}  // namespace

std::optional<CenterWitness> from_symmetry(const ProjectionSet& scan, std::optional<double> near) {
  const auto& g = scan.geometry;
  constexpr std::int64_t most_bands = 4, most_frequencies = 48;
  const auto views = half_turn_of(g.theta_rad);
  if (views.empty() || g.columns < 8) return std::nullopt;
  // Above frequency K / pi the wedge is empty: there the sinogram itself is undersampled in angle.
  const auto useful = static_cast<std::int64_t>(static_cast<double>(views.size() - 4) / pi);
  const std::int64_t count = std::min({useful, most_frequencies, g.columns / 2 - 1});
  if (count < 2) return std::nullopt;
  Wedge wedge{0, std::vector<Complex>(static_cast<std::size_t>(count), 0)};
  const RowBands set = average_rows(scan, views, most_bands);
  for (std::int64_t band = 0; band < set.bands; ++band) add_band(set, band, wedge);
  if (!(wedge.energy > 0)) return std::nullopt;
  const auto columns = static_cast<double>(g.columns);
  double at = least_rest(wedge, columns, {});
  // The phases of whole frequencies repeat every half detector.
  if (near) {
    const double other = at + std::copysign(columns / 2, *near - at);
    if (std::abs(other - *near) < std::abs(at - *near) && other >= 0 && other <= columns - 1) at = other;
  }
  // Every fourth frequency tells the centre apart from the others.
  const std::int64_t parts = count >= 8 ? 4 : 2;
  double spread = 0;
  for (std::int64_t part = 0; part < parts; ++part) {
    Wedge some = wedge;
    for (std::int64_t f = 0; f < count; ++f)
      if (f % parts != part) some.cross[static_cast<std::size_t>(f)] = 0;
    spread += std::pow(least_rest(some, columns, at) - at, 2);
  }
  const double n = static_cast<double>(parts), uncertainty = std::sqrt(spread / (n * (n - 1)));
  return CenterWitness{at, uncertainty, std::clamp(1 - wedge.rest(at, columns), 0.0, 1.0),
                       "the mirror symmetry of a half turn"};
}

// A view that is d short of opposite shows features moved by d times their depth, to both sides as they lie
// before or behind the axis. To first order in d that is a shift of the whole, so that the line through what
// several d say has the centre at 0.
std::optional<CenterWitness> from_ends(const ProjectionSet& scan) {
  const auto& g = scan.geometry;
  constexpr std::int64_t most_bands = 16, steps = 3;
  const auto half = half_turn_of(g.theta_rad);
  if (half.empty()) return std::nullopt;
  const auto K = static_cast<std::int64_t>(half.size());
  std::vector<std::int64_t> views(half.begin(), half.begin() + steps);
  views.insert(views.end(), half.end() - steps, half.end());
  RowBands set = average_rows(scan, views, most_bands);
  smooth_columns(set);
  // Pairs that are d steps short: the i-th from the front, the j-th from the back, i + j = d - 1.
  const auto pairs = [&](std::int64_t d) {
    std::vector<Pair> all;
    for (std::int64_t i = 0; i < d; ++i) all.push_back({i, 2 * steps - 1 - (d - 1 - i)});
    return all;
  };
  const auto coarse = search_mirror(set, pairs(1));
  if (!coarse || K < 2 * steps) return std::nullopt;
  const double reach = 2 * std::ceil(static_cast<double>(set.columns) / 512) + 3;
  double sum = 0, variance = 0, quality = 1;
  // The line of least squares through d = 1, 2, 3, at d = 0.
  constexpr std::array<double, steps> weight{4.0 / 3, 1.0 / 3, -2.0 / 3};
  std::array<double, steps> at{};
  for (std::int64_t d = 1; d <= steps; ++d) {
    const auto k = static_cast<std::size_t>(d - 1);
    const Mirror m = refine_mirror(set, pairs(d), coarse->sum, reach);
    if (!(m.correlation > 0)) return std::nullopt;
    at[k] = m.sum;
    sum += weight[k] * m.sum;
    variance += std::pow(weight[k] * m.deviation, 2);
    quality = std::min(quality, m.correlation * m.correlation);
  }
  // What is no line: the second difference, which the extrapolation carries over.
  const double bend = at[0] - 2 * at[1] + at[2];
  return CenterWitness{sum / 2, std::sqrt(variance + bend * bend) / 2, quality, "the ends of a half turn"};
}

}  // namespace vdvr::center
