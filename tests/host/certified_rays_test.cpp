// Rays through mixed volumes: V on each piece, and what certified rays say of colours, surfaces and maxima,
// held to an analytic F whose distance from V is known brick by brick.
#define BOOST_TEST_MODULE certified_rays
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include "host/picture/rays/crossings.hpp"
#include "host/picture/rays/emission.hpp"
#include "host/picture/rays/line_integral.hpp"
#include "tests/support/analytic_pictures.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/expert/certified_rays.hpp"
#include "vdvr/expert/certify_picture.hpp"

using namespace vdvr;

namespace {

constexpr double pi = std::numbers::pi;
constexpr std::int64_t cells = 20;

/// Marschner and Lobb's signal on [-1, 1]^3 with two waves across.
double lobb(const Vec3& p) {
  constexpr double waves = 2, depth = 0.25;
  const double half = 0.5 * static_cast<double>(cells), x = p[0] / half, y = p[1] / half, z = p[2] / half,
               r = std::hypot(x, y);
  return (1 - std::sin(pi * z / 2) + depth * (1 + std::cos(2 * pi * waves * std::cos(pi * r / 2)))) /
         (2 * (1 + depth));
}
/// Of its gradient's length, per cell: pi / 2 along z, 2 pi waves depth pi / 2 across, over 2 (1 + depth).
const double slope =
    std::hypot(pi / 2, 2 * pi * 2 * 0.25 * pi / 2) / 2.5 / (0.5 * static_cast<double>(cells));

ParallelGeometry geometry() {
  ParallelGeometry g;
  g.columns = cells;
  g.rows = cells - 2;
  g.center = 0.5 * static_cast<double>(cells - 1);
  for (int k = 0; k < 60; ++k) g.theta_rad.push_back(pi * k / 60);
  return g;
}

struct Scene {
  MixedVolume volume;
  std::vector<float> bounds;
  Coverage coverage{geometry()};

  Scene() {
    Grid grid;
    grid.cells = {cells, cells, cells};
    const double low = -0.5 * static_cast<double>(cells);
    grid.origin = {low, low, low};
    volume = support::sampled_mixed(grid, 4, 4, {{0, 0, 0}, {1, 1, 1}, {2, 1, 0}, {0, 2, 2}}, 7,
                                    [&](double x, double y, double z) {
                                      return lobb({x + low, y + low, z + low});
                                    });
    // Between places an eighth of a cell apart neither V nor F moves by more than its slope allows.
    const double between = 2 * slope * std::sqrt(3.0) / 16;
    const Index3 n = volume.bricks();
    for (std::int64_t b = 0; b < n[0] * n[1] * n[2]; ++b) {
      const Index3 brick{b % n[0], b / n[0] % n[1], b / (n[0] * n[1])};
      const BrickSamples samples(volume, brick);
      double most = 0;
      for (int k = 0; k <= 32; ++k)
        for (int j = 0; j <= 32; ++j)
          for (int i = 0; i <= 32; ++i) {
            const Vec3 c{4.0 * static_cast<double>(brick[0]) + i / 8.0,
                         4.0 * static_cast<double>(brick[1]) + j / 8.0,
                         4.0 * static_cast<double>(brick[2]) + k / 8.0};
            const auto v = static_cast<double>(
                samples.at(static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])));
            most = std::max(most, std::abs(v - lobb({c[0] + low, c[1] + low, c[2] + low})));
          }
      bounds.push_back(static_cast<float>(most + between));
    }
  }
  [[nodiscard]] RayField field() const { return RayField(volume, bounds, coverage); }
};

const Scene& scene() {
  static const Scene one;
  return one;
}

constexpr std::int64_t side = 40;
/// Views from outside, along an axis through faces of bricks, and from within.
std::vector<Camera> cameras() {
  return {{{30, 25, -14}, {0, 0, 0}, {0, 0, -1}, 34},
          {{0, 60, 0}, {0, 0, 0}, {0, 0, -1}, 20},
          {{2, 1, 3}, {-6, 4, -2}, {0, 0, -1}, 70}};
}

template <class Visit>
void for_each_ray(Visit&& visit) {
  for (const Camera& camera : cameras())
    for (std::int64_t y = 0; y < side; ++y)
      for (std::int64_t x = 0; x < side; ++x) visit(pixel_ray(camera, side, side, x, y));
}

}  // namespace

BOOST_AUTO_TEST_CASE(pieces_fill_the_clipped_ray_and_hold_v_in_their_coefficients) {
  const RayField field = scene().field();
  std::int64_t pieces = 0;
  for_each_ray([&](const WorldRay& ray) {
    const auto [first, last] = field.clipped(ray);
    double at = first;
    field.walk(ray, [&](const RayPiece& piece) {
      ++pieces;
      BOOST_TEST(piece.first == at);
      at = piece.last;
      for (const double part : {0.0, 0.31, 0.5, 0.77, 1.0}) {
        const double t = (1 - part) * piece.first + part * piece.last,
                     v = part_of(piece.value, part, part)[0];
        BOOST_TEST(v >= least(piece.value) - 0x1p-40);
        BOOST_TEST(v <= largest(piece.value) + 0x1p-40);
        const Vec3 p = ray.at(t);
        BOOST_TEST(std::hypot(p[0], p[1]) <= scene().coverage.inner_radius());
        BOOST_TEST(std::abs(p[2]) <= scene().coverage.heights().second);
        // Beside a face fp32 may name the other brick, which disagrees where nothing was closed.
        bool beside = false;
        for (const double x : p) beside = beside || std::abs(std::remainder(x + 10, 4.0)) < 1e-4;
        if (beside) continue;
        // Ends may lie in the next brick by rounding. Seven roundings of lerps, and of the place in fp32
        // cells.
        if (part > 0 && part < 1)
          BOOST_TEST(std::abs(v - static_cast<double>(sample_at(scene().volume, p))) <=
                     tolerance::unit_roundoff * (8 + 64 * static_cast<double>(cells)));
      }
      return true;
    });
    if (first < last) BOOST_TEST(at == last);
  });
  BOOST_TEST(pieces > 20000);
}

BOOST_AUTO_TEST_CASE(the_first_crossing_of_f_lies_in_its_band_and_nowhere_else) {
  const RayField field = scene().field();
  constexpr double step = 1.0 / 64;
  int from_start = 0;
  for (const double value : {0.5, 0.35}) {
    std::array<int, 3> count{};
    for_each_ray([&](const WorldRay& ray) {
      const auto [begin, end] = field.clipped(ray);
      if (!(begin < end)) return;
      const Crossing c = first_crossing(field, ray, value);
      ++count[static_cast<std::size_t>(c.hit)];
      if (c.from_start) {
        BOOST_TEST(c.first == begin);
        if (c.hit == Hit::possible) return;
        ++from_start;
        const auto f = [&](double t) { return lobb(ray.at(t)); };
        BOOST_TEST(support::passes(f, begin, c.last, value, step, slope));
        return;
      }
      const double sign = lobb(ray.at(begin)) < value ? 1 : -1;
      const double before = c.hit == Hit::none ? end : c.first;
      for (double t = begin; t < before; t += step) BOOST_TEST(sign * (lobb(ray.at(t)) - value) < 0);
      if (c.hit != Hit::sure) return;
      BOOST_TEST(c.last >= c.first);
      BOOST_TEST(sign * (lobb(ray.at(c.last)) - value) >= 0);
    });
    for (const int n : count) BOOST_TEST(n > 20);
  }
  BOOST_TEST(from_start > 20);
}

BOOST_AUTO_TEST_CASE(a_jump_of_v_or_of_its_bound_at_a_face_is_a_crossing) {
  // Flat bricks: no cell has a root, faces alone have.
  Grid grid;
  grid.cells = {8, 8, 8};
  grid.origin = {-4, -4, -4};
  MixedVolume v = support::empty_mixed(grid, 4, 2, {{1, 1, 1}}, 1);
  for (std::size_t b = 0; b < v.level.size(); ++b) {
    const auto size = static_cast<std::size_t>(v.tile_size({1, 1, 1}));
    for (std::size_t i = 0; i < size; ++i)
      v.tiles[LevelTriple{1, 1, 1}].f32[v.tile[b] * size + i] = b % 2 == 0 ? 0.25f : 0.75f;
  }
  ParallelGeometry g = geometry();
  const Coverage coverage(g);
  const WorldRay ray{{-10, -2, -2}, {1, 0, 0}};
  const std::vector<float> narrow(8, 0.125f);
  const Crossing c = first_crossing(RayField(v, narrow, coverage), ray, 0.5);
  BOOST_TEST((c.hit == Hit::sure));
  // A face is at most ten units from either end of a handful of roundings.
  const double rounding = tolerance::fp64_sum(16, 20);
  BOOST_TEST(std::abs(c.first - 10) <= rounding);
  BOOST_TEST(std::abs(c.last - 10) <= rounding);
  // The second brick's bound alone reaches the value.
  std::vector<float> wide = narrow;
  for (std::size_t b = 1; b < wide.size(); b += 2) wide[b] = 0.5f;
  const Crossing possible = first_crossing(RayField(v, wide, coverage), ray, 0.5);
  BOOST_TEST((possible.hit == Hit::possible));
  BOOST_TEST(std::abs(possible.first - 10) <= rounding);
}

BOOST_AUTO_TEST_CASE(the_largest_f_lies_between_its_bounds) {
  const RayField field = scene().field();
  constexpr double step = 1.0 / 64;
  for_each_ray([&](const WorldRay& ray) {
    const auto [begin, end] = field.clipped(ray);
    const Maximum m = maximum_along(field, ray);
    BOOST_TEST(m.any == (begin < end));
    if (!m.any) return;
    double most = -INFINITY;
    for (double t = begin; t < end; t += step) {
      const double f = lobb(ray.at(t));
      most = std::max(most, f);
      BOOST_TEST(f <= m.high);
      if (f >= m.low && (t < m.first || t > m.last)) BOOST_TEST(f < m.low);
    }
    BOOST_TEST(m.low <= most + slope * step);
  });
}

BOOST_AUTO_TEST_CASE(the_integral_of_f_lies_between_its_bounds) {
  const RayField field = scene().field();
  double true_error = 0, reach = 0;
  for_each_ray([&](const WorldRay& ray) {
    const auto [begin, end] = field.clipped(ray);
    const LineIntegral line = integral_along(field, ray);
    BOOST_TEST(line.any == (begin < end));
    if (!line.any) return;
    const int steps = 1 + static_cast<int>(64 * (end - begin));
    double f = 0;
    const double h = (end - begin) / steps;
    for (int i = 0; i < steps; ++i) f += h * lobb(ray.at(begin + (i + 0.5) * h));
    // Midpoints of a function of slope s err by s h / 4 a length at most.
    BOOST_TEST(std::abs(f - line.value) <= line.reach + slope * h / 4 * (end - begin));
    true_error += std::abs(f - line.value);
    reach += line.reach;
  });
  // Errors of either sign cancel along a ray, and bounds add up: a bound above is far off.
  BOOST_TEST(reach > 3 * true_error);
}

BOOST_AUTO_TEST_CASE(integrals_of_the_methods_set_up_lie_in_their_intervals) {
  const support::AnalyticField f = support::marschner_lobb(64, 6);
  ParallelGeometry wide = geometry();
  wide.columns = wide.rows = 200;
  wide.center = 0.5 * static_cast<double>(wide.columns - 1);
  const Coverage coverage(wide);
  for (const std::uint8_t level : {0, 1}) {
    const MixedVolume volume = support::volume_of(f, {LevelTriple{level, level, level}}, 1);
    const std::vector<float> bounds = support::proved_bounds(f, volume, 0, 8);
    const RayField field(volume, bounds, coverage);
    const Camera camera = orbit_camera(volume.grid, 30, 20, 1);
    constexpr std::int64_t pixels = 64;
    double reach = 0, error = 0, whole = 0, rays = 0;
    for (std::int64_t y = 0; y < pixels; ++y)
      for (std::int64_t x = 0; x < pixels; ++x) {
        const WorldRay ray = pixel_ray(camera, pixels, pixels, x, y);
        const auto [begin, end] = field.clipped(ray);
        if (!(begin < end)) continue;
        const auto steps = static_cast<int>(std::ceil(32 * (end - begin)));
        const double h = (end - begin) / steps;
        double sum = 0;
        for (int i = 0; i < steps; ++i) {
          const Vec3 p = ray.at(begin + (i + 0.5) * h);
          sum += h * f.at(p[0] + 32, p[1] + 32, p[2] + 32);
        }
        const LineIntegral line = integral_along(field, ray);
        // Midpoints err by h^2 / 24 of the second derivative along the ray, which is the three axes' at most.
        const double midpoints =
            h * h / 24 * (f.curvature[0] + f.curvature[1] + f.curvature[2]) * (end - begin);
        BOOST_TEST(std::abs(sum - line.value) <= line.reach + midpoints);
        reach += line.reach;
        error += std::abs(sum - line.value);
        whole += sum;
        ++rays;
      }
    BOOST_TEST(rays > 2000);
    BOOST_TEST_MESSAGE("level " << int{level} << ": mean bound " << reach / rays << ", mean error "
                                << error / rays << ", of " << whole / rays);
    BOOST_TEST(reach > 5 * error);
  }
}

BOOST_AUTO_TEST_CASE(the_integral_of_v_is_that_of_its_cubics) {
  // Without a bound, what is left is V itself: held to midpoints of the pieces, of which every one is cut.
  const std::vector<float> none(scene().bounds.size(), 0.0f);
  const RayField field(scene().volume, none, scene().coverage);
  for_each_ray([&](const WorldRay& ray) {
    const LineIntegral line = integral_along(field, ray);
    double sum = 0;
    constexpr int parts = 64;
    double error = 0;
    field.walk(ray, [&](const RayPiece& piece) {
      const double h = (piece.last - piece.first) / parts;
      for (int i = 0; i < parts; ++i) {
        const double at = (i + 0.5) / parts;
        sum += h * part_of(piece.value, at, at)[0];
      }
      // A midpoint rule errs by h^2 / 24 of the second derivative, 6 of the largest second difference.
      const auto& b = piece.value;
      const double bent = 6 * std::max(std::abs(b[0] - 2 * b[1] + b[2]), std::abs(b[1] - 2 * b[2] + b[3]));
      error += (piece.last - piece.first) * bent / (24.0 * parts * parts);
      return true;
    });
    BOOST_TEST(std::abs(sum - line.value) <= error + tolerance::fp64_sum(64 * 256, 40));
    BOOST_TEST(line.reach <= 0x1p-30 * 40);
  });
}

BOOST_AUTO_TEST_CASE(greys_of_integrals_are_cut_at_the_window_and_unknown_where_nothing_was_tested) {
  RenderOptions o;
  o.mode = RenderMode::integral;
  o.width = 4;
  o.height = 1;
  o.slice_range = std::pair{1.0, 3.0};
  constexpr float endless = std::numeric_limits<float>::infinity();
  const IntegralBounds bounds{
      {4, 1, {1.5f, -2, -endless, 0}, 1}, {4, 1, {2, 0.5f, endless, 0}, 1}, {1, 1, 1, 0}};
  const PixelBounds b = greys_of_integrals(bounds, o);
  const std::vector<std::pair<double, double>> expected{{0.25, 0.5}, {0, 0}, {0, 1}, {0, 0}};
  for (std::size_t i = 0; i < 4; ++i) {
    BOOST_TEST(std::abs(static_cast<double>(b.lo.values[3 * i]) - expected[i].first) <= 0x1p-22);
    BOOST_TEST(std::abs(static_cast<double>(b.hi.values[3 * i + 2]) - expected[i].second) <= 0x1p-22);
    BOOST_TEST(b.untested[i] == (i == 2 ? 1 : 0));
    BOOST_TEST(b.parts[i] == (i == 3 ? 0u : 1u));
  }
}

