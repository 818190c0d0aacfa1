// Frames of views.
#include "vdvr/expert/live_renderer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "vdvr/error.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/expert/live_events.hpp"
#include "vdvr/expert/resident_volume.hpp"
#include "vdvr/expert/safe_sampler.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t kLeastSide = 32;
constexpr int kCoarsest = 16;  // quarter octaves of the side: a sixteenth

/// Each pixel the mean of both pictures where `known` says something. `colours` may be higher than `image`.
void mix(Image& image, const Image& colours, const FloatImage& known) {
  for (std::size_t i = 0; i < known.values.size(); ++i) {
    if (std::isnan(known.values[i])) continue;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
      image.rgb[c] = static_cast<std::uint8_t>((image.rgb[c] + colours.rgb[c] + 1) / 2);
  }
}

}  // namespace

// --- pace ---

void FramePace::observe(std::int64_t pixels, double seconds) {
  if (pixels < 1 || !(seconds > 0)) return;
  const double now = seconds / static_cast<double>(pixels);
  // What got slower is followed at once, so that the hand is; what got faster, with care.
  seconds_per_pixel_ = seconds_per_pixel_ == 0    ? now
                       : now > seconds_per_pixel_ ? (now + seconds_per_pixel_) / 2
                                                  : 0.8 * seconds_per_pixel_ + 0.2 * now;
}

std::pair<std::int64_t, std::int64_t> FramePace::size(std::int64_t width, std::int64_t height) const {
  int coarseness = 8;
  if (seconds_per_pixel_ > 0) {
    const double pixels = static_cast<double>(width) * static_cast<double>(height);
    // A side shrinks by 2^(1/4) a step, so pixels by its square.
    const double steps = 2 * std::log2(pixels * seconds_per_pixel_ / budget_);
    coarseness = std::clamp(static_cast<int>(std::ceil(std::clamp(steps, -1.0, 1e3))), 0, kCoarsest);
  }
  if (coarseness == 0) return {width, height};
  const double scale = std::exp2(-coarseness / 4.0);
  const auto side = [&](std::int64_t whole) {
    return std::max(std::min(whole, kLeastSide),
                    static_cast<std::int64_t>(std::lround(scale * static_cast<double>(whole))));
  };
  return {side(width), side(height)};
}

// --- frames ---

struct LiveRenderer::Impl {
  /// What a frame's time depends on most, and what has kernels of its own: mode, light, bound.
  struct Kind {
    FramePace pace;
    int seen = 0;
  };

  const MixedVolume* volume;
  std::optional<Certificate> certificate;  ///< as it holds on the device
  ResidentVolume resident;
  Renderer renderer;
  LiveScene scene;
  std::vector<Kind> kinds;
  bool bounds_set = false;

  Impl(Device& device, const MixedVolume& v, const std::optional<Certificate>& c, double budget)
      : volume(&v),
        resident(device, v),
        renderer(device, resident),
        scene(live_scene(v, c)),
        kinds(20, Kind{FramePace(budget), 0}) {
    SafeSampler safe = safe_sampler(device, v, c);
    scene.sampler = safe.sampler;
    certificate = std::move(safe.certificate);
  }

  Kind& kind_of(const LiveView& v) {
    return kinds[4 * static_cast<std::size_t>(v.mode) + (v.shading ? 2 : 0) + (v.bound ? 1 : 0)];
  }
  [[nodiscard]] bool image3d() const { return renderer.sampler(scene.sampler) == SamplerKind::image3d; }

  ErrorSlice bounds_of_slice(const LiveView& v, std::int64_t width, std::int64_t height, bool framed) const {
    return bound_slice(*volume, *certificate, image3d(),
                       {v.slice_axis, v.slice_position, width, height, framed});
  }

  /// Mode error is the picture with its frame, as `render --mode error` draws it.
  Image picture(const LiveView& v, std::int64_t width, std::int64_t height, bool moving) {
    if (v.mode == RenderMode::error) return bounds_of_slice(v, width, height, true).image;
    RenderOptions o = options_of(v, scene, width, height);
    // What steep transfer functions draw between even steps is gone when the picture rests.
    if (moving) o.step_mode = StepMode::fixed;
    Image image = renderer.render(o).image;
    if (!v.bound) return image;
    if (v.is_flat()) {
      const ErrorSlice bounds = bounds_of_slice(v, width, height, false);
      mix(image, bounds.image, bounds.errors);
      return image;
    }
    if (!bounds_set) renderer.set_bounds(brick_bounds(*certificate, image3d()));
    bounds_set = true;
    o.output = RenderOutput::error;
    const FloatImage bounds = renderer.render(o).values;
    mix(image, bound_picture(bounds, scene.epsilon_abs), bounds);
    return image;
  }
};

LiveRenderer::LiveRenderer(Device& device, const MixedVolume& volume,
                           const std::optional<Certificate>& certificate, double budget)
    : impl_(new Impl(device, volume, certificate, budget)) {}
LiveRenderer::~LiveRenderer() = default;
LiveRenderer::LiveRenderer(LiveRenderer&&) noexcept = default;
LiveRenderer& LiveRenderer::operator=(LiveRenderer&&) noexcept = default;

const LiveScene& LiveRenderer::scene() const { return impl_->scene; }

LiveFrame LiveRenderer::draw(const LiveView& view, std::int64_t width, std::int64_t height, bool moving) {
  check_view(view, impl_->scene);
  if (width < 1 || height < 1 || width > kMostLivePixels || height > kMostLivePixels)
    throw InputError(
        fmt::format("`size` {}x{}: each side must be 1 to {} pixels", width, height, kMostLivePixels));
  Impl::Kind& kind = impl_->kind_of(view);
  std::pair<std::int64_t, std::int64_t> size{width, height};
  // A bound's slice is looked up on the host in no time, and its frame needs its size.
  if (moving && view.mode != RenderMode::error) size = kind.pace.size(width, height);
  const auto start = std::chrono::steady_clock::now();
  LiveFrame frame;
  frame.image = impl_->picture(view, size.first, size.second, moving);
  frame.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  frame.full = !moving && size.first == width && size.second == height;
  // Of a still frame steps are others, and so is its pace.
  if (moving && kind.seen++ > 0) kind.pace.observe(size.first * size.second, frame.seconds);
  return frame;
}

}  // namespace vdvr
