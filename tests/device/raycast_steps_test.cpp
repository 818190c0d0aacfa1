// Steps that are adapted to the level or to the picture, and steps over which the transfer function is
// integrated beforehand, against closed forms and a fine reference.
#define BOOST_TEST_MODULE raycast_steps
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <cstring>

#include "host/picture/render/raycast.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/reference/raycast.hpp"
#include "tests/support/rendering.hpp"
#include "vdvr/error.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::device, support::scattered_levels, support::u;

namespace {

double blob(double x, double y, double z) {
  return std::max(0.0, 1 - ((x - 3) * (x - 3) + (y + 2) * (y + 2) * 1.5 + z * z) / 90);
}

RenderOptions along_y(const Grid& grid, std::int64_t size = 9) {
  RenderOptions o;
  o.width = o.height = size;
  o.camera = orbit_camera(grid, 0, 0, 1);
  o.sampler = SamplerKind::buffer;
  o.shading = false;
  o.termination = 1;
  o.background_top = o.background_bottom = {0, 0, 0};
  return o;
}
constexpr std::size_t kCentre = 9 * 4 + 4;

double alpha_of(const ResidentVolume& v, const RenderOptions& o) {
  return static_cast<double>(raycast(device(), v, o).values.values[kCentre]);
}

bool same(const FloatPicture& a, const FloatPicture& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(cl_float4)) == 0;
}

/// Pictures that must not depend on skipping or on the number of lanes, from outside and inside.
void check_bits(RenderOptions o, bool saves) {
  const MixedVolume mixed = fields::mixed(centred_grid({30, 27, 33}), 4, scattered_levels, blob);
  const ResidentVolume v(device(), mixed);
  o.width = o.height = 37;
  o.shading = true;
  o.termination = 0.99;
  o.transfer = {"two shells",
                {{0, {1, 0, 0}, 0},
                 {0.1, {1, 0, 0}, 0},
                 {0.2, {1, 1, 0}, 0.2},
                 {0.3, {0, 1, 0}, 0},
                 {0.6, {0, 1, 1}, 0},
                 {0.7, {0, 0, 1}, 0.6},
                 {0.9, {1, 0, 1}, 0.4}}};
  for (const bool inside : {false, true})
    for (const double step : {1.0, 0.3, 7.5}) {
      o.step = step;
      o.camera = orbit_camera(v.grid(), 37, 21, 1);
      if (inside) o.camera = look_at({3, -2, 1}, {4, -2, 1}, std::nullopt, 100);
      for (const RenderOutput output : {RenderOutput::colour, RenderOutput::normal}) {
        o.output = output;
        o.skip_empty = true;
        const auto with = raycast_float(device(), v, o);
        for (const int lanes : {1, 16}) BOOST_TEST(same(with, raycast_float(device(), v, o, {8, 8, lanes})));
        o.skip_empty = false;
        const auto without = raycast_float(device(), v, o);
        BOOST_TEST(same(with, without));
        if (saves && step < 1) BOOST_TEST(with.samples < without.samples);
      }
    }
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_constant_slab_absorbs_by_the_closed_form_whatever_the_steps) {
  const Grid grid = centred_grid({24, 24, 24});
  const auto half = [](double, double, double) { return 0.5; };
  const ResidentVolume mixed(device(), fields::mixed(grid, 4, scattered_levels, half));
  const double truth = 1 - std::pow(1 - 0.05, 24);
  RenderOptions o = along_y(grid);
  o.transfer = {"constant", {{0, {1, 1, 1}, 0.05}, {1, {1, 1, 1}, 0.05}}};
  for (const double step : {2.0, 1.0, 0.5}) {
    o.step = step;
    o.step_mode = StepMode::level;
    // Up to eight parts a step; each rounds its opacity and its weight.
    const std::int64_t samples = static_cast<std::int64_t>(24 / step) * 8;
    BOOST_TEST(!(std::abs(alpha_of(mixed, o) - truth) > tolerance::fp32_sum(4 * samples, 1)));
  }
  // The last step of 0.7 and of 5 is cut where the ray leaves; powers err by 16 u (OpenCL 1.2, table 7.4).
  o.step_mode = StepMode::fixed;
  o.classification = Classification::preintegrated;
  for (const double step : {1.0, 0.7, 5.0, 100.0}) {
    o.step = step;
    BOOST_TEST(!(std::abs(alpha_of(mixed, o) - truth) >
                 tolerance::fp32_sum(4 * static_cast<std::int64_t>(24 / step) + 64, 1)));
  }
}

