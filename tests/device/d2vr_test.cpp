#define BOOST_TEST_MODULE d2vr
#include <boost/test/unit_test.hpp>

#include <cmath>
#include <cstring>
#include <random>

#include "host/field/fbp/cosine_series.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "host/picture/render/d2vr.hpp"
#include "tests/reference/cosine_series.hpp"
#include "tests/reference/d2vr.hpp"
#include "tests/reference/ramp_filter.hpp"
#include "tests/reference/raycast.hpp"
#include "tests/support/device.hpp"
#include "tests/support/scans.hpp"
#include "tests/support/tolerance.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/reconstruct.hpp"

using namespace vdvr;

namespace {

constexpr double u = tolerance::unit_roundoff;

using support::device;

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

// Off the centre, with pixels that are not square.
ProjectionSet uneven_scan() {
  ProjectionSet scan = testing::noise_scan(13, 9, 21);
  scan.geometry.pitch_u = 0.75;
  scan.geometry.pitch_v = 1.25;
  scan.geometry.center = 10.375;
  return scan;
}

// A soft ball of width 5, off the centre: nothing in its filtered projections is sharp.
ProjectionSet soft_scan() {
  ProjectionSet scan = testing::empty_scan(32, 33, 41);
  const ParallelGeometry& g = scan.geometry;
  for (std::int64_t k = 0; k < g.views(); ++k) {
    const double t = 2 * std::cos(g.theta_rad[at(k)]) - 3 * std::sin(g.theta_rad[at(k)]);
    for (std::int64_t j = 0; j < g.rows; ++j)
      for (std::int64_t i = 0; i < g.columns; ++i) {
        const double du = static_cast<double>(i) - g.center - t, dv = static_cast<double>(j) - 17;
        scan.data[at((k * g.rows + j) * g.columns + i)] =
            static_cast<float>(12.5 * std::exp(-(du * du + dv * dv) / 50));
      }
  }
  return scan;
}

reference::BilinearViews views_of(const ProjectionSet& scan) {
  return {scan.geometry, scan.geometry.columns, scan.geometry.rows, 0, 1, reference::ramp_filtered(scan)};
}

// The same on the columns and rows of an upsampled field: the cosine series along both.
reference::BilinearViews upsampled_views(const ProjectionSet& scan, int rate) {
  const ParallelGeometry& g = scan.geometry;
  const std::vector<double> q = reference::ramp_filtered(scan);
  const UpsampledColumns columns = upsampled_columns(g.columns, rate, 0);
  reference::BilinearViews out{
      g, columns.count, (g.rows - 1) * rate + 1, columns.position(0), static_cast<double>(rate), {}};
  for (std::int64_t k = 0; k < g.views(); ++k) {
    std::vector<std::vector<double>> series;  // by stored row: coefficients along u
    for (std::int64_t j = 0; j < out.rows; ++j) {
      std::vector<double> row(at(g.columns));
      for (std::int64_t i = 0; i < g.columns; ++i) {
        const std::span<const double> column(q.data() + (k * g.columns + i) * g.rows, at(g.rows));
        row[at(i)] =
            reference::cosine_series(reference::cosine_coefficients(column), static_cast<double>(j) / rate);
      }
      series.push_back(reference::cosine_coefficients(row));
    }
    for (std::int64_t i = 0; i < columns.count; ++i)
      for (std::int64_t j = 0; j < out.rows; ++j)
        out.values.push_back(reference::cosine_series(series[at(j)], columns.position(i)));
  }
  return out;
}

std::vector<Vec3> covered_points(const D2vrField& field, std::size_t count) {
  std::mt19937 random(5);
  const ParallelGeometry& g = field.geometry();
  const double across = 0.5 * static_cast<double>(g.columns) * g.pitch_u,
               along = 0.5 * static_cast<double>(g.rows - 1) * g.pitch_v;
  std::uniform_real_distribution<double> xy(-across, across), z(-along, along);
  std::vector<Vec3> points;
  while (points.size() < count)
    if (const Vec3 p{xy(random), xy(random), z(random)}; field.covered(p)) points.push_back(p);
  return points;
}

// What the device's value may differ from the reference by; `samples` bounds the error of the stored samples,
// summed over the views, which a bilinear weighting does not raise.
double rounding(const reference::BilinearSum& r, std::int64_t views, double samples) {
  // Six operations make a view's term, `views` additions sum them. 1 + 2^-10: second orders of u.
  return (tolerance::fp32_sum(views + 6, r.magnitude) + u * r.positions + samples) * (1 + 0x1p-10);
}

void check_field(const ProjectionSet& scan, const D2vrField& field, const reference::BilinearViews& q,
                 double samples) {
  const std::vector<Vec3> points = covered_points(field, 2000);
  const std::vector<float> values = field.at(points);
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const reference::BilinearSum r = reference::bilinear_sum(q, points[i]);
    const double ratio =
        std::abs(static_cast<double>(values[i]) - r.value) / rounding(r, scan.geometry.views(), samples);
    if (!(ratio <= worst)) worst = std::isnan(ratio) ? 1e300 : ratio;
  }
  BOOST_TEST_MESSAGE("largest error over bound " << worst);
  BOOST_TEST(worst <= 1.0);
  BOOST_TEST(worst > 0.0);
}

