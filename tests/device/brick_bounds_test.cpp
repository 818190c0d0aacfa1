// Bounds by brick: what a picture of them shows, and how they are stored.
#define BOOST_TEST_MODULE brick_bounds
#include <boost/test/unit_test.hpp>

#include <cmath>

#include "host/picture/render/raycast.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/reference/raycast.hpp"
#include "tests/support/certificates.hpp"
#include "tests/support/rendering.hpp"
#include "tests/support/temporary_folder.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/vdvr_file.hpp"

using namespace vdvr;
using fields::centred_grid;
using support::device, support::scattered_levels;

namespace {

double blob(double x, double y, double z) { return std::max(0.0, 1 - (x * x + 1.5 * y * y + z * z) / 90); }

const MixedVolume& volume() {
  static const MixedVolume v = fields::mixed(centred_grid({22, 19, 24}), 4, scattered_levels, blob);
  return v;
}

/// All different, and one brick without.
std::vector<float> some_bounds() {
  std::vector<float> bounds;
  for (std::size_t i = 0; i < volume().level.size(); ++i)
    bounds.push_back(static_cast<float>(1 + i * 37 % volume().level.size()) / 1024);
  bounds[bounds.size() / 2] = std::numeric_limits<float>::infinity();
  return bounds;
}

RenderOptions error_options(RenderMode mode) {
  RenderOptions o;
  o.mode = mode;
  o.output = RenderOutput::error;
  o.width = o.height = 65;
  o.camera = orbit_camera(volume().grid, 37, 21, 1);
  o.transfer = transfer_preset("default", 0, 1);
  o.surfaces = {{0.4}};
  o.termination = 1;
  return o;
}

float bound_at(const std::vector<float>& bounds, const Vec3& c) {
  const Index3 n = volume().bricks();
  const auto b = [&](std::size_t a) { return reference::brick_of(volume(), a, c[a]); };
  return bounds[static_cast<std::size_t>((b(2) * n[1] + b(1)) * n[0] + b(0))];
}

/// Least and largest bound of the bricks within fp32's reach of a point.
std::pair<float, float> bounds_near(const std::vector<float>& bounds, const Vec3& p) {
  constexpr double reach = 0x1p-16;  // positions of some 64 cells, to 16 u
  std::pair<float, float> found{std::numeric_limits<float>::infinity(), 0};
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 c{};
    for (std::size_t a = 0; a < 3; ++a)
      c[a] = std::clamp(p[a] - volume().grid.origin[a] + ((corner >> a & 1) != 0 ? reach : -reach), 0.0,
                        static_cast<double>(volume().grid.cells[a]));
    const float bound = bound_at(bounds, c);
    found = {std::min(found.first, bound), std::max(found.second, bound)};
  }
  return found;
}

}  // namespace

BOOST_AUTO_TEST_CASE(dvr_shows_the_largest_bound_of_the_samples_that_are_seen) {
  const std::vector<float> bounds = some_bounds();
  const ResidentVolume v(device(), volume());
  Renderer renderer(device(), v);
  renderer.set_bounds(bounds);
  RenderOptions o = error_options(RenderMode::dvr);
  // What is above 0.3 is seen wherever it lies: 0.009 a cell, of which 22 cells of at most 0.03 leave half.
  o.transfer = {"thin", {{0, {1, 1, 1}, 0}, {1, {1, 1, 1}, 0.03}}};
  for (const SamplerKind sampler : {SamplerKind::buffer, SamplerKind::image3d}) {
    if (sampler == SamplerKind::image3d && !v.has_image3d()) continue;
    o.sampler = sampler;
    const auto shown = renderer.render(o).values.values;
    int seen = 0, wrong = 0;
    for (std::int64_t i = 0; i < 65 * 65; ++i) {
      const reference::Ray ray = reference::pixel_ray(o.camera, 65, 65, i % 65, i / 65);
      const auto [in, out] = reference::clip(ray, volume().grid);
      float least = -1, most = -1;
      for (double k = 0; in + (k + 0.5) < out + 1e-3; ++k) {
        const Vec3 p = reference::along(ray, in + k + 0.5);
        const double value = blob(p[0], p[1], p[2]);
        const auto [lo, hi] = bounds_near(bounds, p);
        // Between samples the field differs from the blob: it reaches up to a cell beyond the edge.
        if (value > 0.3 && in + k + 0.5 < out - 1e-3) least = std::max(least, lo);
        if (blob(0.75 * p[0], 0.75 * p[1], 0.75 * p[2]) > 0) most = std::max(most, hi);
      }
      const float got = shown[static_cast<std::size_t>(i)];
      if (std::isnan(got)) {
        if (least > 0) ++wrong;
        continue;
      }
      ++seen;
      if (!(got >= least && got <= most)) ++wrong;
    }
    BOOST_TEST(seen > 500);
    BOOST_TEST(wrong == 0);
  }
}