BOOST_AUTO_TEST_CASE(every_ray_counts_the_path_it_has_whatever_the_step) {
  const Grid grid = centred_grid({24, 20, 16}, {1, 1.25, 2});
  constexpr double opacity = 0.05;
  constexpr std::int64_t kSize = 33;
  const ResidentVolume v(
      device(), fields::mixed(grid, 4, scattered_levels, [](double, double, double) { return 0.5; }));
  RenderOptions o = along_y(grid, kSize);
  o.transfer = {"constant", {{0, {1, 1, 1}, opacity}, {1, {1, 1, 1}, opacity}}};
  struct Kernel {
    Classification classification;
    StepMode step_mode;
    GradientKind gradient;
  };
  // The last is raycast_base_first.h.
  for (const Kernel kernel : {Kernel{Classification::post, StepMode::fixed, GradientKind::central},
                              Kernel{Classification::preintegrated, StepMode::fixed, GradientKind::central},
                              Kernel{Classification::post, StepMode::level, GradientKind::central},
                              Kernel{Classification::post, StepMode::adaptive, GradientKind::stored},
                              Kernel{Classification::post, StepMode::fixed, GradientKind::stored}})
    for (const double step : {0.7, 1.0, 5.0, 100.0}) {
      o.camera = orbit_camera(grid, 37, 21, 1);
      o.classification = kernel.classification;
      o.step_mode = kernel.step_mode;
      o.gradient = kernel.gradient;
      o.step = step;
      const auto alpha = raycast(device(), v, o).values.values;
      double worst = 0;
      int shorter = 0;
      for (std::int64_t i = 0; i < kSize * kSize; ++i) {
        const auto [in, out] =
            reference::clip(reference::pixel_ray(o.camera, kSize, kSize, i % kSize, i / kSize), grid);
        const double path = std::max(0.0, out - in);
        if (path > 0 && path < step / 2) ++shorter;
        worst = std::max(worst, std::abs(static_cast<double>(alpha[static_cast<std::size_t>(i)]) -
                                         (1 - std::pow(1 - opacity, path))));
      }
      BOOST_TEST(shorter > 0);
      // Steps of up to sixteen parts each round their opacity and weight, and 16 u of a power; both ends of a
      // ray err by 16 u of the eye's distance, which the extinction turns into opacity.
      const double distance = std::hypot(o.camera.position[0], o.camera.position[1], o.camera.position[2]);
      const double ends = 2 * 16 * u * distance * -std::log(1 - opacity);
      BOOST_TEST(
          !(worst > tolerance::fp32_sum(4 * 16 * static_cast<std::int64_t>(45 / step + 1) + 64, 1) + ends));
    }
}

BOOST_AUTO_TEST_CASE(level_steps_are_fixed_steps_where_all_is_base) {
  const ResidentVolume v(device(), as_mixed(fields::uniform(centred_grid({30, 27, 33}), blob)));
  for (const double step : {1.0, 0.5, 4.0}) {
    RenderOptions o = along_y(v.grid(), 37);
    o.camera = orbit_camera(v.grid(), 37, 21, 1);
    o.transfer = transfer_preset("default", 0, 1);
    o.shading = true;
    o.step = step;
    const auto fixed = raycast_float(device(), v, o);
    o.step_mode = StepMode::level;
    const auto level = raycast_float(device(), v, o);
    BOOST_TEST(same(fixed, level));
  }
}

