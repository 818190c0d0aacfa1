// Scans made to break the bounds of docs/error-bounds.md: waves and peaks whose worst point is the same for
// all views, and everything that is awkward otherwise. The filtered projections are chosen first; `unramp`
// gives the scan that filters to them. Called by attacks_test.cpp and attack_terms_test.cpp.
#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/reference/cosine_series.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr::attacks {

using Vec3 = std::array<double, 3>;

/// A scan and where its field is at its worst; `upsampling` is the rate between whose columns that lies, 0:
/// any.
struct Scan {
  std::string name;
  ProjectionSet data;
  Vec3 target{0, 0, 0};
  int upsampling = 0;
};

using Value = std::function<double(std::size_t view, std::size_t v, std::size_t u)>;

inline ParallelGeometry geometry(std::int64_t views, std::int64_t rows, std::int64_t columns,
                                 double arc_deg = 180) {
  ParallelGeometry g;
  g.columns = columns;
  g.rows = rows;
  g.center = 0.5 * static_cast<double>(columns - 1);
  for (std::int64_t k = 0; k < views; ++k)
    g.theta_rad.push_back(arc_deg * std::numbers::pi / 180 * static_cast<double>(k) /
                          static_cast<double>(views));
  return g;
}

inline ProjectionSet scan_of(const ParallelGeometry& g, const Value& p) {
  ProjectionSet scan;
  scan.geometry = g;
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k)
    for (std::size_t v = 0; v < static_cast<std::size_t>(g.rows); ++v)
      for (std::size_t u = 0; u < static_cast<std::size_t>(g.columns); ++u)
        scan.data.push_back(static_cast<float>(p(k, v, u)));
  return scan;
}

/// The inverse of the U x U matrix of the sampled ramp kernel (symmetric, positive definite), by Gauss and
/// Jordan.
inline const std::vector<double>& inverse_ramp(std::size_t n) {
  static std::map<std::size_t, std::vector<double>> known;
  if (const auto found = known.find(n); found != known.end()) return found->second;
  constexpr double pi = std::numbers::pi;
  std::vector<double> a(n * n), inverse(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      const double d = static_cast<double>(i > j ? i - j : j - i);
      a[i * n + j] = i == j ? 0.25 : (i + j) % 2 == 1 ? -1 / (pi * pi * d * d) : 0.0;
    }
  for (std::size_t i = 0; i < n; ++i) inverse[i * n + i] = 1;
  for (std::size_t i = 0; i < n; ++i) {
    const double pivot = a[i * n + i];
    for (std::size_t j = 0; j < n; ++j) {
      a[i * n + j] /= pivot;
      inverse[i * n + j] /= pivot;
    }
    for (std::size_t r = 0; r < n; ++r) {
      const double factor = r == i ? 0.0 : a[r * n + i];
      for (std::size_t j = 0; j < n && factor != 0; ++j) {
        a[r * n + j] -= factor * a[i * n + j];
        inverse[r * n + j] -= factor * inverse[i * n + j];
      }
    }
  }
  return known.emplace(n, std::move(inverse)).first->second;
}

/// The scan whose filtered projections are q times the view weights, up to the scan's rounding to fp32.
inline ProjectionSet unramp(const ParallelGeometry& g, const Value& q) {
  const auto n = static_cast<std::size_t>(g.columns);
  const std::vector<double>& inverse = inverse_ramp(n);
  return scan_of(g, [&](std::size_t k, std::size_t v, std::size_t u) {
    double sum = 0;
    for (std::size_t j = 0; j < n; ++j) sum += inverse[u * n + j] * q(k, v, j);
    return sum * g.pitch_u;
  });
}

/// Samples of a band-limited function whose second derivative has a maximum of modulus 1 at `place`, from the
/// waves low .. n - 1 in phase there: mirrored, pitch 1.
inline std::vector<double> peak(std::size_t n, double place, std::size_t low) {
  std::vector<double> q(n, 0.0);
  double height = 0;
  for (std::size_t m = std::max<std::size_t>(low, 1); m < n; ++m) {
    const double w = reference::frequency(m, n), amplitude = std::cos(w * (place + 0.5));
    height += amplitude * amplitude * w * w;
    for (std::size_t i = 0; i < n; ++i) q[i] += amplitude * std::cos(w * (static_cast<double>(i) + 0.5));
  }
  for (double& x : q) x /= height;
  return q;
}

/// The middle of an upsampled column cell nearest to `x`.
inline double middle_of_column(double x, int upsampling) {
  return -0.5 + (std::floor((x + 0.5) * upsampling) + 0.5) / upsampling;
}

/// The place nearest to the middle of n samples where wave m has modulus 1.
inline double crest(std::size_t m, std::size_t n) {
  if (m == 0) return 0.5 * static_cast<double>(n - 1);
  const double period = static_cast<double>(n) / static_cast<double>(m);
  return std::round(0.5 * static_cast<double>(n) / period) * period - 0.5;
}

/// Pure wave (m, l) of 11 x 4 x 24, the axis on a crest as nearly as the middle of a column allows: there all
/// views are at their worst at once.
inline Scan wave(std::size_t m, std::size_t l, int upsampling, double sign) {
  constexpr std::size_t U = 24, V = 4;
  ParallelGeometry g = geometry(11, V, U);
  g.center = middle_of_column(std::min(crest(m, U), 0.75 * U), upsampling);
  const double z = crest(l, V) - 0.5 * (V - 1);
  return {"wave " + std::to_string(m) + ", " + std::to_string(l) + (sign > 0 ? " +" : " -"),
          unramp(g,
                 [&](std::size_t, std::size_t v, std::size_t u) {
                   return sign * std::cos(reference::frequency(m, U) * (static_cast<double>(u) + 0.5)) *
                          std::cos(reference::frequency(l, V) * (static_cast<double>(v) + 0.5));
                 }),
          {0, 0, std::clamp(z, -1.0, 1.0)},
          upsampling};
}

/// All views peak at the axis, in the middle of a column of the given rate; along v constant (`flat`), or
/// peaked too.
inline Scan axis_peak(int upsampling, std::size_t low, double sign, bool flat) {
  constexpr std::size_t U = 24, V = 4;
  ParallelGeometry g = geometry(11, V, U);
  g.center = middle_of_column(12, upsampling);
  const double z = 0.2;
  const auto along_u = peak(U, g.center, low), along_v = peak(V, z + 0.5 * (V - 1), 1);
  return {std::string("peak on the axis, waves from ") + std::to_string(low) + (flat ? "" : ", in v too") +
              (sign > 0 ? " +" : " -"),
          unramp(g, [&](std::size_t, std::size_t v,
                        std::size_t u) { return sign * along_u[u] * (flat ? 1.0 : along_v[v]); }),
          {0, 0, z},
          upsampling};
}

/// All views peak at one point off the axis; `alternate`: with the sign of the view's number.
inline Scan off_axis_peak(const ParallelGeometry& g, const Vec3& at, std::size_t low, double sign,
                          bool alternate = false) {
  const auto U = static_cast<std::size_t>(g.columns);
  std::vector<std::vector<double>> along_u;
  for (const double theta : g.theta_rad)
    along_u.push_back(
        peak(U, (at[0] * std::cos(theta) + at[1] * std::sin(theta)) / g.pitch_u + g.center, low));
  return {std::string("peak off the axis, waves from ") + std::to_string(low) +
              (alternate  ? ", signs alternate"
               : sign > 0 ? " +"
                          : " -"),
          unramp(g, [&](std::size_t k, std::size_t,
                        std::size_t u) { return (alternate && k % 2 == 1 ? -sign : sign) * along_u[k][u]; }),
          at};
}

inline ProjectionSet noise(const ParallelGeometry& g, unsigned seed, double scale = 1) {
  std::mt19937 random(seed);
  return scan_of(
      g, [&](auto, auto, auto) { return scale * (static_cast<double>(random()) / 4294967296.0 - 0.5); });
}

/// Random coefficients that decay like (1 + m)^-decay.
inline ProjectionSet band_limited(const ParallelGeometry& g, double decay, unsigned seed) {
  const auto U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<double> a(g.theta_rad.size() * U * V);
  for (std::size_t i = 0; i < a.size(); ++i)
    a[i] = normal(random) * std::pow(1 + static_cast<double>(i % U) + static_cast<double>(i / U % V), -decay);
  return unramp(g, [&](std::size_t k, std::size_t v, std::size_t u) {
    double sum = 0;
    for (std::size_t l = 0; l < V; ++l)
      for (std::size_t m = 0; m < U; ++m)
        sum += a[(k * V + l) * U + m] *
               std::cos(reference::frequency(m, U) * (static_cast<double>(u) + 0.5)) *
               std::cos(reference::frequency(l, V) * (static_cast<double>(v) + 0.5));
    return sum;
  });
}

/// Line integrals of a cube of the given half side at the axis, exact at the columns' centres: a trapezoid.
inline ProjectionSet cube(const ParallelGeometry& g, double half) {
  return scan_of(g, [&](std::size_t k, std::size_t v, std::size_t u) {
    const double c = std::abs(std::cos(g.theta_rad[k])), s = std::abs(std::sin(g.theta_rad[k]));
    const double t = std::abs((static_cast<double>(u) - g.center) * g.pitch_u),
                 z = std::abs((static_cast<double>(v) - 0.5 * static_cast<double>(g.rows - 1)) * g.pitch_v);
    const double outer = half * (c + s), inner = half * std::abs(c - s);
    if (t >= outer || z > half) return 0.0;
    const double full = 2 * half / std::max(c, s);
    return t <= inner ? full : full * (outer - t) / (outer - inner);
  });
}

