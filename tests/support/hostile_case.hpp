// A hostile build drawn from a seed: a scan made to break bounds, a grid, options, and the units it is
// measured in. Lengths are in pixels and densities about 1 until `inputs_at` gives them a scale, so that the
// same case can be built at any. Called by hostile_builds.cpp and attack_scales_test.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "host/field/fbp/coverage.hpp"
#include "host/scan/prepare/heights.hpp"
#include "tests/support/attack_scans.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/build.hpp"
#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/preparation.hpp"
#include "vdvr/expert/reconstruct.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr::hostile {

/// World units per column and per row, and what a density of 1 becomes.
struct Scale {
  double pitch_u = 1, pitch_v = 1, density = 1;

  [[nodiscard]] bool is_one() const { return pitch_u == 1 && pitch_v == 1 && density == 1; }
  [[nodiscard]] bool is_exact() const {
    const auto power = [](double x) {
      int exponent = 0;
      return std::frexp(x, &exponent) == 0.5;
    };
    return power(pitch_u) && power(pitch_v) && power(density);
  }
};

enum class Against { range, largest, absolute };  ///< what a tolerance is a fraction of

/// Lengths in pixels (rows along z), tolerance and window as fractions of the field's range.
struct Case {
  std::string name;
  ProjectionSet scan;
  Vec3 target{0, 0, 0};  ///< where the field is at its worst, if the scan has such a place
  Grid grid;
  FieldOptions field;
  RateOptions rates;
  PlanSettings settings;
  BuildOptions options;
  double epsilon = 0.03;
  Against against = Against::range;
  std::optional<std::pair<double, double>> window;
  /// A tolerance of its own for each brick, 1 to 8 epsilon, promised in sigma; drawn from this.
  std::optional<std::uint64_t> sigma_seed;
  Scale scale;
  double low = 0, high = 0;  ///< of F over covered grid samples at scale 1, in double
};

/// What make_plan and build take.
struct Inputs {
  ProjectionSet scan;
  Grid grid;
  FieldOptions field;
  RateOptions rates;
  PlanSettings settings;
  BuildOptions options;
  Tolerance tolerance;
  std::optional<std::uint64_t> sigma_seed;
  bool data_exact = true;  ///< the scan's floats are those of scale 1 times a factor, to the bit
};

inline Inputs inputs_at(const Case& c, const Scale& s) {
  Inputs in{c.scan, c.grid, c.field, c.rates, c.settings, c.options, {}, c.sigma_seed, s.is_exact()};
  ParallelGeometry& g = in.scan.geometry;
  g.pitch_u *= s.pitch_u;
  g.pitch_v *= s.pitch_v;
  if (in.scan.cone) {
    for (ViewMatrix& m : in.scan.cone->views)
      for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t a = 0; a < 3; ++a)
          m[row][a] /= s.pitch_u;  // of cone beam one factor for all lengths
    g = parallel_limit(*in.scan.cone, g.columns, g.rows, g.unit);
  }
  const double integral = s.density * s.pitch_u;
  for (float& p : in.scan.data) {
    const double exact = static_cast<double>(p) * integral;
    p = static_cast<float>(exact);
    if (!(static_cast<double>(p) == exact)) in.data_exact = false;
  }
  const std::array<double, 3> length{s.pitch_u, s.pitch_u, s.pitch_v};
  for (std::size_t a = 0; a < 3; ++a) {
    in.grid.origin[a] *= length[a];
    in.grid.spacing[a] *= length[a];
    if (in.options.roi) {
      (*in.options.roi)[a] *= length[a];
      (*in.options.roi)[a + 3] *= length[a];
    }
  }
  const double range = c.high - c.low;
  const auto density_at = [&](double share) { return (c.low + share * range) * s.density; };
  if (c.window) in.options.window = {density_at(c.window->first), density_at(c.window->second)};
  if (c.against == Against::absolute) in.tolerance.absolute = c.epsilon * range * s.density;
  else in.tolerance.relative = c.epsilon;
  in.settings.comparison.epsilon_of_max = c.against == Against::largest;
  return in;
}

