// Cone-beam scans drawn from seeds to break the bounds of docs/error-bounds.md, section 16: orbits, fields
// that are at their worst where a target is seen, small grids around it. Called by cone_attacks.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "host/field/fdk/fdk_weights.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/scan/geometry/vectors.hpp"
#include "tests/support/attack_scans.hpp"
#include "vdvr/expert/rates.hpp"

namespace vdvr::attacks {

/// One attack; the seed alone makes it again.
struct ConeCase {
  double half_angle_deg = 0;
  std::string orbit, field, place;
  ProjectionSet scan;
  Vec3 target{0, 0, 0};
  Grid grid;
  Rates rates;
  double cells = 1;  ///< the grid's spacing, in pixels at the axis
};

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_()) / 18446744073709551616.0);
  }
  /// Of 0 .. n - 1.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }
  bool one_in(std::size_t n) { return below(n) == 0; }
  double sign() { return one_in(2) ? 1 : -1; }
  template <class T, std::size_t n>
  const T& of(const std::array<T, n>& all) {
    return all[below(n)];
  }

 private:
  std::mt19937_64 random_;
};

// --- orbits ---

/// What an orbit is drawn from; lengths in pixels at the axis until views have them in `unit`.
struct Orbit {
  std::string name;
  std::int64_t views = 12, columns = 16, rows = 1;
  double half_angle_deg = 5, pitch_v = 1, unit = 1, arc_deg = 360, shift = 0, source_to_axis = 0;
  double in_plane_deg = 0, out_of_plane_deg = 0;
  double jitter = 0;    ///< 0, or what all nine parameters of a view vary by
  bool uneven = false;  ///< angles
  bool as_is = false;   ///< of a displaced detector: no columns of zeros, no weights
  bool is_short() const { return arc_deg < 360; }
};

inline Orbit draw_orbit(Draw& draw) {
  constexpr std::array<double, 6> half_angles{0.5, 5, 10, 15, 20, 30};
  constexpr std::array<double, 4> units{1, 1, 1e-6, 1e6};
  constexpr double degree = std::numbers::pi / 180;
  Orbit o;
  o.half_angle_deg = draw.of(half_angles);
  o.unit = draw.of(units);
  o.views = 12 + static_cast<std::int64_t>(draw.below(29));
  o.columns = 16 + static_cast<std::int64_t>(draw.below(33));
  const std::size_t of_rows = draw.below(5);
  o.rows =
      of_rows == 0 ? 1 : static_cast<std::int64_t>(of_rows == 1 ? 2 + draw.below(4) : 6 + draw.below(19));
  const double half_width = 0.5 * static_cast<double>(o.columns);
  o.source_to_axis = half_width / std::tan(o.half_angle_deg * degree);
  // Rows one pixel apart, or as far as makes the cone's half angle that of the fan.
  if (o.rows > 1 && draw.one_in(2)) o.pitch_v = half_width / (0.5 * static_cast<double>(o.rows));
  o.name = o.rows == 1 ? "fan beam" : o.rows < 6 ? "few rows" : "rows";
  const std::size_t kind = draw.below(4);
  if (kind == 1) {
    o.arc_deg = 180 + 2 * o.half_angle_deg + draw.between(4, 30);
    o.name += ", short scan";
  } else if (kind == 2) {
    o.shift = draw.sign() * draw.between(0.12, 0.3) * static_cast<double>(o.columns);
    o.as_is = draw.one_in(3);
    o.name += o.as_is ? ", displaced, not weighed" : ", displaced";
  }
  if (o.rows > 1) {  // planes of single rows that are tilted have no region in common
    const std::size_t bent = draw.below(4);
    if (bent == 1) {
      o.in_plane_deg = draw.between(-3, 3);
      o.out_of_plane_deg = draw.between(-3, 3);
      o.name += ", tilted";
    } else if (bent == 2) {
      o.jitter = draw.between(0.05, 0.5);
      o.name += ", jittered";
    }
  }
  o.uneven = draw.one_in(3);
  if (o.uneven) o.name += ", uneven angles";
  return o;
}

inline double angle_of(const Orbit& o, std::int64_t view, Draw& draw) {
  const double gaps = static_cast<double>(o.is_short() ? o.views - 1 : o.views);
  const bool at_end = o.is_short() && (view == 0 || view == o.views - 1);
  const double off = o.uneven && !at_end ? draw.between(-0.3, 0.3) : 0.0;
  return o.arc_deg * std::numbers::pi / 180 * (static_cast<double>(view) + off) / gaps;
}