// The sum over views of the largest error of a filtered sample.
double filter_error(const ProjectionSet& scan) {
  FilteredScan filtered = filter_projections(device().state(), scan, {});
  return filtered.ramp_error;
}

Grid box(std::int64_t cells, double spacing) {
  const double half = -0.5 * static_cast<double>(cells) * spacing;
  return {{cells, cells, cells}, {half, half, half}, {spacing, spacing, spacing}, "pixel"};
}

RenderOptions options_for(const Grid& grid) {
  RenderOptions o;
  o.width = o.height = 40;
  o.camera = orbit_camera(grid, 37, 21, 1);
  o.transfer = {"ramp", {{0, {1, 0.5, 0.25}, 0}, {0.2, {1, 0.5, 0.25}, 0}, {1, {1, 0.5, 0.25}, 0.25}}};
  o.sampler = SamplerKind::buffer;
  return o;
}

bool same_bits(const FloatPicture& a, const FloatPicture& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(cl_float4)) == 0;
}

}  // namespace

BOOST_AUTO_TEST_CASE(field_is_the_bilinear_sum_over_views) {
  for (const ProjectionSet& scan : {uneven_scan(), soft_scan()})
    check_field(scan, D2vrField(device(), scan, {}), views_of(scan), filter_error(scan));
}

BOOST_AUTO_TEST_CASE(upsampled_field_is_the_bilinear_sum_over_the_cosine_series) {
  const ProjectionSet scan = uneven_scan();
  const ParallelGeometry& g = scan.geometry;
  const reference::BilinearViews q = upsampled_views(scan, 4);
  // Interpolation by a cosine series of n samples raises errors by at most its Lebesgue constant
  // (exact_field.cpp); its products are two dot products.
  const auto growth = [](std::int64_t n) { return 2 / M_PI * std::log(2.0 * static_cast<double>(n)) + 1.5; };
  const double gain = growth(g.columns) * growth(g.rows);
  double largest = 0;
  for (const double x : views_of(scan).values) largest = std::max(largest, std::abs(x));
  const double products =
      tolerance::fp32_sum(g.columns + g.rows + 4, gain * largest) * static_cast<double>(g.views());
  const D2vrField field(device(), scan, {{}, 4});
  check_field(scan, field, q, gain * filter_error(scan) + products);
  BOOST_TEST(field.bytes() == static_cast<std::uint64_t>(4 * g.views() * q.columns * q.rows));
}

BOOST_AUTO_TEST_CASE(a_point_that_a_view_misses_is_empty) {
  const ProjectionSet scan = uneven_scan();
  const D2vrField field(device(), scan, {});
  const double radius = 20 * scan.geometry.pitch_u;
  const std::vector<Vec3> points{{radius, 0, 0}, {0, -radius, 1}, {radius, radius, 0}};
  for (const Vec3& p : points) BOOST_TEST(!field.covered(p));
  for (const float x : field.at(points)) BOOST_TEST(x == 0.0f);
}

BOOST_AUTO_TEST_CASE(a_detector_of_one_row_stands_for_all_heights) {
  ProjectionSet scan = testing::noise_scan(13, 1, 21);
  const D2vrField field(device(), scan, {});
  const std::vector<Vec3> points{{1.5, -2.25, -0.25}, {1.5, -2.25, 0}, {1.5, -2.25, 0.5}};
  const std::vector<float> values = field.at(points);
  BOOST_TEST(values[0] == values[1]);
  BOOST_TEST(std::abs(values[2] - values[1]) <= tolerance::fp32_sum(13 + 6, 13.0));
  BOOST_TEST(values[1] != 0.0f);
}

// Both pictures take the same samples along the same rays. Between its samples a volume's trilinear field
// misses the bilinear sum: along an axis a view's term is linear but for at most one kink a cell, of the
// second difference d2, which an interpolant over h misses by h/4 |d2|; the axes add (docs/error-bounds.md).
// Errors of an opacity are its slope times that, those of a ray at most the sum over its samples; colour is
// opacity times a constant.
BOOST_AUTO_TEST_CASE(picture_is_that_of_a_finely_sampled_volume) {
  const ProjectionSet scan = soft_scan();
  const D2vrField field(device(), scan, {});
  const double h = 0.125;
  const Grid grid = box(176, h);
  const D2vrScene scene(device(), field, grid);
  const ResidentVolume volume(device(), as_mixed(scene.samples()));
  RenderOptions o = options_for(grid);
  o.shading = false;
  o.step = 8;
  o.transfer.points.back().opacity = 0.0125;
  o.termination = 1;
  const FloatPicture direct = raycast_float(scene, o), sampled = raycast_float(device(), volume, o);

  const reference::BilinearViews q = views_of(scan);
  double miss = 0, magnitude = 0;
  for (std::int64_t k = 0; k < scan.geometry.views(); ++k) {
    double across = 0, down = 0, largest = 0;
    for (std::int64_t i = 0; i < q.columns; ++i)
      for (std::int64_t j = 0; j < q.rows; ++j) {
        const double two = 2 * q.at(k, i, j);
        across = std::max(across, std::abs(q.at(k, i - 1, j) - two + q.at(k, i + 1, j)));
        down = std::max(down, std::abs(q.at(k, i, j - 1) - two + q.at(k, i, j + 1)));
        largest = std::max(largest, std::abs(q.at(k, i, j)));
      }
    const double theta = scan.geometry.theta_rad[at(k)];
    miss += h / 4 * ((std::abs(std::cos(theta)) + std::abs(std::sin(theta))) * across + down);
    magnitude += largest;
  }
  miss += tolerance::fp32_sum(scan.geometry.views() + 20, 2 * magnitude);
  // Opacity of a step of eight cells by density: 8 (1 - o)^7 o' at most.
  const double slope = 8 * 0.0125 / 0.8, samples = std::ceil(std::sqrt(3.0) * 176 / 8);
  const double bound = samples * (slope * miss + 64 * u);
  BOOST_TEST_MESSAGE("bound " << bound << ", a sample's " << miss);
  double worst = 0, brightest = 0;
  for (std::size_t i = 0; i < direct.pixels.size(); ++i) {
    const double d =
        std::abs(static_cast<double>(direct.pixels[i].s[3]) - static_cast<double>(sampled.pixels[i].s[3]));
    if (!(d <= worst)) worst = std::isnan(d) ? 1e300 : d;
    brightest = std::max(brightest, static_cast<double>(direct.pixels[i].s[3]));
  }
  BOOST_TEST_MESSAGE("largest difference of opacity " << worst << " of " << brightest);
  BOOST_TEST(worst <= bound);
  BOOST_TEST(brightest > 4 * bound);
  BOOST_TEST(direct.samples > 0);
}

BOOST_AUTO_TEST_CASE(every_ray_counts_the_path_it_has) {
  const ProjectionSet scan = soft_scan();
  const D2vrField field(device(), scan, {});
  const Grid grid = box(22, 1);
  const D2vrScene scene(device(), field, grid);
  constexpr double opacity = 0.05;
  RenderOptions o = options_for(grid);
  o.shading = false;
  o.termination = 1;
  o.transfer = {"constant", {{0, {1, 1, 1}, opacity}, {1, {1, 1, 1}, opacity}}};
  for (const double step : {0.7, 5.0, 100.0}) {
    o.step = step;
    const FloatPicture picture = raycast_float(scene, o);
    double worst = 0;
    int shorter = 0;
    for (std::int64_t i = 0; i < o.width * o.height; ++i) {
      const auto [in, out] =
          reference::clip(reference::pixel_ray(o.camera, o.width, o.height, i % o.width, i / o.width), grid);
      const double path = std::max(0.0, out - in);
      if (path > 0 && path < step / 2) ++shorter;
      worst = std::max(worst, std::abs(static_cast<double>(picture.pixels[at(i)].s[3]) -
                                       (1 - std::pow(1 - opacity, path))));
    }
    BOOST_TEST(shorter > 0);
    // As in raycast_steps_test.
    const double distance = std::sqrt(reference::dot(o.camera.position, o.camera.position));
    const double ends = 2 * 16 * u * distance * -std::log(1 - opacity);
    BOOST_TEST(!(worst > tolerance::fp32_sum(4 * static_cast<std::int64_t>(39 / step + 1) + 64, 1) + ends));
  }
}

BOOST_AUTO_TEST_CASE(normals_are_central_differences_of_the_field) {
  const ProjectionSet scan = soft_scan();
  const D2vrField field(device(), scan, {});
  const Grid grid = box(22, 1);
  RenderOptions o = options_for(grid);
  o.output = RenderOutput::normal;
  o.transfer.points.back().opacity = 0.9;
  const FloatPicture picture = raycast_float(D2vrScene(device(), field, grid), o);
  const reference::BilinearViews q = views_of(scan);
  const double eye = std::sqrt(reference::dot(o.camera.position, o.camera.position));
  const double filtered = filter_error(scan);
  int seen = 0;
  double worst = 0, widest = 0;
  for (std::int64_t i = 0; i < o.width * o.height; ++i) {
    const cl_float4& pixel = picture.pixels[at(i)];
    if (!std::isfinite(pixel.s[3])) continue;
    const reference::Ray ray = reference::pixel_ray(o.camera, o.width, o.height, i % o.width, i / o.width);
    const Vec3 p = reference::along(ray, static_cast<double>(pixel.s[3]));
    Vec3 gradient{};
    double error = 0;
    bool inside = true;
    for (std::size_t a = 0; a < 3; ++a) {
      Vec3 lo = p, hi = p;
      lo[a] -= 0.5;
      hi[a] += 0.5;
      inside = inside && lo[a] > -11 && hi[a] < 11;
      const auto below = reference::bilinear_sum(q, lo), above = reference::bilinear_sum(q, hi);
      gradient[a] = above.value - below.value;
      error += rounding(below, q.geometry.views(), filtered) + rounding(above, q.geometry.views(), filtered);
      // The eye, the direction and the distance along it are fp32, 16 roundings of lengths up to 2 eye: as
      // far as the point may lie aside, by the steepest view sum.
      error += 2 * 16 * u * 2 * eye * std::sqrt(3.0) * (below.positions + above.positions) /
               (3 * std::abs(q.geometry.center));
    }
    if (!inside) continue;
    const double length = std::sqrt(reference::dot(gradient, gradient));
    double difference = 0;
    for (std::size_t a = 0; a < 3; ++a)
      difference = std::max(difference, std::abs(static_cast<double>(pixel.s[a]) + gradient[a] / length));
    const double bound = 2 * error / length + 8 * u, ratio = difference / bound;
    widest = std::max(widest, bound);
    if (!(ratio <= worst)) worst = std::isnan(ratio) ? 1e300 : ratio;
    ++seen;
  }
  BOOST_TEST_MESSAGE(seen << " normals, largest error over bound " << worst << ", bound at most " << widest);
  BOOST_TEST(seen > 100);
  // The bound can tell a wrong sign: the largest component of a unit vector is 1/sqrt(3) at least, turned
  // round it errs by twice that.
  BOOST_TEST(widest < 2 / std::sqrt(3.0));
  BOOST_TEST(worst <= 1.0);
}

BOOST_AUTO_TEST_CASE(analytic_normals_are_the_derivative_of_the_sum) {
  const ProjectionSet scan = soft_scan();
  const D2vrField field(device(), scan, {});
  const Grid grid = box(22, 1);
  RenderOptions o = options_for(grid);
  o.output = RenderOutput::normal;
  o.gradient = GradientKind::analytic;
  o.transfer.points.back().opacity = 0.9;
  const FloatPicture picture = raycast_float(D2vrScene(device(), field, grid), o);
  const reference::BilinearViews q = views_of(scan);
  const double eye = std::sqrt(reference::dot(o.camera.position, o.camera.position));
  // As above: how far the point may lie aside, and the rounding of its columns and rows.
  const double aside = 2 * 16 * u * 2 * eye * std::sqrt(3.0) + 12 * u * 3 * q.geometry.center;
  const double filtered = filter_error(scan);
  int seen = 0, kinks = 0;
  double worst = 0, widest = 0;
  for (std::int64_t i = 0; i < o.width * o.height; ++i) {
    const cl_float4& pixel = picture.pixels[at(i)];
    if (!std::isfinite(pixel.s[3])) continue;
    const reference::Ray ray = reference::pixel_ray(o.camera, o.width, o.height, i % o.width, i / o.width);
    const auto g = reference::bilinear_gradient(q, reference::along(ray, static_cast<double>(pixel.s[3])));
    // Where a column or row may be passed by rounding alone the derivative is not one number.
    if (g.nearest <= aside) {
      ++kinks;
      continue;
    }
    double error = 0;
    for (std::size_t a = 0; a < 3; ++a)
      error +=
          tolerance::fp32_sum(q.geometry.views() + 8, g.magnitude[a]) + g.mixed[a] * aside + 2 * filtered;
    const double length = std::sqrt(reference::dot(g.value, g.value)), bound = 2 * error / length + 8 * u;
    double difference = 0;
    for (std::size_t a = 0; a < 3; ++a)
      difference = std::max(difference, std::abs(static_cast<double>(pixel.s[a]) + g.value[a] / length));
    widest = std::max(widest, bound);
    if (!(difference / bound <= worst)) worst = std::isnan(difference / bound) ? 1e300 : difference / bound;
    ++seen;
  }
  BOOST_TEST_MESSAGE(seen << " normals, " << kinks << " at kinks, largest error over bound " << worst
                          << ", bound at most " << widest);
  BOOST_TEST(seen > 100);
  BOOST_TEST(widest < 2 / std::sqrt(3.0));  // tells a wrong sign, as above
  BOOST_TEST(worst <= 1.0);
}