/// Why line integrals or F do not fit float32 at this scale, judged in double; empty where they do. Only
/// there a build may be refused that succeeds at scale 1. Of F the largest must be finite, with a factor of 4
/// for what lies between the grid's samples, and the tolerance no smaller than the smallest normal number.
inline std::string misfit(const Case& c, const Scale& s) {
  constexpr double most = static_cast<double>(std::numeric_limits<float>::max()),
                   least = static_cast<double>(std::numeric_limits<float>::min());
  double integral = 0;
  for (const float p : c.scan.data) integral = std::max(integral, std::abs(static_cast<double>(p)));
  integral *= s.density * s.pitch_u;
  const double F = s.density * std::max(std::abs(c.low), std::abs(c.high)),
               epsilon = c.epsilon * (c.against == Against::largest ? F : s.density * (c.high - c.low));
  if (!(integral <= most)) return "line integrals above float32";
  if (integral < least) return "line integrals below float32";
  if (!(4 * F <= most)) return "F above float32";
  if (epsilon < least) return "epsilon below float32";
  return {};
}

namespace detail {

using Random = std::mt19937_64;

inline double unit(Random& random) { return std::uniform_real_distribution<double>(0, 1)(random); }
inline bool chance(Random& random, double p) { return unit(random) < p; }
template <class T>
T one_of(Random& random, std::initializer_list<T> all) {
  return *(all.begin() + std::uniform_int_distribution<std::ptrdiff_t>(
                             0, static_cast<std::ptrdiff_t>(all.size()) - 1)(random));
}

inline ParallelGeometry draw_geometry(Random& random, std::string& name) {
  const auto views = one_of<std::int64_t>(random, {2, 3, 5, 8, 11, 13, 16, 24, 32}),
             rows = one_of<std::int64_t>(random, {1, 2, 3, 4, 5, 7, 9}),
             columns = one_of<std::int64_t>(random, {8, 11, 12, 13, 16, 17, 19, 23, 24, 29});
  ParallelGeometry g = attacks::geometry(views, rows, columns);
  const auto K = static_cast<std::size_t>(views);
  name = std::to_string(views) + " x " + std::to_string(rows) + " x " + std::to_string(columns);
  switch (std::uniform_int_distribution<int>(0, 9)(random)) {
    case 0:
      g = attacks::geometry(views, rows, columns, 360);
      name += ", 360 degrees";
      break;
    case 1:
      for (std::size_t k = 0; k < K; ++k)
        g.theta_rad[k] = std::numbers::pi * std::pow(static_cast<double>(k) / static_cast<double>(K), 1.7);
      name += ", uneven angles";
      break;
    case 2:
      if (K >= 5) g.theta_rad[3] = g.theta_rad[4] = g.theta_rad[2];
      name += ", coincident angles";
      break;
    case 3:
      g.theta_rad[1] = g.theta_rad[0] + 1e-6;
      name += ", nearly coincident angles";
      break;
    case 4:
      g = attacks::geometry(views, rows, columns, 110);
      name += ", 110 degrees";
      break;
    default:
      break;
  }
  if (chance(random, 0.25)) {
    g.center = (0.4 + 0.2 * unit(random)) * static_cast<double>(columns - 1);
    name += ", centre off";
  }
  return g;
}

/// A sphere as `vdvr simulate` makes it, noise included.
inline ProjectionSet noisy_sphere(const ParallelGeometry& g, double sigma, std::uint64_t seed) {
  SimulateOptions o;
  o.angles = static_cast<int>(g.views());
  o.columns = g.columns;
  o.rows = g.rows;
  o.noise_sigma = sigma;
  o.seed = seed;
  const double half_u = 0.5 * static_cast<double>(g.columns - 1),
               half_v = 0.5 * static_cast<double>(g.rows - 1);
  ProjectionSet scan = simulate(sphere(0.75 * (half_v > 0 ? std::min(half_u, half_v) : half_u)), o);
  scan.geometry = g;  // the object looks the same from every side
  return scan;
}

/// Wave (m, l), the axis on a crest as nearly as the middle of a column allows: all views at their worst
/// there.
inline void draw_wave(Random& random, ParallelGeometry g, Case& c) {
  const auto U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);
  // Near Nyquist along u, along v, or both.
  const bool along_v = chance(random, 0.3), along_u = !along_v || chance(random, 0.3);
  const std::size_t m = along_u ? (chance(random, 0.7) ? U - 1 - random() % 2 : random() % U) : 0,
                    l = along_v && V > 1 ? V - 1 - random() % 2 : random() % V;
  const int upsampling = one_of(random, {2, 4, 8});
  g.center = attacks::middle_of_column(
      std::clamp(attacks::crest(m, U), 0.3 * static_cast<double>(U), 0.7 * static_cast<double>(U)),
      upsampling);
  const double sign = chance(random, 0.5) ? 1 : -1, half = 0.5 * static_cast<double>(V - 1);
  c.name += ", wave " + std::to_string(m) + ", " + std::to_string(l);
  c.scan = attacks::unramp(g, [&](std::size_t, std::size_t v, std::size_t u) {
    return sign * std::cos(reference::frequency(m, U) * (static_cast<double>(u) + 0.5)) *
           std::cos(reference::frequency(l, V) * (static_cast<double>(v) + 0.5));
  });
  c.target = {0, 0, std::clamp(attacks::crest(l, V) - half, -half, half)};
}

/// All views peak at one point; along v constant, or peaked too.
inline void draw_peak(Random& random, ParallelGeometry g, Case& c) {
  const auto U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);
  const std::size_t low = 1 + random() % (U - 1);
  const bool on_axis = chance(random, 0.5), flat = V == 1 || chance(random, 0.5),
             alternate = chance(random, 0.2);
  const double sign = chance(random, 0.5) ? 1 : -1, half = 0.5 * static_cast<double>(V - 1);
  if (on_axis) {
    g.center = attacks::middle_of_column(0.5 * static_cast<double>(U), one_of(random, {2, 4, 8, 16}));
    c.target = {0, 0, (2 * unit(random) - 1) * half};
  } else {
    const double reach = 0.25 * static_cast<double>(U);
    c.target = {reach * (unit(random) - 0.5), reach * (unit(random) - 0.5), (2 * unit(random) - 1) * half};
  }
  std::vector<std::vector<double>> along_u;
  for (const double theta : g.theta_rad)
    along_u.push_back(attacks::peak(
        U, c.target[0] * std::cos(theta) + c.target[1] * std::sin(theta) + g.center_of_view(along_u.size()),
        low));
  const auto along_v = flat ? std::vector<double>(V, 1.0) : attacks::peak(V, c.target[2] + half, 1);
  c.name += std::string(on_axis ? ", peak on the axis" : ", peak off the axis") + ", waves from " +
            std::to_string(low) + (flat ? "" : ", in v too") + (alternate ? ", signs alternate" : "");
  c.scan = attacks::unramp(g, [&](std::size_t k, std::size_t v, std::size_t u) {
    return (alternate && k % 2 == 1 ? -sign : sign) * along_u[k][u] * along_v[v];
  });
}

inline void draw_awkward(Random& random, const ParallelGeometry& g, Case& c) {
  const auto U = static_cast<std::size_t>(g.columns), V = static_cast<std::size_t>(g.rows);
  const std::size_t su = random() % U, sv = random() % V;
  const auto make = [&](const char* name, const attacks::Value& p) {
    c.name += std::string(", ") + name;
    c.scan = attacks::scan_of(g, p);
  };
  switch (std::uniform_int_distribution<int>(0, 11)(random)) {
    case 0:
      return make("checkerboard", [](auto, auto v, auto u) { return (u + v) % 2 == 0 ? 1.0 : -1.0; });
    case 1:
      return make("checkerboard by view",
                  [](auto k, auto v, auto u) { return (u + v + k) % 2 == 0 ? 1.0 : -1.0; });
    case 2:
      return make("columns at Nyquist", [](auto, auto, auto u) { return u % 2 == 0 ? 1.0 : -1.0; });
    case 3:
      return make("rows at Nyquist", [](auto, auto v, auto) { return v % 2 == 0 ? 1.0 : -1.0; });
    case 4:
      return make("spike of one view",
                  [=](auto k, auto v, auto u) { return k == 1 && v == sv && u == su ? 1.0 : 0.0; });
    case 5:
      return make("spike of every view",
                  [=](auto, auto v, auto u) { return v == sv && u == su ? 1.0 : 0.0; });
    case 6:
      return make("constant", [](auto, auto, auto) { return 1.0; });
    case 7:
      return make("ramp cut at the edge", [](auto, auto, auto u) { return 1.0 + static_cast<double>(u); });
    case 8:
      return make("step at the last column", [=](auto, auto, auto u) { return u + 2 >= U ? 1.0 : 0.0; });
    case 9:
      return make("one view of 1e6", [](auto k, auto v, auto u) {
        return (k == 1 ? 1e6 : 1.0) * ((u * 7 + v * 3) % 5 == 0 ? 1.0 : 0.2);
      });
    case 10:
      return make("denormals among ones", [](auto k, auto v, auto u) {
        return (u + v + k) % 3 == 0 ? 1.0 : 1e-40 * static_cast<double>(u + 1);
      });
    default:
      c.name += ", cube";
      c.scan = attacks::cube(g, (0.05 + 0.6 * unit(random)) * static_cast<double>(U));
  }
}