BOOST_AUTO_TEST_CASE(level_steps_absorb_a_ramp_as_fixed_ones_do) {
  const Grid grid = centred_grid({24, 24, 24});
  const double length = 24, largest = 0.2, kappa = largest / length, rest = 1 - largest;
  const auto ramp = [&](double, double y, double) { return (12 - y) / length; };
  const ResidentVolume v(device(), fields::mixed(grid, 4, scattered_levels, ramp));
  RenderOptions o = along_y(grid);
  o.transfer = {"ramp", {{0, {1, 1, 1}, 0}, {1, {1, 1, 1}, largest}}};
  const double truth = 1 - std::exp((-1 - (rest * std::log(rest) - rest)) / kappa);
  for (const double step : {4.0, 2.0, 1.0, 0.5}) {
    o.step = step;
    o.step_mode = StepMode::fixed;
    const double fixed = alpha_of(v, o);
    o.step_mode = StepMode::level;
    const double level = alpha_of(v, o);
    // Both are midpoint rules for the extinction -ln(1 - kappa s), whose opacity of any step is exact: each
    // errs by h^2 / 24 times the length and the largest second derivative (raycast_truth_test), parts by
    // less.
    const double midpoint = step * step / 24 * length * (kappa * kappa) / (rest * rest);
    const double table = 8 * length / step * (largest * largest / rest) / (8.0 * 1023 * 1023);
    const double rounding = tolerance::fp32_sum(48 * static_cast<std::int64_t>(length / step), 1);
    BOOST_TEST(!(std::abs(level - truth) > midpoint + table + rounding));
    BOOST_TEST(!(std::abs(level - fixed) > 2 * (midpoint + table + rounding)));
  }
}

BOOST_AUTO_TEST_CASE(level_steps_do_not_depend_on_skipping_or_lanes) {
  RenderOptions o = along_y(centred_grid({4, 4, 4}));
  o.step_mode = StepMode::level;
  check_bits(o, true);
}

BOOST_AUTO_TEST_CASE(adaptive_steps_do_not_depend_on_skipping_or_lanes) {
  RenderOptions o = along_y(centred_grid({4, 4, 4}));
  o.step_mode = StepMode::adaptive;
  check_bits(o, true);
}

// Wood grain: lines where surfaces pass from one step to the next. A part of a step may change a pixel by a
// 32nd (VDVR_PART_CHANGE), and a midpoint errs by half of that; on a surface that is passed once two steps
// change much. So a picture may differ from that of fine steps by a 32nd, eight levels of 8 bits.
BOOST_AUTO_TEST_CASE(adaptive_steps_draw_no_lines_on_a_steep_transfer_function) {
  const Grid grid = centred_grid({32, 32, 32});
  const ResidentVolume v(device(), as_mixed(fields::uniform(grid, [](double x, double y, double z) {
                           return 1 / (1 + std::exp((std::hypot(x, y, z) - 11) / 0.8));
                         })));
  RenderOptions o = along_y(grid, 160);
  o.camera = orbit_camera(grid, 37, 21, 1.5);
  o.shading = true;
  o.gradient = GradientKind::stored;
  o.termination = 0.99;
  // A veil, and a surface whose opacity and colour change within a fifth of the range.
  o.transfer = {"steep",
                {{0, {0.3, 0.5, 0.7}, 0},
                 {0.1, {0.3, 0.5, 0.7}, 0},
                 {0.2, {0.6, 0.75, 0.9}, 0.02},
                 {0.45, {0.6, 0.75, 0.9}, 0.02},
                 {0.5, {0.95, 0.7, 0.45}, 0.1},
                 {0.65, {1, 0.9, 0.7}, 0.7},
                 {1, {1, 1, 1}, 0.9}}};
  const auto picture = [&](StepMode mode, double step) {
    o.step_mode = mode;
    o.step = step;
    return raycast_float(device(), v, o);
  };
  const FloatPicture truth = picture(StepMode::fixed, 1.0 / 64), adaptive = picture(StepMode::adaptive, 1),
                     fixed = picture(StepMode::fixed, 1);
  const auto largest = [&](const FloatPicture& p) {
    double most = 0;
    for (std::size_t i = 0; i < p.pixels.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c)
        most = std::max(most, std::abs(static_cast<double>(p.pixels[i].s[c]) -
                                       static_cast<double>(truth.pixels[i].s[c])));
    return most;
  };
  BOOST_TEST_MESSAGE("adaptive " << largest(adaptive) << " with " << adaptive.samples << " samples, fixed "
                                 << largest(fixed) << " with " << fixed.samples);
  BOOST_TEST(largest(adaptive) <= 1.0 / 32);
  BOOST_TEST(largest(fixed) > 1.0 / 32);
  // Most steps are not cut.
  BOOST_TEST(adaptive.samples < 4 * fixed.samples);
}