namespace {

TransferFunction transfer(bool jumps) {
  if (jumps)
    return {"jump",
            {{0.0, {0.2, 0.3, 0.9}, 0.0},
             {0.5, {0.2, 0.3, 0.9}, 0.0},
             {0.5, {1, 0.6, 0.1}, 0.6},
             {1.0, {0.4, 1, 0.2}, 0.9}}};
  return {"soft",
          {{0.0, {0, 0, 0}, 0.0},
           {0.3, {0.1, 0.2, 0.8}, 0.0},
           {0.6, {0.9, 0.5, 0.1}, 0.2},
           {1.0, {1, 1, 1}, 0.7}}};
}

/// Emission and absorption over F by midpoints.
std::array<double, 3> colour_of_f(const WorldRay& ray, double begin, double end, const TransferFunction& tf,
                                  const std::array<double, 3>& background, int steps) {
  std::array<double, 3> behind = background;
  const double h = (end - begin) / steps;
  for (int i = steps - 1; i >= 0; --i) {
    const TransferPoint p = transfer_at(tf.points, lobb(ray.at(begin + (i + 0.5) * h)));
    const double kept = std::pow(1 - p.opacity, h);
    for (std::size_t c = 0; c < 3; ++c) behind[c] = p.rgb[c] + (behind[c] - p.rgb[c]) * kept;
  }
  return behind;
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_colour_of_f_lies_in_its_interval) {
  const RayField field = scene().field();
  const std::array<double, 3> background{0.1, 0.5, 0.2};
  for (const bool jumps : {false, true}) {
    const TransferFunction tf = transfer(jumps);
    const MediumRanges ranges(tf);
    std::size_t number = 0;
    double width = 0;
    for_each_ray([&](const WorldRay& ray) {
      if (++number % 3 != 0) return;
      const auto [begin, end] = field.clipped(ray);
      const ColourInterval w = colour_interval(field, ray, ranges, background);
      if (!(begin < end)) {
        // It allows for the rounding of one step (emission.cpp) where there is none.
        for (std::size_t c = 0; c < 3; ++c) BOOST_TEST(std::abs(w.low[c] - background[c]) <= 17 * 0x1p-53);
        return;
      }
      const int steps = 1 + static_cast<int>(64 * (end - begin));
      const auto coarse = colour_of_f(ray, begin, end, tf, background, steps),
                 fine = colour_of_f(ray, begin, end, tf, background, 2 * steps);
      for (std::size_t c = 0; c < 3; ++c) {
        // What the sum over midpoints errs: as much as it still moved; at a jump, a step of the thickest
        // medium.
        const double error = 2 * std::abs(fine[c] - coarse[c]) + (jumps ? 2.5 / 128 * 2 : 0);
        BOOST_TEST(fine[c] >= w.low[c] - error);
        BOOST_TEST(fine[c] <= w.high[c] + error);
        width = std::max(width, w.high[c] - w.low[c]);
      }
    });
    BOOST_TEST(width < 1);
  }
}

BOOST_AUTO_TEST_CASE(without_an_error_the_interval_closes) {
  const std::vector<float> none(scene().bounds.size(), 0.0f);
  const RayField field(scene().volume, none, scene().coverage);
  const MediumRanges ranges(transfer(false));
  double width = 0;
  for_each_ray([&](const WorldRay& ray) {
    const ColourInterval w = colour_interval(field, ray, ranges, {0, 0, 0});
    for (std::size_t c = 0; c < 3; ++c) width = std::max(width, w.high[c] - w.low[c]);
  });
  // 64 parts a cell, on each of which V moves by its slope over them; a colour turns by less than 4 a value,
  // and extinction by less than 2.
  BOOST_TEST(width < 2 * (4 + 2) * 3 * slope / 64);
}

BOOST_AUTO_TEST_CASE(colours_of_a_maximum_hold_the_points_and_both_sides_of_jumps_between_its_ends) {
  RenderOptions o;
  o.mode = RenderMode::mip;
  o.width = 4;
  o.height = 1;
  o.transfer.points = {{0, {0, 0, 0}, 1}, {0.4, {1, 0, 0}, 1}, {0.4, {0, 1, 0}, 1}, {1, {0, 0, 0}, 1}};
  const float none = std::numeric_limits<float>::quiet_NaN();
  MaximumBounds m;
  m.low = {4, 1, {0.1f, 0.3f, 0.5f, none}, 1};
  m.high = {4, 1, {0.2f, 0.4f, std::numeric_limits<float>::infinity(), none}, 1};
  const PixelBounds b = colours_of_maxima(m, o);
  const auto interval = [&](std::size_t pixel, std::size_t c) {
    return std::pair{static_cast<double>(b.lo.values[3 * pixel + c]),
                     static_cast<double>(b.hi.values[3 * pixel + c])};
  };
  constexpr double u = 0x1p-22;  // two roundings to float32 of numbers up to 1
  BOOST_TEST(std::abs(interval(0, 0).first - 0.25) <= u);
  BOOST_TEST(std::abs(interval(0, 0).second - 0.5) <= u);
  BOOST_TEST(std::abs(interval(1, 0).second - 1) <= u);
  BOOST_TEST(std::abs(interval(1, 1).second - 1) <= u);
  BOOST_TEST(std::abs(interval(1, 0).first) <= u);
  BOOST_TEST(std::abs(interval(2, 1).second - 5.0 / 6) <= u);
  BOOST_TEST(std::abs(interval(2, 1).first) <= u);
  BOOST_TEST(b.untested[2] == 1);
  BOOST_TEST(b.parts[3] == 0);
  BOOST_TEST(interval(3, 0).second - interval(3, 0).first <= u);
}

BOOST_AUTO_TEST_CASE(ranges_hold_both_sides_of_a_jump_and_the_colour_beside_what_is_clear) {
  const MediumRanges ranges(transfer(true));
  const MediumRange at_jump = ranges.over(0.5, 0.5);
  BOOST_TEST(at_jump.tau_low == 0);
  BOOST_TEST(std::abs(at_jump.tau_high + std::log(0.4)) < 1e-12);
  BOOST_TEST(ranges.over(0.1, 0.4).tau_high == 0);
  const MediumRange beside = MediumRanges(transfer(false)).over(0.2, 0.3001);
  BOOST_TEST(beside.tau_high > 0);
  BOOST_TEST(std::abs(beside.low[2] - 0.8) < 0.01);
}