BOOST_AUTO_TEST_CASE(surfaces_and_maxima_show_the_bound_of_their_point) {
  const std::vector<float> bounds = some_bounds();
  const ResidentVolume v(device(), volume());
  Renderer renderer(device(), v);
  renderer.set_bounds(bounds);
  for (const RenderMode mode : {RenderMode::iso, RenderMode::mip}) {
    RenderOptions o = error_options(mode);
    const auto shown = renderer.render(o).values.values;
    o.output = RenderOutput::depth;
    const auto depth = renderer.render(o).values.values;
    int seen = 0, wrong = 0;
    for (std::int64_t i = 0; i < 65 * 65; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (std::isnan(depth[k]) != std::isnan(shown[k])) ++wrong;
      if (std::isnan(depth[k])) continue;
      const Vec3 p = reference::along(reference::pixel_ray(o.camera, 65, 65, i % 65, i / 65),
                                      static_cast<double>(depth[k]));
      const auto [lo, hi] = bounds_near(bounds, p);
      ++seen;
      if (!(shown[k] >= lo && shown[k] <= hi)) ++wrong;
    }
    BOOST_TEST(seen > 300);
    BOOST_TEST(wrong == 0);
  }
}

BOOST_AUTO_TEST_CASE(every_way_of_stepping_shows_bounds_of_what_it_took) {
  const std::vector<float> alike(volume().level.size(), 0.25f);
  const ResidentVolume v(device(), volume());
  Renderer renderer(device(), v);
  renderer.set_bounds(alike);
  RenderOptions o = error_options(RenderMode::dvr);
  const auto seen_by = [&] {
    int seen = 0;
    for (const float x : renderer.render(o).values.values) {
      BOOST_REQUIRE((std::isnan(x) || x == 0.25f));
      if (!std::isnan(x)) ++seen;
    }
    return seen;
  };
  BOOST_TEST(seen_by() > 300);
  o.step_mode = StepMode::level;
  BOOST_TEST(seen_by() > 300);
  o.step_mode = StepMode::fixed;
  o.classification = Classification::preintegrated;
  BOOST_TEST(seen_by() > 300);
}

BOOST_AUTO_TEST_CASE(renderers_without_bounds_show_none) {
  const ResidentVolume v(device(), volume());
  Renderer renderer(device(), v);
  BOOST_CHECK_THROW(renderer.render(error_options(RenderMode::dvr)), InputError);
  BOOST_CHECK_THROW(raycast(device(), v, error_options(RenderMode::dvr)), InputError);
  BOOST_CHECK_THROW(renderer.set_bounds({1, 2, 3}), InputError);
  Certificate c;
  BOOST_CHECK_THROW(brick_bounds(c, false), InputError);
  c.brick_totals = {0.5f, -1.0f};
  BOOST_CHECK_THROW(brick_bounds(c, true), InputError);
}