inline ViewMatrix draw_view(const Orbit& o, std::int64_t k, Draw& draw) {
  constexpr double degree = std::numbers::pi / 180;
  const auto noise = [&] { return o.jitter > 0 ? o.jitter * draw.between(-1, 1) : 0.0; };
  CircularView v;
  v.theta_rad = angle_of(o, k, draw) + 0.3 * degree * noise();
  v.source_to_axis = o.source_to_axis * (1 + 0.02 * noise()) * o.unit;
  // The pitches are those at the axis.
  const double zoom = 1.5 * (1 + 0.02 * noise());
  v.source_to_detector = v.source_to_axis * zoom;
  v.pitch_u = 1.5 * o.unit;
  v.pitch_v = 1.5 * o.pitch_v * o.unit;
  v.center = 0.5 * static_cast<double>(o.columns - 1) - o.shift;
  v.row = 0.5 * static_cast<double>(o.rows - 1);
  v.in_plane_rad = degree * (o.in_plane_deg + 2 * noise());
  v.out_of_plane_rad = degree * (o.out_of_plane_deg + 2 * noise());
  v.source_offset_u = noise() * o.unit;
  v.source_offset_v = noise() * o.pitch_v * o.unit;
  v.detector_offset_u = noise() * o.unit;
  v.detector_offset_v = noise() * o.pitch_v * o.unit;
  return circular_view(v);
}

inline ProjectionSet empty_scan_of(const Orbit& o, Draw& draw) {
  ProjectionSet scan;
  scan.cone.emplace();
  for (std::int64_t k = 0; k < o.views; ++k) scan.cone->views.push_back(draw_view(o, k, draw));
  scan.cone->redundancy = o.is_short()               ? Redundancy::short_scan
                          : o.shift != 0 && !o.as_is ? Redundancy::displaced
                                                     : Redundancy::full_turn;
  scan.geometry = parallel_limit(*scan.cone, o.columns, o.rows, "pixel");
  return scan;
}

// --- targets ---

