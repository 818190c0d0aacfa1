// Frames of views: coarse ones that keep up with the hand, full ones at rest.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/live_view.hpp"

namespace vdvr {

struct LiveFrame {
  Image image;
  bool full = false;   ///< at rest: nothing finer is to come
  double seconds = 0;  ///< that it took, first use of a kernel included
};

/// How coarse a frame must be. Sizes go by quarter powers of two, so that they stand still while measured
/// times waver.
class VDVR_API FramePace {
 public:
  /// `budget`: seconds that a coarse frame may take.
  explicit FramePace(double budget) : budget_(budget) {}
  /// Counts a frame's time. The first frame of a kind, which may build a kernel, is not to be told.
  void observe(std::int64_t pixels, double seconds);
  /// The largest size of this shape that is expected to keep the budget; before anything was measured a
  /// quarter of each side. Never below 32 pixels a side, unless the size asked for is.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> size(std::int64_t width, std::int64_t height) const;

 private:
  double budget_, seconds_per_pixel_ = 0;
};

/// Draws views of one volume, for one thread. Must not outlive device, volume and certificate.
class VDVR_API LiveRenderer {
 public:
  /// Two thirds of a thirtieth of a second: the rest is for whoever encodes and shows the frame.
  static constexpr double kBudget = 2.0 / 90;
  /// Uploads the volume. Throws as ResidentVolume.
  LiveRenderer(Device& device, const MixedVolume& volume, const std::optional<Certificate>& certificate = {},
               double budget = kBudget);
  ~LiveRenderer();
  LiveRenderer(LiveRenderer&&) noexcept;
  LiveRenderer& operator=(LiveRenderer&&) noexcept;

  [[nodiscard]] const LiveScene& scene() const;
  /// One frame. Moving: as many pixels of the shape width x height as measured times allow within the budget.
  /// At rest: all of them, and but for the bound's colours the picture that `vdvr render` draws (options_of),
  /// to the bit. With the bound's colours each pixel is the mean of that picture and of bound_picture() or
  /// bound_slice() of the same view. Throws InputError (check_view, sides of 1 to kMostLivePixels) and as
  /// Renderer::render.
  LiveFrame draw(const LiveView& view, std::int64_t width, std::int64_t height, bool moving);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdvr
