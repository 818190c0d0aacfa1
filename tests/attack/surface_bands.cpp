// Bands of surfaces of fields with an analytic F: F's first crossing held to them at every pixel, and how
// deep they are beside what V's own picture errs (docs/surfaces.md). A row of a table; fails where a crossing
// lies outside. scripts/long surface-bands makes the table.
//   surface_bands FIELD CELLS LEVEL VALUE [SIDE]
// FIELD: marschner-lobb or blobs; LEVEL: samples 2^LEVEL to a cell; SIDE: pixels of the picture's side (64).
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <string>

#include "host/base/system/parallel.hpp"
#include "host/picture/rays/crossings.hpp"
#include "tests/support/analytic_pictures.hpp"

using namespace vdvr;

namespace {

constexpr double step = 1.0 / 64;  // of the truth, in base cells

struct Pixel {
  bool meets = false, outside = false, from_start = false;
  Hit hit = Hit::none;
  std::optional<double> band;
  std::optional<double> f, v;  // first crossings, of V by its cubics
};

/// The first place where `f` is not on the side on which it begins.
template <class Field>
std::optional<double> first_of(const Field& f, double begin, double end, double value) {
  const double sign = f(begin) < value ? 1 : -1;
  for (double t = begin; t < end; t += step)
    if (!(sign * (f(t) - value) < 0)) return t;
  return std::nullopt;
}

Pixel look(const support::AnalyticField& analytic, const RayField& field, const RayField& drawn,
           const Grid& grid, const WorldRay& ray, double value) {
  Pixel p;
  const auto [begin, end] = field.clipped(ray);
  p.meets = begin < end;
  if (!p.meets) return p;
  const auto f = [&](double t) {
    const Vec3 at = ray.at(t);
    return analytic.at(at[0] - grid.origin[0], at[1] - grid.origin[1], at[2] - grid.origin[2]);
  };
  const Crossing c = first_crossing(field, ray, value), of_v = first_crossing(drawn, ray, value);
  p.hit = c.hit;
  p.from_start = c.from_start;
  if (c.hit == Hit::sure) p.band = c.last - c.first;
  if (of_v.hit == Hit::sure) p.v = of_v.first;
  p.f = first_of(f, begin, end, value);
  if (c.from_start) {
    p.outside = c.hit == Hit::sure && !support::passes(f, begin, c.last, value, step, analytic.slope);
    return p;
  }
  const double sign = f(begin) < value ? 1 : -1;
  p.outside = c.hit == Hit::none ? p.f.has_value() : p.f && *p.f < c.first;
  if (c.hit == Hit::sure && !(sign * (f(c.last) - value) >= 0 && c.last >= c.first)) p.outside = true;
  return p;
}

double at_share(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}
double mean(const std::vector<double>& values) {
  return values.empty()
             ? 0
             : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

int report(const std::vector<Pixel>& pixels, const std::string& name, double value) {
  std::array<double, 3> kinds{};
  double rays = 0, other = 0, unknown = 0;
  std::int64_t outside = 0;
  std::vector<double> bands, errors;
  for (const Pixel& p : pixels) {
    if (!p.meets) continue;
    rays += 1;
    kinds[static_cast<std::size_t>(p.hit)] += 1;
    outside += p.outside ? 1 : 0;
    unknown += p.from_start ? 1 : 0;
    if (p.f.has_value() != p.v.has_value()) other += 1;
    if (p.f && p.v) errors.push_back(std::abs(*p.f - *p.v));
    if (p.band) bands.push_back(*p.band);
  }
  const auto share = [&](double n) { return 100 * n / rays; };
  fmt::print(
      "| {}, {:g} | {:.1f} / {:.1f} / {:.1f} | {:.1f} | {:.2f} | {:.2f}, {:.1f} | {:.2f}, {:.2f}, {:.1f} | "
      "{} |\n",
      name, value, share(kinds[2]), share(kinds[1]), share(kinds[0]), share(unknown), share(other),
      mean(errors), at_share(errors, 1), mean(bands), at_share(bands, 0.5), at_share(bands, 0.99), outside);
  return outside == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    fmt::print(stderr, "usage: surface_bands FIELD CELLS LEVEL VALUE [SIDE]\n");
    return 2;
  }
  const std::string name = argv[1];
  const std::int64_t cells = std::atoi(argv[2]), side = argc > 5 ? std::atoi(argv[5]) : 64;
  const auto level = static_cast<std::uint8_t>(std::atoi(argv[3]));
  const double value = std::atof(argv[4]);
  const support::AnalyticField analytic =
      name == "blobs" ? support::blobs(cells)
                      : support::marschner_lobb(cells, 6.0 * static_cast<double>(cells) / 64);
  const MixedVolume volume = support::volume_of(analytic, {{level, level, level}}, 1);
  const std::vector<float> bounds = support::proved_bounds(analytic, volume, 0, name == "blobs" ? 4 : 16),
                           none(bounds.size(), 0.0f);
  // A cylinder around the whole cube.
  ParallelGeometry g;
  g.columns = g.rows = 2 * cells;
  g.center = static_cast<double>(cells) - 0.5;
  const auto views = static_cast<int>(2 * cells);
  for (int k = 0; k < views; ++k) g.theta_rad.push_back(std::numbers::pi * k / views);
  const Coverage coverage(g);
  const RayField field(volume, bounds, coverage), drawn(volume, none, coverage);
  const Camera camera = orbit_camera(volume.grid, 30, 20, 1.35);
  std::vector<Pixel> pixels(static_cast<std::size_t>(side * side));
  parallel_for(side, {}, "rays", [&](std::int64_t y) {
    for (std::int64_t x = 0; x < side; ++x)
      pixels[static_cast<std::size_t>(y * side + x)] =
          look(analytic, field, drawn, volume.grid, pixel_ray(camera, side, side, x, y), value);
  });
  return report(pixels, fmt::format("{}, {} to {} cells", name, (cells << level), cells), value);
}