/// Scans with nothing in common but that they are awkward.
inline std::vector<Scan> awkward_scans() {
  std::vector<Scan> all;
  const auto add = [&](std::string name, ProjectionSet data, Vec3 target = {1.1, -2.3, 0.1}) {
    all.push_back({std::move(name), std::move(data), target, 0});
  };
  const ParallelGeometry g = geometry(11, 4, 24), row = geometry(44, 1, 24), two = geometry(22, 2, 24);
  for (const unsigned seed : {1u, 2u, 3u, 4u}) add("noise " + std::to_string(seed), noise(g, seed));
  for (const double decay : {0.0, 1.0, 2.0, 3.0})
    add("random band-limited, decay " + std::to_string(static_cast<int>(decay)), band_limited(g, decay, 9));
  add("checkerboard", scan_of(g, [](auto, auto v, auto u) { return (u + v) % 2 == 0 ? 1.0 : -1.0; }));
  add("checkerboard that changes sign by view",
      scan_of(g, [](auto k, auto v, auto u) { return (u + v + k) % 2 == 0 ? 1.0 : -1.0; }));
  add("columns at Nyquist", scan_of(g, [](auto, auto, auto u) { return u % 2 == 0 ? 1.0 : -1.0; }));
  add("rows at Nyquist", scan_of(g, [](auto, auto v, auto) { return v % 2 == 0 ? 1.0 : -1.0; }));
  for (const auto& [name, v, u] :
       {std::tuple{"centre", 2u, 12u}, {"edge", 2u, 0u}, {"far edge", 1u, 23u}, {"corner", 0u, 0u}}) {
    const auto sv = static_cast<std::size_t>(v), su = static_cast<std::size_t>(u);
    add(std::string("spike of one view, ") + name,
        scan_of(g, [=](auto k, auto y, auto x) { return k == 4 && y == sv && x == su ? 1.0 : 0.0; }));
    add(std::string("spike of every view, ") + name,
        scan_of(g, [=](auto, auto y, auto x) { return y == sv && x == su ? 1.0 : 0.0; }));
  }
  add("sharp cube", cube(g, 4.3), {4.3, 4.3, 0.4});
  add("sharp cube, small", cube(g, 1.0), {1.0, 1.0, 0.2});
  add("cube cut by the detector", cube(g, 14), {8, 1, 0.2});
  add("constant", scan_of(g, [](auto, auto, auto) { return 1.0; }));
  add("zero", scan_of(g, [](auto, auto, auto) { return 0.0; }));
  add("ramp cut at the edge", scan_of(g, [](auto, auto, auto u) { return 1.0 + static_cast<double>(u); }),
      {9.5, 2, 0.1});
  add("step at the last column", scan_of(g, [](auto, auto, auto u) { return u >= 22 ? 1.0 : 0.0; }),
      {9.5, 2, 0.1});
  add("one view of 1e6 among ones", scan_of(g, [](auto k, auto v, auto u) {
        return (k == 3 ? 1e6 : 1.0) * ((u * 7 + v * 3) % 5 == 0 ? 1.0 : 0.2);
      }));
  add("huge, 1e30", noise(g, 5, 1e30));
  add("small, 1e-25", noise(g, 6, 1e-25));
  for (const int e : {-44, -40, -38, -30, 36})
    add("noise of 1e" + std::to_string(e), noise(g, 6, std::pow(10.0, e)));
  add("denormals among ones", scan_of(g, [](auto k, auto v, auto u) {
        return (u + v + k) % 3 == 0 ? 1.0 : 1e-40 * static_cast<double>(u + 1);
      }));
  add("one row", noise(row, 7), {1.1, -2.3, 0});
  add("one row, peak", off_axis_peak(row, {1.2, 0.7, 0}, 8, 1).data, {1.2, 0.7, 0});
  add("two rows", noise(two, 8));
  add("two rows, checkerboard",
      scan_of(two, [](auto, auto v, auto u) { return (u + v) % 2 == 0 ? 1.0 : -1.0; }));
  for (const std::int64_t columns : {21, 22, 23})
    add(std::to_string(columns) + " columns", noise(geometry(11, 4, columns), 10));
  add("2 views", noise(geometry(2, 22, 24), 11), {1.1, -2.3, 2.1});
  for (const bool alternate : {false, true}) {
    const Scan s = off_axis_peak(g, {2.3, -1.7, 0.2}, 6, 1, alternate);
    add(s.name, s.data, s.target);
  }
  for (const double sign : {1.0, -1.0}) {
    const Scan s = off_axis_peak(g, {-3.1, 2.2, -0.3}, 16, sign);
    add(s.name, s.data, s.target);
  }
  ParallelGeometry full = geometry(11, 4, 24, 360), uneven = g, coincident = g, near = g, off = g, pitch = g;
  for (std::size_t k = 0; k < 11; ++k)
    uneven.theta_rad[k] = std::numbers::pi * std::pow(static_cast<double>(k) / 11, 1.7);
  coincident.theta_rad[5] = coincident.theta_rad[4];
  coincident.theta_rad[6] = coincident.theta_rad[4];
  near.theta_rad[5] = near.theta_rad[4] + 1e-6;
  off.center = 9.3;
  pitch.pitch_u = 0.7;
  pitch.pitch_v = 1.3;
  for (const auto& [name, used] : {std::pair{"360 degrees", full},
                                   {"uneven angles", uneven},
                                   {"coincident angles", coincident},
                                   {"nearly coincident angles", near},
                                   {"centre off the middle", off},
                                   {"oblong pixels", pitch}}) {
    add(std::string(name) + ", noise", noise(used, 12), {0.6, -1.3, 0.1});
    add(std::string(name) + ", peak", off_axis_peak(used, {1.4, 0.9, 0}, 10, -1).data, {1.4, 0.9, 0});
  }
  return all;
}

}  // namespace vdvr::attacks