inline Vec3 draw_target(const Coverage& region, Draw& draw, std::string& name) {
  const auto [low, high] = region.heights();
  const std::size_t kind = draw.below(5);
  const double angle = draw.between(0, 2 * std::numbers::pi);
  const double share = kind == 0 ? 0.0 : kind == 4 ? std::sqrt(draw.between(0, 1)) : 1.0;
  const double z = kind == 2 ? high : kind == 3 ? low : draw.between(low, high);
  constexpr std::array names{"axis", "rim", "top rim", "bottom rim", "anywhere"};
  name = names.at(kind);
  const double r = share * region.inner_radius();
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Moves each view's detector by less than a pixel, so that all see the target at the same place of theirs.
inline void shift_views(ProjectionSet& scan, const Vec3& target, double part_u, double part_v) {
  for (ViewMatrix& m : scan.cone->views) {
    const Vec3 seen = projected(m, target);
    const double du = std::round(seen[0] - part_u) + part_u - seen[0],
                 dv = scan.geometry.rows > 1 ? std::round(seen[1] - part_v) + part_v - seen[1] : 0.0;
    for (std::size_t j = 0; j < 4; ++j) {
      m[0][j] += du * m[2][j];
      m[1][j] += dv * m[2][j];
    }
  }
  scan.geometry = parallel_limit(*scan.cone, scan.geometry.columns, scan.geometry.rows, "pixel");
}

// --- fields ---

/// A field as filtered views, which samples are made from: float q[view][v][u].
using FilteredViews = std::vector<std::vector<double>>;

/// By how much each of n samples moves the derivative of even order at `place`.
inline std::vector<double> cardinal_weights(std::size_t n, double place, int order) {
  std::vector<double> w(n, 0.0);
  for (std::size_t m = 0; m < n; ++m) {
    const double omega = reference::frequency(m, n),
                 a = (m == 0 ? 1.0 : 2.0) / static_cast<double>(n) * std::pow(omega, order) *
                     std::cos(omega * (place + 0.5)) * (order % 4 == 2 ? -1.0 : 1.0);
    for (std::size_t i = 0; i < n; ++i) w[i] += a * std::cos(omega * (static_cast<double>(i) + 0.5));
  }
  return w;
}

/// Samples of 1 and -1 with which a derivative at the target is as large as it can be.
inline std::vector<double> extremal_view(std::size_t rows, std::size_t columns, const Vec3& seen, int order_u,
                                         int order_v) {
  const auto along_u = cardinal_weights(columns, seen[0], order_u),
             along_v = rows > 1 ? cardinal_weights(rows, seen[1], order_v) : std::vector<double>{1.0};
  std::vector<double> q;
  for (const double v : along_v)
    for (const double u : along_u) q.push_back(u * v < 0 ? -1.0 : 1.0);
  return q;
}

/// Waves from a share of Nyquist on, all in phase where the target is seen.
inline std::vector<double> peaked_view(std::size_t rows, std::size_t columns, const Vec3& seen, double share,
                                       bool flat) {
  const auto from = [&](std::size_t n) { return static_cast<std::size_t>(share * static_cast<double>(n)); };
  const auto along_u = peak(columns, seen[0], from(columns)),
             along_v = rows > 1 && !flat ? peak(rows, seen[1], std::min(from(rows), rows - 1))
                                         : std::vector<double>(rows, 1.0);
  std::vector<double> q;
  for (const double v : along_v)
    for (const double u : along_u) q.push_back(u * v);
  return q;
}

/// White noise whose sign makes its second derivative at the target, along u or along v, positive.
inline std::vector<double> aligned_view(std::size_t rows, std::size_t columns, const Vec3& seen, bool along_v,
                                        Draw& draw) {
  const bool of_v = along_v && rows > 1;
  const auto u = cardinal_weights(columns, seen[0], of_v ? 0 : 2),
             v = rows > 1 ? cardinal_weights(rows, seen[1], of_v ? 2 : 0) : std::vector<double>{1.0};
  std::vector<double> q;
  double second = 0;
  for (const double a : v)
    for (const double b : u) {
      q.push_back(draw.between(-1, 1));
      second += a * b * q.back();
    }
  if (second < 0)
    for (double& x : q) x = -x;
  return q;
}

/// The scan that filters to the given views, times numbers that do not depend on the pixel; where weights
/// leave nothing of a ray, nothing.
inline void take_views(ProjectionSet& scan, const FilteredViews& q) {
  const ParallelGeometry& g = scan.geometry;
  const auto n = static_cast<std::size_t>(g.columns);
  const std::vector<double>& inverse = inverse_ramp(n);
  const FdkWeights weights(*scan.cone, g.columns, g.rows);
  constexpr double least_share = 0.05;
  std::vector<float> data;
  for (std::size_t k = 0; k < q.size(); ++k)
    for (std::size_t v = 0; v < static_cast<std::size_t>(g.rows); ++v)
      for (std::size_t u = 0; u < n; ++u) {
        const auto column = static_cast<double>(u);
        const double share =
            weights.redundancy(k, column) * weights.cosine(k, column, static_cast<double>(v));
        double sum = 0;
        for (std::size_t j = 0; j < n; ++j) sum += inverse[u * n + j] * q[k][v * n + j];
        data.push_back(share > least_share ? static_cast<float>(sum / share) : 0.0f);
      }
  scan.data = std::move(data);
}

/// Samples themselves, not filtered ones.
inline void take_samples(ProjectionSet& scan, const Value& p) {
  const ParallelGeometry& g = scan.geometry;
  std::vector<float> data;
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k)
    for (std::size_t v = 0; v < static_cast<std::size_t>(g.rows); ++v)
      for (std::size_t u = 0; u < static_cast<std::size_t>(g.columns); ++u)
        data.push_back(static_cast<float>(p(k, v, u)));
  scan.data = std::move(data);
}

/// An ellipsoid along the axes.
struct Ellipsoid {
  Vec3 middle{}, half{};
  double density = 1;
  [[nodiscard]] double chord(const Vec3& source, const Vec3& ray) const {
    Vec3 s{}, d{};
    for (std::size_t a = 0; a < 3; ++a) {
      s[a] = (source[a] - middle[a]) / half[a];
      d[a] = ray[a] / half[a];
    }
    const double dd = dot(d, d), sd = dot(s, d), under = sd * sd - dd * (dot(s, s) - 1);
    return under > 0 ? 2 * std::sqrt(under) / dd : 0.0;
  }
};

