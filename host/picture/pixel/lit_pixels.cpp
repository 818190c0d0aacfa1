// Intervals of pixels whose light is that of F, ray by ray on the host (docs/pixel-bounds.md, section 7).
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "host/base/system/outward.hpp"
#include "host/base/system/parallel.hpp"
#include "host/picture/pixel/pixel_ray.hpp"
#include "host/picture/rays/lit_emission.hpp"
#include "host/picture/render/check_render_options.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/certify_picture.hpp"

namespace vdvr {
namespace {

void check(const MixedVolume& volume, const std::vector<float>& bounds, const RenderOptions& o,
           const CertifyPictureOptions& c) {
  check_options(o);
  if (o.mode != RenderMode::dvr || o.output != RenderOutput::colour)
    throw InputError("light is certified of colours of `mode` dvr alone");
  if (!o.shading) throw InputError("a picture without light has none to certify");
  if (o.gradient != GradientKind::central)
    throw InputError("light is certified of `gradient` central alone: differences of F over one base cell");
  if (c.fast) throw InputError("light is certified by two passes alone, not by `fast`");
  if (c.window)
    throw InputError(
        "light is not certified where the certificate has a window: F's differences across it are "
        "unknown");
  if (bounds.size() != static_cast<std::size_t>(volume.brick_count()))
    throw InputError(fmt::format("{} bounds for {} bricks", bounds.size(), volume.brick_count()));
  if (!(c.kappa >= 0x1p-10 && c.kappa <= 1024))
    throw InputError(fmt::format("`certify_parts` kappa {} must lie between 1/1024 and 1024", c.kappa));
  if (!(c.theta > 0 && c.theta < 1))
    throw InputError(fmt::format("termination {} of a certified picture must lie in (0, 1)", c.theta));
}

// Of a base cell: far above what clipped rays are rounded by (ray_walk.cpp).
constexpr double hair = 0x1p-24;

}  // namespace

Clip inside_of_differences(const Clip& known, const Grid& g) {
  Clip inside = known;
  for (std::size_t a = 0; a < 3; ++a) {
    const double half = (0.5 + hair) * g.spacing[a],
                 end = g.origin[a] + static_cast<double>(g.cells[a]) * g.spacing[a];
    inside.low[a] = std::max(known.low[a], g.origin[a]) + half;
    inside.high[a] = std::min(known.high[a], end) - half;
  }
  inside.radius = known.radius - (0.5 + hair) * std::max(g.spacing[0], g.spacing[1]);
  return inside;
}

PixelBounds certify_lit_pixels(const MixedVolume& volume, const std::vector<float>& bounds, const Clip& known,
                               const std::pair<float, float>& value_range, const RenderOptions& o,
                               const CertifyPictureOptions& certify, const Progress& progress) {
  check(volume, bounds, o, certify);
  const auto start = std::chrono::steady_clock::now();
  const RayField drawn(volume, bounds, o.clip.value_or(Clip{})), around(volume, bounds, known);
  const LitEmission emission(drawn, around, volume.grid, o, full_gradient(value_range),
                             {certify.kappa, certify.theta});
  const auto pixels = static_cast<std::size_t>(o.width * o.height);
  PixelBounds result;
  result.light = CertifiedLight::lit;
  result.lo = result.hi = FloatImage{o.width, o.height, std::vector<float>(3 * pixels), 3};
  result.parts.resize(pixels);
  result.untested.resize(pixels);
  parallel_for(o.height, progress, "certify", [&](std::int64_t y) {
    const std::array<double, 3> background = background_of_pixel(o, y);
    for (std::int64_t x = 0; x < o.width; ++x) {
      const LitRay ray = emission.along(pixel_ray(o.camera, o.width, o.height, x, y), background);
      const auto i = static_cast<std::size_t>(y * o.width + x);
      for (std::size_t c = 0; c < 3; ++c) {
        result.lo.values[3 * i + c] = down(ray.colours.low[c]);
        result.hi.values[3 * i + c] = up(ray.colours.high[c]);
      }
      result.parts[i] = static_cast<std::uint32_t>(ray.parts);
      result.untested[i] = ray.untested ? 1 : 0;
    }
  });
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace vdvr