/// One case in five is of a sample that moved between views: along columns by up to a fifth of them, at
/// random or in two steps, along rows by up to all but one, by whole rows or not. Drawn apart, so that other
/// cases stay as they are.
inline void draw_shifts(std::uint64_t seed, ParallelGeometry& g, std::string& name) {
  Random random(seed * 0xa0761d6478bd642fu + 11);
  if (!chance(random, 0.2)) return;
  const bool along_columns = chance(random, 0.75),
             along_rows = g.rows > 1 && (!along_columns || chance(random, 0.5)), steps = chance(random, 0.3),
             whole = chance(random, 0.3);
  const double wide = 0.2 * static_cast<double>(g.columns) * unit(random),
               high = 0.5 * static_cast<double>(g.rows - 1) * unit(random);
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
    const auto at = [&](double reach) {
      const double shift = reach * (steps ? (2 * k < g.theta_rad.size() ? -1 : 1) : 2 * unit(random) - 1);
      return whole ? std::trunc(shift) : shift;
    };
    if (along_columns) g.column_shift.push_back(at(wide));
    if (along_rows) g.row_shift.push_back(at(high));
  }
  name +=
      std::string(", shifted") + (along_columns ? " along columns" : "") + (along_rows ? " along rows" : "");
}

/// One case in five of those with rows to spare is of an axis that leans, by as much as leaves a row. Drawn
/// apart, so that other cases stay as they are.
inline void draw_roll(std::uint64_t seed, ProjectionSet& scan, std::string& name) {
  Random random(seed * 0x8ebc6af09c88c6e3u + 13);
  ParallelGeometry& g = scan.geometry;
  if (!chance(random, 0.3) || g.rows < 2) return;
  double range = 0;
  if (!g.row_shift.empty()) {
    const auto [least, most] = std::minmax_element(g.row_shift.begin(), g.row_shift.end());
    range = *most - *least;
  }
  // Shifts along columns are seen along the axis too, by no more than a fifth of them.
  const double spare = static_cast<double>(g.rows - 1) - range, wide = 1.5 * static_cast<double>(g.columns);
  const double most = std::min(spare / wide, 0.17) * 180 / std::numbers::pi;
  if (!(most > 0.05)) return;
  g.axis_roll_deg = (chance(random, 0.5) ? 1 : -1) * most * (0.2 + 0.8 * unit(random));
  name += ", axis leans by " + std::to_string(g.axis_roll_deg);
}

