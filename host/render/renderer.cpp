// Renderers and the one-shot forms: draws by raycast.cpp or d2vr.cpp, converts pixels to values and 8 bits.
// Called by the render, run and bench commands.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <span>
#include <thread>
#include <tuple>

#include "host/render/d2vr.hpp"
#include "host/render/paged_frame.hpp"
#include "host/render/raycast.hpp"
#include "host/render/check_render_options.hpp"
#include "vdvr/error.hpp"
#include "vdvr/raycast.hpp"
#include "vdvr/render_crew.hpp"

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

// Depths from white, nearest, to dark grey; normals with 0 as middle grey; nothing black.
Image shown(const FloatImage& values) {
  Image image{values.width, values.height,
              std::vector<std::uint8_t>(static_cast<std::size_t>(3 * values.width * values.height))};
  float lo = std::numeric_limits<float>::infinity(), hi = -lo;
  for (const float x : values.values) {
    if (!std::isfinite(x)) continue;
    lo = std::min(lo, x);
    hi = std::max(hi, x);
  }
  const float scale = hi > lo ? 0.85f / (hi - lo) : 0.0f;
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = to_byte(values.channels == 3 ? 0.5f + 0.5f * values.values[i]
                                                : 1.0f - (values.values[i / 3] - lo) * scale);
  return image;
}

// Values and picture.
void convert(Pixels pixels, const RenderOptions& o, RenderResult& r) {
  r.values = values_of(pixels, o);
  r.image = o.output == RenderOutput::colour ? coloured(pixels, o) : shown(r.values);
}

}  // namespace

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
  // Converted where they lie: a copy of them would be a tenth of a fast frame.
  frame.picture().read_mapped([&](Pixels pixels) {
    r.seconds = enqueued.seconds();
    convert(pixels, options, r);
  });
  r.samples = frame.samples();
  return r;
}

// --- several devices ---

struct RenderCrew::Impl {
  struct Part {
    Device* device;
    const ResidentVolume* volume;
    const PagedVolume* paged;
    Frame frame;
  };
  std::vector<Part> members;
};

RenderCrew::RenderCrew(const std::vector<Member>& members) : impl_(new Impl) {
  if (members.empty()) throw InputError("a crew of renderers without a device");
  for (const Member& m : members) {
    if (!m.device || (m.volume == nullptr) == (m.paged == nullptr))
      throw InputError("each device of a crew of renderers has one volume, whole or by bricks");
    Frame frame(m.volume ? drawn_field(*m.volume) : drawn_field(*m.paged));
    impl_->members.push_back({m.device, m.volume, m.paged, std::move(frame)});
  }
}
RenderCrew::~RenderCrew() = default;
RenderCrew::RenderCrew(RenderCrew&&) noexcept = default;
RenderCrew& RenderCrew::operator=(RenderCrew&&) noexcept = default;

void RenderCrew::set_bounds(const std::vector<float>& bounds) {
  for (auto& m : impl_->members) m.frame.set_bounds(bounds);
}

namespace {

// Rows that one device takes at a time: some for each, so that they end together.
std::int64_t rows_together(std::int64_t height, std::size_t devices) {
  constexpr std::int64_t step = 16, turns = 4;
  const std::int64_t share = height / (turns * static_cast<std::int64_t>(devices));
  return std::max(step, (share + step - 1) / step * step);
}

}  // namespace

RenderResult RenderCrew::render(const RenderOptions& asked) {
  check_options(asked);
  auto& members = impl_->members;
  const auto start = std::chrono::steady_clock::now();
  // `automatic` is settled once: devices that measure or hold something else would draw another picture.
  RenderOptions o = asked;
  RenderResult r;
  const auto& first = members.front();
  std::tie(o.sampler, r.sampler_reason) = first.volume
                                              ? choose_sampler(*first.device, *first.volume, asked.sampler)
                                              : choose_sampler(asked.sampler);
  o.gradient = choose_gradient(o, o.sampler, std::all_of(members.begin(), members.end(), [](const auto& m) {
                                 return m.volume ? m.volume->impl().lit_fits() : stored_would_fit(*m.paged);
                               }));
  r.sampler = o.sampler;
  r.gradient = o.gradient;
  std::vector<cl_float4> pixels(static_cast<std::size_t>(o.width * o.height));
  const std::int64_t step = rows_together(o.height, members.size());
  std::atomic<std::int64_t> next{0}, samples{0};
  std::atomic<bool> stop{false};
  std::exception_ptr failure;
  std::mutex failure_lock;
  const auto work = [&](Impl::Part& m) {
    try {
      for (std::int64_t y = next.fetch_add(step); y < o.height && !stop; y = next.fetch_add(step)) {
        const Rows rows{y, std::min(y + step, o.height)};
        if (m.volume) enqueue_frame(m.frame, *m.device, *m.volume, o, {}, rows);
        else enqueue_frame(m.frame, *m.device, *m.paged, o, {}, rows);
        m.frame.picture().read(std::span(pixels).subspan(static_cast<std::size_t>(y * o.width),
                                                         static_cast<std::size_t>((rows.end - y) * o.width)),
                               static_cast<std::uint64_t>(y * o.width));
        samples += m.frame.samples();
      }
    } catch (...) {
      const std::lock_guard guard(failure_lock);
      if (!failure) failure = std::current_exception();
      stop = true;
    }
  };
  {
    std::vector<std::jthread> others;
    for (std::size_t i = 1; i < members.size(); ++i)
      others.emplace_back([&work, &members, i] { work(members[i]); });
    work(members.front());
  }
  if (failure) std::rethrow_exception(failure);
  r.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  r.samples = samples;
  convert(pixels, o, r);
  return r;
}

RenderResult raycast(Device& device, const ResidentVolume& volume, const RenderOptions& options) {
  return Renderer(device, volume).render(options);
}

RenderResult raycast(Device& device, const D2vrScene& scene, const RenderOptions& options) {
  return Renderer(device, scene).render(options);
}

}  // namespace vdvr