BOOST_AUTO_TEST_CASE(a_bound_holds_rounding_and_the_sampler_beside_the_total) {
  Certificate c;
  c.brick_totals = {0.5f, -1.0f, 0.0f};
  c.budget.arithmetic.value = 0.125;
  c.budget.sampler.buffer.value = 0x1p-30;
  c.budget.sampler.image3d = ErrorTerm{0.25, "device probe"};
  BOOST_CHECK_THROW(brick_bounds(c, true), InputError);  // of another device
  c.budget.sampler.image3d_by_brick = {0.0625f, 1.0f, 0.25f};
  const auto buffer = brick_bounds(c, false), image = brick_bounds(c, true);
  BOOST_TEST(static_cast<double>(buffer[0]) >= 0.625 + 0x1p-30);
  BOOST_TEST(static_cast<double>(buffer[0]) <= 0.625 + 0x1p-22);
  BOOST_TEST(std::isinf(buffer[1]));
  BOOST_TEST(static_cast<double>(image[0]) >= 0.6875);
  BOOST_TEST(static_cast<double>(image[0]) <= 0.6875 + 0x1p-22);
  BOOST_TEST(std::isinf(image[1]));
  BOOST_TEST(static_cast<double>(image[2]) >= 0.375);
}

BOOST_AUTO_TEST_CASE(the_total_is_the_largest_of_bricks_with_what_the_unit_takes_of_each) {
  Certificate c;
  c.measured_total = 0.5;
  c.brick_totals = {0.5f, -1.0f, 0.125f};
  c.budget.arithmetic.value = 0.0625;
  SamplerTerms samplers;
  samplers.buffer.value = 0x1p-10;
  samplers.image3d.emplace();
  samplers.image3d_by_brick = {0.03125f, 4.0f, 0.25f};
  charge_samplers(c, samplers);  // the second brick has no tested point
  BOOST_TEST(c.total_buffer == 0.5625 + 0x1p-10);
  BOOST_TEST(c.budget.sampler.image3d->value == 0.03125);
  BOOST_TEST(*c.total_image3d == 0.59375);
  samplers.image3d_by_brick[2] = 0.5f;  // steep, and yet small in error
  charge_samplers(c, samplers);
  BOOST_TEST(c.budget.sampler.image3d->value == 0.125);
  BOOST_TEST(*c.total_image3d == 0.6875);
  c.brick_sigma = {1.0f, 1.0f, 0.5f};
  BOOST_TEST(worst_in_sigma(c, true) == 2 * 0.6875);
  BOOST_TEST(worst_in_sigma(c, false) == 0.5625 + 0x1p-10);
  samplers.image3d.reset();
  charge_samplers(c, samplers);
  BOOST_TEST(!c.total_image3d.has_value());
}

BOOST_AUTO_TEST_CASE(totals_come_back_from_the_file_and_larger_ones_than_promised_are_refused) {
  const support::TemporaryFolder folder;
  Certificate c = support::full_certificate();
  c.measured_total = 0.75;
  c.brick_totals.assign(volume().level.size(), 0.5f);
  c.brick_totals[3] = -1;
  c.brick_totals[4] = 0.75f;
  const auto path = folder / "a.vdvr";
  write_vdvr(path, volume(), c);
  BOOST_TEST(read_vdvr(path).certificate.brick_totals == c.brick_totals);
  c.brick_totals[5] = 0.76f;
  write_vdvr(path, volume(), c);
  BOOST_CHECK_THROW(read_vdvr(path), FileError);
  c.brick_totals.pop_back();
  BOOST_CHECK_THROW(write_vdvr(path, volume(), c), InputError);
  c.brick_totals.clear();
  write_vdvr(path, volume(), c);
  BOOST_TEST(read_vdvr(path).certificate.brick_totals.empty());
}

BOOST_AUTO_TEST_CASE(pictures_of_bounds_tell_apart_what_is_known_what_is_not_and_nothing) {
  FloatImage bounds{160, 20, std::vector<float>(160 * 20, std::numeric_limits<float>::quiet_NaN())};
  bounds.values[0] = 0;
  bounds.values[1] = 1;
  bounds.values[2] = 2;
  bounds.values[3] = std::numeric_limits<float>::infinity();
  const Image image = bound_picture(bounds, 1);
  BOOST_TEST(image.height == 20 + kErrorCaption);
  const auto pixel = [&](std::size_t i) {
    return std::array<int, 3>{image.rgb[3 * i], image.rgb[3 * i + 1], image.rgb[3 * i + 2]};
  };
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t k = 0; k < i; ++k) BOOST_TEST((pixel(i) != pixel(k)));
}