/// One case in five of those with rows and views to spare, and no shift, saw its heights one after another:
/// in two or three stands whose views come by turns, or on a helix. Drawn apart, so that other cases stay as
/// they are.
inline void draw_series(std::uint64_t seed, ProjectionSet& scan, std::string& name) {
  Random random(seed * 0xe7037ed1a0b428dbu + 17);
  ParallelGeometry& g = scan.geometry;
  if (!chance(random, 0.25) || g.rows < 3 || g.views() < 8 || !g.row_shift.empty() || g.axis_roll_deg != 0)
    return;
  ProjectionSet moved = scan;
  ParallelGeometry& m = moved.geometry;
  const bool helix = chance(random, 0.5), whole = chance(random, 0.3);
  const auto stands = one_of<std::int64_t>(random, {2, 3});
  const double step = (0.2 + 0.7 * unit(random)) * static_cast<double>(m.rows);
  for (std::int64_t k = 0; k < m.views(); ++k) {
    const double turns = static_cast<double>(stands * k) / static_cast<double>(m.views()),
                 shift = helix ? 0.5 * step * turns : step * static_cast<double>(k % stands);
    m.row_shift.push_back(whole ? std::trunc(shift) : shift);
    if (helix) m.theta_rad[static_cast<std::size_t>(k)] *= static_cast<double>(stands);
  }
  Preparation wanted;
  wanted.heights = Heights::all;
  try {
    bring_to_heights(moved, wanted, 0, {});
  } catch (const InputError&) {
    return;  // nothing is covered, or not one run
  }
  scan = std::move(moved);
  name += std::string(helix ? ", a helix of " : ", stands of ") + std::to_string(g.rows) + " heights";
}

inline void draw_scan(std::uint64_t of_shifts, Random& random, Case& c) {
  ParallelGeometry g = draw_geometry(random, c.name);
  draw_shifts(of_shifts, g, c.name);
  const auto seed = static_cast<unsigned>(random());
  switch (std::uniform_int_distribution<int>(0, 9)(random)) {
    case 0:
    case 1:
      return draw_wave(random, g, c);
    case 2:
    case 3:
      return draw_peak(random, g, c);
    case 4:
      c.name += ", noise";
      c.scan = attacks::noise(g, seed);
      return;
    case 5:
    case 6: {
      const double sigma = one_of(random, {0.0, 0.02, 0.1, 0.3});
      c.name += ", sphere, noise " + std::to_string(sigma).substr(0, 4);
      c.scan = noisy_sphere(g, sigma, seed);
      return;
    }
    case 7: {
      const double decay = one_of(random, {0.0, 1.0, 2.0, 3.0});
      c.name += ", random band-limited, decay " + std::to_string(static_cast<int>(decay));
      c.scan = attacks::band_limited(g, decay, seed);
      return;
    }
    default:
      return draw_awkward(random, g, c);
  }
}

inline void draw_options(Random& random, Case& c) {
  c.epsilon = 0.005 * std::pow(60.0, unit(random));  // .5 to 30 %
  c.against = one_of(random, {Against::range, Against::range, Against::absolute, Against::largest});
  if (chance(random, 0.5)) c.rates.upsampling = one_of(random, {2, 4, 8, 16, 32, 64});
  if (chance(random, 0.7)) c.rates.gold = one_of(random, {2, 2, 4, 4, 8, 8, 16, 32});
  c.rates.interpolation = one_of<std::optional<Interpolation>>(
      random, {std::nullopt, std::nullopt, Interpolation::linear, Interpolation::cubic});
  c.settings.comparison.coefficients =
      one_of(random, {Coefficients::midrange, Coefficients::midrange, Coefficients::sampled});
  c.settings.levels = one_of(random, {Levels::anisotropic, Levels::anisotropic, Levels::isotropic});
  if (chance(random, 0.15)) {
    c.settings.comparison.closing = Closing::paper;
    c.settings.comparison.coefficients = Coefficients::sampled;
    c.settings.levels = Levels::isotropic;
  }
  c.settings.forecast = chance(random, 0.3);
  c.settings.granularity = one_of(random, {1, 2, 2, 4, 4, 4, 8});
  c.options.storage = one_of(random, {StorageChoice::automatic, StorageChoice::automatic, StorageChoice::f32,
                                      StorageChoice::u16, StorageChoice::u8});
  if (chance(random, 0.3))
    c.field.filter =
        one_of(random, {RampWindow::shepp_logan, RampWindow::cosine, RampWindow::hamming, RampWindow::hann});
  if (chance(random, 0.15)) c.field.cutoff = one_of(random, {0.5, 0.8});
}

/// The whole covered cylinder, in cells of a pixel.
inline bool draw_whole_grid(Random& random, Case& c) {
  const ParallelGeometry& g = c.scan.geometry;
  if (!chance(random, 0.1) || g.columns > 17 || c.rates.gold.value_or(32) > 8) return false;
  c.grid = make_grid(g, {});
  c.settings.granularity = std::max(2, c.settings.granularity);
  return true;
}

