// What lies behind the pixels of a picture, as floats: opacity, depth, maximum or field. Called by the render
// command. Calls: raycast_float of raycast.cpp, sample_at.
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/raycast.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

std::uint8_t to_byte(float x) {
  // NaN becomes 0, as in raycast().
  return static_cast<std::uint8_t>(x > 0.0f ? std::min(x, 1.0f) * 255.0f + 0.5f : 0.0f);
}

float value_of(RenderMode mode, float fourth) {
  if (mode == RenderMode::iso && fourth < 0) return kNothing;
  if (mode == RenderMode::mip && !std::isfinite(fourth)) return kNothing;
  return fourth;
}

}  // namespace

RenderResult raycast_with_values(Device& device, const ResidentVolume& volume, const RenderOptions& o,
                                 FloatImage& values) {
  FloatPicture picture = raycast_float(device, volume, o);
  RenderResult r;
  r.sampler = picture.sampler;
  r.sampler_reason = std::move(picture.sampler_reason);
  r.samples = picture.samples;
  r.seconds = picture.seconds;
  r.image = {o.width, o.height, {}};
  values = {o.width, o.height, {}};
  r.image.rgb.reserve(3 * picture.pixels.size());
  values.values.reserve(picture.pixels.size());
  for (const cl_float4& p : picture.pixels) {
    for (std::size_t c = 0; c < 3; ++c) r.image.rgb.push_back(to_byte(p.s[c]));
    values.values.push_back(value_of(o.mode, p.s[3]));
  }
  return r;
}

FloatImage slice_values(const MixedVolume& volume, const RenderOptions& o) {
  const Grid& g = volume.grid;
  const auto axis = static_cast<std::size_t>(o.slice_axis);
  const std::size_t across = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
  const auto side = [&](std::size_t a) { return static_cast<double>(g.cells[a]) * g.spacing[a]; };
  const double at = o.slice_position.value_or(g.origin[axis] + side(axis) / 2);
  if (!(at >= g.origin[axis] && at <= g.origin[axis] + side(axis)))
    throw InputError("--slice-position lies outside the grid");
  // The pixels of the slice picture: square, the slice centred.
  const double pixel =
      std::max(side(across) / static_cast<double>(o.width), side(down) / static_cast<double>(o.height));
  const auto offset = [&](std::size_t a, std::int64_t i, std::int64_t pixels) {
    return side(a) / 2 + (static_cast<double>(i) + 0.5 - static_cast<double>(pixels) / 2) * pixel;
  };
  FloatImage image{o.width, o.height, {}};
  image.values.reserve(static_cast<std::size_t>(o.width * o.height));
  for (std::int64_t y = 0; y < o.height; ++y)
    for (std::int64_t x = 0; x < o.width; ++x) {
      const double u = offset(across, x, o.width), v = offset(down, y, o.height);
      const bool inside = u >= 0 && u <= side(across) && v >= 0 && v <= side(down);
      Vec3 point{};
      point[axis] = at;
      point[across] = g.origin[across] + u;
      point[down] = g.origin[down] + v;
      image.values.push_back(inside ? sample_at(volume, point) : kNothing);
    }
  return image;
}

}  // namespace vdvr