BOOST_AUTO_TEST_CASE(a_thin_shell_between_two_samples_is_met_by_adaptive_steps) {
  const Grid grid = centred_grid({24, 24, 24});
  const ResidentVolume v(
      device(), as_mixed(fields::uniform(grid, [](double, double y, double) { return (12 - y) / 24; })));
  RenderOptions o = along_y(grid);
  // 1.2 cells; neither end of a step of 6 lies in it.
  o.transfer = {"shell",
                {{0, {1, 1, 1}, 0},
                 {0.6, {1, 1, 1}, 0},
                 {0.6, {1, 1, 1}, 0.3},
                 {0.65, {1, 1, 1}, 0.3},
                 {0.65, {1, 1, 1}, 0},
                 {1, {1, 1, 1}, 0}}};
  o.step_mode = StepMode::adaptive;
  const double tau = -std::log(1 - 0.3), truth = 1 - std::exp(-tau * 1.2);
  for (const double step : {6.0, 3.0, 1.0}) {
    o.step = step;
    // A step that the shell fills changes by 0.3 at least, hence has sixteen parts: each end of the shell
    // lies half a part off at most, and an entry of the table.
    const double allowed = tau * (step / 16 + 2 * 24.0 / 1023) + 64 * u;
    BOOST_TEST(!(std::abs(alpha_of(v, o) - truth) > allowed));
  }
}

BOOST_AUTO_TEST_CASE(preintegrated_steps_do_not_depend_on_skipping_or_lanes) {
  RenderOptions o = along_y(centred_grid({4, 4, 4}));
  o.classification = Classification::preintegrated;
  check_bits(o, true);
}

BOOST_AUTO_TEST_CASE(a_sharp_shell_in_a_ramp_is_met_by_any_preintegrated_step) {
  const Grid grid = centred_grid({24, 24, 24});
  const ResidentVolume v(
      device(), as_mixed(fields::uniform(grid, [](double, double y, double) { return (12 - y) / 24; })));
  RenderOptions o = along_y(grid);
  // A tenth of the range, 2.4 cells, with jumps at both ends.
  o.transfer = {"shell",
                {{0, {1, 1, 1}, 0},
                 {0.45, {1, 1, 1}, 0},
                 {0.45, {1, 1, 1}, 0.3},
                 {0.55, {1, 1, 1}, 0.3},
                 {0.55, {1, 1, 1}, 0},
                 {1, {1, 1, 1}, 0}}};
  o.classification = Classification::preintegrated;
  const double tau = -std::log(1 - 0.3), truth = 1 - std::exp(-tau * 2.4);
  for (const double step : {24.0, 12.0, 6.0, 3.0, 1.0}) {
    o.step = step;
    // Jumps are placed to half a 16th of an entry. Between entries opacity is interpolated: where a jump lies
    // in the entry beside a sample, it errs by an entry's extinction at most.
    const double entry = 24.0 / 255;
    const double allowed = tau * (2 * entry / 32 + 2 * entry) + 64 * u;
    BOOST_TEST(!(std::abs(alpha_of(v, o) - truth) > allowed));
  }
}