/// Near the target, in the middle, at the rim of the covered disk, or anywhere in it; the place in the middle
/// of a gold cell, on a node, or anywhere between.
inline void place_grid(Random& random, Case& c) {
  const ParallelGeometry& g = c.scan.geometry;
  const double half = 0.5 * static_cast<double>(g.rows - 1), radius = Coverage(g).inner_radius() / g.pitch_u;
  Vec3 at = c.target;
  const int place = std::uniform_int_distribution<int>(0, 3)(random);
  if (place == 1) at = {0, 0, 0};
  if (place >= 2) {
    const double angle = 2 * std::numbers::pi * unit(random),
                 r = place == 2 ? radius : radius * std::sqrt(unit(random));
    at = {r * std::cos(angle), r * std::sin(angle), (2 * unit(random) - 1) * half};
  }
  const double shift = one_of(random, {0.0, 0.5 / c.rates.gold.value_or(16), unit(random)});
  for (std::size_t a = 0; a < 3; ++a)
    c.grid.origin[a] =
        at[a] - (std::floor(0.5 * static_cast<double>(c.grid.cells[a])) + shift) * c.grid.spacing[a];
  if (g.rows == 1 && chance(random, 0.5)) c.grid.origin[2] = -0.5 * c.grid.spacing[2];
}

/// Whether a sample of the grid is covered: of one row, seen from above.
inline bool meets_coverage(const Case& c) {
  const Index3 n = c.grid.samples();
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        Vec3 p = c.grid.position({x, y, z});
        if (c.scan.geometry.rows == 1) p[2] = 0;
        if (is_covered(c.scan.geometry, c.scan.geometry.center, p)) return true;
      }
  return false;
}

inline void draw_base(Random& random, Case& c) {
  if (!chance(random, 0.25)) {
    if (chance(random, 0.4)) c.settings.coarsening = LevelTriple{0, 0, 0};
    return;
  }
  LevelTriple base{};
  for (std::uint8_t& b : base) b = static_cast<std::uint8_t>(random() % 2);
  // Cells and bricks must be whole base cells.
  for (std::size_t a = 0; a < 3; ++a)
    if (base[2 - a] > 0) c.grid.cells[a] += c.grid.cells[a] % 2;
  if (c.settings.granularity == 1) c.settings.granularity = 2;
  if (c.settings.comparison.closing != Closing::paper) c.settings.coarsening = base;
}

inline void draw_region_and_window(Random& random, Case& c) {
  if (chance(random, 0.2)) {
    std::array<double, 6> roi{};
    for (std::size_t a = 0; a < 3; ++a) {
      const double length = static_cast<double>(c.grid.cells[a]) * c.grid.spacing[a];
      const double from = unit(random), to = from + (1 - from) * unit(random);
      roi[a] = c.grid.origin[a] + from * length;
      roi[a + 3] = c.grid.origin[a] + to * length;
    }
    c.options.roi = roi;
  }
  if (chance(random, 0.12)) {
    const double from = 0.6 * unit(random);
    c.window = {from, from + 0.1 + 0.4 * unit(random)};
  }
}

/// A few cells, fewer where gold is fine.
inline void draw_grid(Random& random, Case& c) {
  if (!draw_whole_grid(random, c)) {
    const ParallelGeometry& g = c.scan.geometry;
    // 7 multiply-adds a node and view are verify's: a hundred million in all.
    const double most_cells =
        1.2e7 / (std::pow(c.rates.gold.value_or(16), 3) * static_cast<double>(g.views()));
    const int wide = most_cells > 400 ? 8 : most_cells > 60 ? 5 : 2;
    for (std::size_t a = 0; a < 3; ++a)
      c.grid.cells[a] =
          std::uniform_int_distribution<std::int64_t>(1, a == 2 ? std::max(1, wide / 2) : wide)(random);
    const double d = one_of(random, {0.4, 0.7, 0.9, 1.0, 1.0, 1.3, 2.0});
    c.grid.spacing = {d, d, chance(random, 0.5) ? 1.0 : one_of(random, {0.4, 0.7, 1.0, 1.6})};
    for (int i = 0; i < 20 && (i == 0 || !meets_coverage(c)); ++i) place_grid(random, c);
    draw_base(random, c);
  }
  draw_region_and_window(random, c);
}

