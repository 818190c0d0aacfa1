// Renderers and the one-shot forms: draws by raycast.cpp or d2vr.cpp, converts pixels to values and 8 bits.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "host/picture/render/d2vr.hpp"
#include "host/picture/render/raycast.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {
namespace {

std::uint8_t to_byte(float x) {
  // NaN becomes 0.
  return static_cast<std::uint8_t>(x > 0.0f ? std::min(x, 1.0f) * 255.0f + 0.5f : 0.0f);
}

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

using Pixels = std::span<const cl_float4>;

FloatImage values_of(Pixels pixels, const RenderOptions& o) {
  FloatImage image{o.width, o.height, {}, o.output == RenderOutput::normal ? 3 : 1};
  image.values.resize(pixels.size() * static_cast<std::size_t>(image.channels));
  float* to = image.values.data();
  for (const cl_float4& p : pixels) {
    if (image.channels == 3) {
      for (std::size_t c = 0; c < 3; ++c) *to++ = p.s[c];
      continue;
    }
    const bool missed = o.output == RenderOutput::error ? p.s[3] < 0
                        : o.mode == RenderMode::iso     ? p.s[3] < 0
                        : o.mode == RenderMode::mip     ? !std::isfinite(p.s[3])
                                                        : false;
    *to++ = missed ? kNothing : p.s[3];
  }
  return image;
}

Image coloured(Pixels pixels, const RenderOptions& o) {
  Image image{o.width, o.height, std::vector<std::uint8_t>(3 * pixels.size())};
  std::uint8_t* to = image.rgb.data();
  for (const cl_float4& p : pixels)
    for (std::size_t c = 0; c < 3; ++c) *to++ = to_byte(p.s[c]);
  return image;
}

// Of line integrals: black to white over the window.
Image grey(const FloatImage& values, const std::pair<double, double>& window) {
  Image image{values.width, values.height, {}};
  image.rgb.reserve(3 * values.values.size());
  const auto [lo, hi] = window;
  for (const float x : values.values) {
    const double part = hi > lo ? (static_cast<double>(x) - lo) / (hi - lo) : 0;
    image.rgb.insert(image.rgb.end(), 3, to_byte(static_cast<float>(part)));
  }
  return image;
}

// Depths from white, nearest, to dark grey; normals with 0 as middle grey; nothing black.
Image shown(const FloatImage& values) {
  Image image{values.width, values.height,
              std::vector<std::uint8_t>(static_cast<std::size_t>(3 * values.width * values.height))};
  const auto range = range_of_values(values);
  const auto lo = static_cast<float>(range.first), hi = static_cast<float>(range.second);
  const float scale = hi > lo ? 0.85f / (hi - lo) : 0.0f;
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = to_byte(values.channels == 3 ? 0.5f + 0.5f * values.values[i]
                                                : 1.0f - (values.values[i / 3] - lo) * scale);
  return image;
}

}  // namespace

void convert(Pixels pixels, const RenderOptions& o, RenderResult& r) {
  r.values = values_of(pixels, o);
  if (o.mode == RenderMode::integral)
    r.image = grey(r.values, o.slice_range.value_or(range_of_values(r.values)));
  else r.image = o.output == RenderOutput::colour ? coloured(pixels, o) : shown(r.values);
}

std::pair<double, double> range_of_values(const FloatImage& values) {
  std::pair<double, double> range{std::numeric_limits<double>::infinity(),
                                  -std::numeric_limits<double>::infinity()};
  for (const float x : values.values) {
    if (!std::isfinite(x)) continue;
    range.first = std::min(range.first, static_cast<double>(x));
    range.second = std::max(range.second, static_cast<double>(x));
  }
  return range.first <= range.second ? range : std::pair{0.0, 0.0};
}

struct Renderer::Impl {
  Device* device;
  const ResidentVolume* volume = nullptr;  ///< or
  const D2vrScene* scene = nullptr;
  Frame frame;
};

Renderer::Renderer(Device& device, const ResidentVolume& volume)
    : impl_(new Impl{&device, &volume, nullptr, Frame(drawn_field(volume))}) {}
Renderer::Renderer(Device& device, const D2vrScene& scene)
    : impl_(new Impl{&device, nullptr, &scene, Frame(drawn_field(scene))}) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

void Renderer::set_bounds(const std::vector<float>& bounds) { impl_->frame.set_bounds(bounds); }

SamplerKind Renderer::sampler(SamplerKind asked) const {
  return impl_->volume ? choose_sampler(*impl_->device, *impl_->volume, asked).first : SamplerKind::buffer;
}

RenderResult Renderer::render(const RenderOptions& options) {
  Frame& frame = impl_->frame;
  Enqueued enqueued = impl_->volume ? enqueue_frame(frame, *impl_->device, *impl_->volume, options)
                                    : enqueue_frame(frame, *impl_->scene, options);
  RenderResult r;
  r.sampler = enqueued.sampler;
  r.sampler_reason = std::move(enqueued.sampler_reason);
  r.gradient = enqueued.gradient;
  if (options.output == RenderOutput::colour && options.mode != RenderMode::integral) {
    frame.develop(options);
    r.image = frame.image(options);
    r.seconds = enqueued.seconds();
    r.values = frame.values(options);
  } else {
    // Converted where they lie: a copy of them would be a tenth of a fast frame.
    frame.picture().read_mapped([&](Pixels pixels) {
      r.seconds = enqueued.seconds();
      convert(pixels, options, r);
    });
  }
  r.samples = frame.samples();
  return r;
}

RenderResult raycast(Device& device, const ResidentVolume& volume, const RenderOptions& options) {
  return Renderer(device, volume).render(options);
}

RenderResult raycast(Device& device, const D2vrScene& scene, const RenderOptions& options) {
  return Renderer(device, scene).render(options);
}

}  // namespace vdvr