BOOST_AUTO_TEST_CASE(preintegrated_steps_converge_faster_on_a_sharp_transfer_function) {
  const Grid grid = centred_grid({16, 16, 16});
  const MixedVolume mixed = as_mixed(
      fields::uniform(grid, [](double x, double y, double z) { return 1 - (x * x + y * y + z * z) / 192; }));
  const ResidentVolume v(device(), mixed);
  constexpr std::int64_t kSize = 15;
  RenderOptions o = along_y(grid, kSize);
  o.camera = orbit_camera(grid, 37, 21, 1.5);
  o.transfer = {"shell",
                {{0, {1, 1, 1}, 0},
                 {0.7, {1, 1, 1}, 0},
                 {0.7, {1, 1, 1}, 0.5},
                 {0.78, {1, 1, 1}, 0.5},
                 {0.78, {1, 1, 1}, 0},
                 {1, {1, 1, 1}, 0}}};
  // The reference misplaces a jump by half its own step, far below the errors that are compared.
  const double fine = 1.0 / 1024;
  std::vector<double> truth;
  for (std::int64_t i = 0; i < kSize * kSize; ++i)
    truth.push_back(reference::emission_absorption(
        reference::pixel_ray(o.camera, kSize, kSize, i % kSize, i / kSize), grid, fine, [&](const Vec3& p) {
          Vec3 c{};
          for (std::size_t a = 0; a < 3; ++a) c[a] = std::clamp(p[a] + 8, 0.0, 16.0);
          const double value = reference::mixed_field(mixed, c);
          return reference::Emission{{1, 1, 1}, value >= 0.7 && value < 0.78 ? 1 - std::pow(0.5, fine) : 0};
        })[3]);
  const auto error_of = [&](Classification classification, double step) {
    o.classification = classification;
    o.step = step;
    const auto alpha = raycast(device(), v, o).values.values;
    double sum = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) sum += std::abs(static_cast<double>(alpha[i]) - truth[i]);
    return sum / static_cast<double>(truth.size());
  };
  // From 4 cells to one, the order is half the logarithm of how much smaller the error becomes.
  const double post_coarse = error_of(Classification::post, 4), post = error_of(Classification::post, 1);
  const double pre_coarse = error_of(Classification::preintegrated, 4),
               pre = error_of(Classification::preintegrated, 1);
  const double post_order = std::log2(post_coarse / post) / 2, pre_order = std::log2(pre_coarse / pre) / 2;
  BOOST_TEST_MESSAGE("post " << post_coarse << " " << post << " order " << post_order << ", preintegrated "
                             << pre_coarse << " " << pre << " order " << pre_order);
  // A jump met by samples errs with the first power of the step, a parabola taken as linear with the second.
  BOOST_TEST(pre_order > post_order);
  BOOST_TEST(pre_order > 1.5);
  BOOST_TEST(pre_coarse < post_coarse);
  BOOST_TEST(pre < post / 4);
}

BOOST_AUTO_TEST_CASE(steps_that_do_not_go_together_are_refused) {
  const Grid grid = centred_grid({4, 4, 4});
  const ResidentVolume v(device(), as_mixed(fields::uniform(grid, blob)));
  const auto is_refused = [&](auto&& change) {
    RenderOptions o = along_y(grid);
    o.transfer = transfer_preset("default", 0, 1);
    change(o);
    try {
      raycast(device(), v, o);
    } catch (const InputError&) {
      return true;
    }
    return false;
  };
  BOOST_TEST(is_refused([](auto& o) {
    o.classification = Classification::preintegrated;
    o.step_mode = StepMode::level;
  }));
  BOOST_TEST(is_refused([](auto& o) {
    o.classification = Classification::preintegrated;
    o.step_mode = StepMode::adaptive;
  }));
  BOOST_TEST(is_refused([](auto& o) {
    o.mode = RenderMode::mip;
    o.step_mode = StepMode::level;
  }));
}