inline double draw_factor(Random& random, double decades, bool exact) {
  if (chance(random, 1.0 / 3)) return 1;
  // A third at the outermost sixth of the decades, where the first products leave float32.
  const double reach = chance(random, 1.0 / 3) ? (5 + unit(random)) / 6 : unit(random);
  const double tens = (chance(random, 0.5) ? 1 : -1) * reach * decades;
  return exact ? std::exp2(std::round(tens * std::log2(10.0))) : std::pow(10.0, tens);
}

/// One case in five has longer rows: of half acquisition, whose views then make a full turn about an axis
/// that leaves an overlap of ten columns or more, or padded ones, or both. Drawn apart, so that other cases
/// stay as they are.
inline void draw_longer_rows(std::uint64_t seed, Case& c) {
  Random random(seed * 0xd1342543de82ef95u + 7);
  if (!chance(random, 0.2)) return;
  ParallelGeometry& g = c.scan.geometry;
  Preparation wanted;
  wanted.half_acquisition =
      g.series.none() && g.column_shift.empty() && g.columns >= 11 && g.views() >= 3 && chance(random, 0.6);
  wanted.padding = one_of(random, {Padding::none, Padding::edge, Padding::mirror});
  if (*wanted.half_acquisition) {
    const double near = 5 + unit(random) * (0.5 * static_cast<double>(g.columns) - 5);
    g.center = (chance(random, 0.5) ? near : static_cast<double>(g.columns) - near) - 0.5;
    for (std::size_t k = 0; k < g.theta_rad.size(); ++k)
      g.theta_rad[k] = 2 * std::numbers::pi * (static_cast<double>(k) + 0.3 * (unit(random) - 0.5)) /
                       static_cast<double>(g.views());
  }
  static_cast<void>(extend_rows(c.scan, wanted));
  c.scan.report.notes.clear();
  c.name += ", " + text_of(c.scan.report.preparation);
}

}  // namespace detail

/// The range of F over the covered samples of the grid, at scale 1: of all samples where none is covered.
inline void find_range(Case& c) {
  const ExactField exact(c.scan, c.field);
  std::vector<Vec3> covered, all;
  const Index3 n = c.grid.samples();
  for (std::int64_t z = 0; z < n[2]; ++z)
    for (std::int64_t y = 0; y < n[1]; ++y)
      for (std::int64_t x = 0; x < n[0]; ++x) {
        all.push_back(c.grid.position({x, y, z}));
        if (exact.covered(all.back())) covered.push_back(all.back());
      }
  const auto F = exact.at(covered.empty() ? all : covered);
  const auto [low, high] = std::minmax_element(F.begin(), F.end());
  c.low = *low;
  c.high = *high;
}

/// The case that a seed stands for, the same in every run.
inline Case draw_case(std::uint64_t seed) {
  using namespace detail;
  Random random(seed * 0x9e3779b97f4a7c15u + 1);
  Case c;
  draw_scan(seed, random, c);
  draw_roll(seed, c.scan, c.name);
  draw_series(seed, c.scan, c.name);
  if (c.scan.geometry.series.none()) {
    Preparation wanted;
    wanted.heights = Heights::common;
    bring_to_heights(c.scan, wanted, 0, {});
  }
  c.scan.report.notes.clear();
  draw_longer_rows(seed, c);
  draw_options(random, c);
  draw_grid(random, c);
  find_range(c);
  if (chance(random, 2.0 / 3)) {
    const bool exact = chance(random, 0.5);
    c.scale.pitch_u = draw_factor(random, 12, exact);
    c.scale.pitch_v = c.scale.pitch_u * draw_factor(random, 12, exact);
    c.scale.density = draw_factor(random, 36, exact);
    // A lattice of integers has steps of powers of two: at other factors only float32 can be compared.
    if (!exact && chance(random, 0.5)) c.options.storage = StorageChoice::f32;
  }
  // Last, so that what is drawn before stays as it was.
  if (chance(random, 0.25) && c.settings.comparison.closing != Closing::paper) c.sigma_seed = random();
  return c;
}

}  // namespace vdvr::hostile