BOOST_AUTO_TEST_CASE(lanes_and_groups_change_no_bit) {
  const D2vrField field(device(), soft_scan(), {});
  const D2vrScene scene(device(), field, box(22, 1));
  RenderOptions o = options_for(box(22, 1));
  o.width = 37;
  const FloatPicture one = raycast_float(scene, o, {8, 8, 1});
  for (const int lanes : {4, 8, 16}) {
    const FloatPicture many = raycast_float(scene, o, {4, 4, lanes});
    BOOST_TEST(same_bits(one, many));
  }
}

// The margin of the ranges is no bound; here, where second differences are small beside what a brick spans,
// it is wide enough everywhere that was looked at.
BOOST_AUTO_TEST_CASE(skipping_saves_samples_of_a_soft_field_and_changes_no_bit) {
  const D2vrField field(device(), soft_scan(), {});
  const Grid grid = box(26, 0.8);
  const D2vrScene scene(device(), field, grid);
  RenderOptions o = options_for(grid);
  const FloatPicture skipping = raycast_float(scene, o);
  o.skip_empty = false;
  const FloatPicture all = raycast_float(scene, o);
  BOOST_TEST(same_bits(skipping, all));
  BOOST_TEST(skipping.samples < all.samples);

  const auto ranges = occupied_ranges(scene.samples(), 4);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> cell(0, 26);
  std::vector<Vec3> points;
  std::vector<std::size_t> brick;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 c{cell(random), cell(random), cell(random)};
    const auto b = [&](std::size_t a) { return static_cast<std::size_t>(c[a]) / 4; };
    points.push_back({-10.4 + 0.8 * c[0], -10.4 + 0.8 * c[1], -10.4 + 0.8 * c[2]});
    brick.push_back((b(2) * 7 + b(1)) * 7 + b(0));
  }
  const std::vector<float> values = field.at(points);
  int outside = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!(values[i] >= ranges[brick[i]].s[0] && values[i] <= ranges[brick[i]].s[1])) ++outside;
  BOOST_TEST(outside == 0);
}

BOOST_AUTO_TEST_CASE(what_needs_a_stored_volume_is_refused) {
  const D2vrField field(device(), soft_scan(), {});
  const D2vrScene scene(device(), field, box(8, 1));
  const auto refused = [&](auto&& change) {
    RenderOptions o = options_for(box(8, 1));
    change(o);
    BOOST_CHECK_THROW(raycast(device(), scene, o), InputError);
  };
  refused([](RenderOptions& o) { o.mode = RenderMode::iso; });
  refused([](RenderOptions& o) { o.mode = RenderMode::mip; });
  refused([](RenderOptions& o) { o.mode = RenderMode::slice; });
  refused([](RenderOptions& o) { o.classification = Classification::preintegrated; });
  refused([](RenderOptions& o) { o.step_mode = StepMode::level; });
  refused([](RenderOptions& o) { o.sampler = SamplerKind::image3d; });
  refused([](RenderOptions& o) { o.gradient = GradientKind::stored; });
  refused([](RenderOptions& o) { o.output = RenderOutput::error; });
  refused([](RenderOptions& o) { o.width = 0; });
  BOOST_CHECK_THROW(D2vrField(device(), soft_scan(), {{}, 3}), InputError);
  BOOST_CHECK_THROW(D2vrField(device(), testing::noise_scan(3, 3, 1), {}), InputError);
}