inline void take_ellipsoids(ProjectionSet& scan, const Coverage& region, const Vec3& target, Draw& draw) {
  const double r = region.inner_radius();
  const double tall = std::max(region.heights().second - region.heights().first, 0.2 * r);
  std::vector<Ellipsoid> all;
  for (int i = 0; i < 8; ++i) {
    Ellipsoid e;
    for (std::size_t a = 0; a < 3; ++a) {
      const double size = a == 2 ? tall : r;
      e.middle[a] = i == 0 ? target[a] : draw.between(-0.7, 0.7) * size;
      e.half[a] = draw.between(0.03, 0.5) * size;
    }
    e.density = draw.between(-1, 1) / r;
    all.push_back(e);
  }
  std::vector<ConeView> views;
  for (const ViewMatrix& m : scan.cone->views) views.push_back(cone_view(m));
  take_samples(scan, [&](std::size_t k, std::size_t v, std::size_t u) {
    const Vec3 ray = views[k].ray(static_cast<double>(u), static_cast<double>(v));
    double sum = 0;
    for (const Ellipsoid& e : all) sum += e.density * e.chord(views[k].source, ray);
    return sum;
  });
}

inline void take_hot_pixels(ProjectionSet& scan, const Vec3& target, bool in_all_views, Draw& draw) {
  const ParallelGeometry& g = scan.geometry;
  const std::size_t only = draw.below(scan.cone->views.size());
  const auto nearest = [](double place, std::int64_t n) {
    return static_cast<std::size_t>(std::clamp(std::round(place), 0.0, static_cast<double>(n - 1)));
  };
  take_samples(scan, [&](std::size_t k, std::size_t v, std::size_t u) {
    if (!in_all_views && k != only) return 0.0;
    const Vec3 seen = projected(scan.cone->views[k], target);
    return u == nearest(seen[0], g.columns) && v == nearest(seen[1], g.rows) ? 1.0 : 0.0;
  });
}

/// Views that are each at their worst where they see the target, with signs that agree or take turns.
inline std::string take_targeted(ProjectionSet& scan, const Vec3& target, std::size_t kind, Draw& draw) {
  const auto rows = static_cast<std::size_t>(scan.geometry.rows),
             columns = static_cast<std::size_t>(scan.geometry.columns);
  constexpr std::array<int, 4> orders{0, 2, 4, 6};
  const int order_u = draw.of(orders), order_v = draw.of(orders);
  const double share = draw.between(0, 0.97), first_sign = draw.sign();
  const bool flag = draw.one_in(2), in_turn = draw.one_in(5);
  FilteredViews q;
  for (std::size_t k = 0; k < scan.cone->views.size(); ++k) {
    const Vec3 seen = projected(scan.cone->views[k], target);
    q.push_back(kind == 0   ? extremal_view(rows, columns, seen, order_u, order_v)
                : kind == 1 ? peaked_view(rows, columns, seen, share, flag)
                            : aligned_view(rows, columns, seen, flag, draw));
    const double sign = in_turn && k % 2 == 1 ? -first_sign : first_sign;
    for (double& x : q.back()) x *= sign;
  }
  take_views(scan, q);
  const std::string signs = in_turn ? ", signs in turn" : first_sign > 0 ? " +" : " -";
  if (kind == 0)
    return "extremal samples of orders " + std::to_string(order_u) + ", " + std::to_string(order_v) + signs;
  if (kind == 1)
    return "peak from " + std::to_string(share) + " of Nyquist" + (flag ? "" : ", in v too") + signs;
  return std::string("noise aligned along ") + (flag ? "v" : "u") + signs;
}

/// One wave of one view: what filters and tables err is not lost among other frequencies.
inline std::string take_wave(ProjectionSet& scan, Draw& draw) {
  const auto rows = static_cast<std::size_t>(scan.geometry.rows),
             columns = static_cast<std::size_t>(scan.geometry.columns);
  const std::size_t m = columns - 1 - draw.below(columns / 2), l = draw.one_in(2) ? 0 : draw.below(rows),
                    only = draw.below(scan.cone->views.size());
  FilteredViews q(scan.cone->views.size(), std::vector<double>(rows * columns, 0.0));
  for (std::size_t v = 0; v < rows; ++v)
    for (std::size_t u = 0; u < columns; ++u)
      q[only][v * columns + u] = std::cos(reference::frequency(m, columns) * (static_cast<double>(u) + 0.5)) *
                                 std::cos(reference::frequency(l, rows) * (static_cast<double>(v) + 0.5));
  take_views(scan, q);
  return "wave " + std::to_string(m) + ", " + std::to_string(l) + " of view " + std::to_string(only);
}

inline std::string take_field(ProjectionSet& scan, const Coverage& region, const Vec3& target, Draw& draw) {
  const std::size_t kind = draw.below(11);
  if (kind < 6) return take_targeted(scan, target, kind % 3, draw);
  if (kind == 6) {
    take_samples(scan, [&](auto, auto, auto) { return draw.between(-1, 1); });
    return "white noise";
  }
  if (kind == 7) {
    const std::size_t which = draw.below(3);
    const bool by_view = draw.one_in(2);
    take_samples(scan, [&](std::size_t k, std::size_t v, std::size_t u) {
      const std::size_t n = (which != 1 ? u : 0) + (which != 0 ? v : 0) + (by_view ? k : 0);
      return n % 2 == 0 ? 1.0 : -1.0;
    });
    return std::string("Nyquist in ") +
           (which == 0   ? "u"
            : which == 1 ? "v"
                         : "u and v") +
           (by_view ? ", signs in turn" : "");
  }
  if (kind == 8) {
    take_ellipsoids(scan, region, target, draw);
    return "ellipsoids";
  }
  if (kind == 9) return take_wave(scan, draw);
  const bool in_all_views = draw.one_in(2);
  take_hot_pixels(scan, target, in_all_views, draw);
  return in_all_views ? "hot pixels at the target" : "hot pixel";
}

// --- cases ---

/// A base cell or four around the target, which lies in the middle of a gold cell, on a node, or between.
inline Grid draw_grid(const ParallelGeometry& g, const Vec3& target, const Rates& rates, double cells,
                      Draw& draw) {
  Grid grid;
  const std::int64_t across = rates.gold < 16 ? 2 : 1;
  grid.cells = {across, across, 1};
  grid.spacing = {cells * g.pitch_u, cells * g.pitch_u, cells * (g.rows > 1 ? g.pitch_v : g.pitch_u)};
  const std::size_t kind = draw.below(3);
  for (std::size_t a = 0; a < 3; ++a) {
    const auto middle = static_cast<double>(rates.gold * grid.cells[a] / 2);
    const double part = kind == 0 ? 0.5 : kind == 1 ? 0.0 : draw.between(0, 1);
    grid.origin[a] = target[a] - (middle + part) / rates.gold * grid.spacing[a];
  }
  return grid;
}

/// Throws InputError where the library refuses the orbit.
inline ConeCase draw_cone_case(std::uint64_t seed) {
  Draw draw(seed);
  ConeCase c;
  const Orbit orbit = draw_orbit(draw);
  c.half_angle_deg = orbit.half_angle_deg;
  c.orbit = orbit.name + ", " + std::to_string(orbit.views) + " views of " + std::to_string(orbit.columns) +
            " x " + std::to_string(orbit.rows);
  c.scan = empty_scan_of(orbit, draw);
  c.target = draw_target(certified_coverage(c.scan, {}), draw, c.place);
  // A pixel's centre; the middle between two of six columns a pixel; as it is.
  if (const std::size_t shift = draw.below(3); shift < 2) {
    const double part = shift == 0 ? 0.0 : 1.0 / 12;
    shift_views(c.scan, c.target, part, part);
    c.place += shift == 0 ? ", at pixels' centres" : ", between dense columns";
  }
  c.field = take_field(c.scan, certified_coverage(c.scan, {}), c.target, draw);
  constexpr std::array<int, 3> gold{4, 8, 16};
  constexpr std::array<double, 3> cells{0.6, 1, 2};
  c.rates = {6, Interpolation::eight_taps, draw.of(gold)};
  c.cells = draw.of(cells);
  c.grid = draw_grid(c.scan.geometry, c.target, c.rates, c.cells, draw);
  constexpr std::array<int, 2> differences{dense_differences, sparse_differences};
  c.rates.differences = draw.of(differences);
  return c;
}

}  // namespace vdvr::attacks
