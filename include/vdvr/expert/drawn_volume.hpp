// A volume where it is drawn: on one device or several, whole or by bricks.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certify_picture.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/paged_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// Draws and certifies pictures of one volume. It lies whole on every device where the first has room for it
/// (fits()), else it is brought there by bricks. Pictures are those of one device, to the bit.
///
/// Used by one thread at a time. Must not outlive devices and volume.
class VDVR_API DrawnVolume {
 public:
  /// `progress` hears of the passes over the samples. Throws InputError where the devices are not of one
  /// kind, or none; else as ResidentVolume and PagedVolume.
  DrawnVolume(const std::vector<Device*>& devices, const MixedVolume& volume, const Progress& progress = {});
  ~DrawnVolume();
  DrawnVolume(const DrawnVolume&) = delete;
  DrawnVolume& operator=(const DrawnVolume&) = delete;

  /// `progress` hears of pictures by several devices, or by bricks. Throws as Renderer::render.
  [[nodiscard]] RenderResult draw(const RenderOptions& options, const Progress& progress = {});
  /// Intervals of the pixels that draw() gives; `bounds` as of certify_pixels(), which it throws as.
  [[nodiscard]] PixelBounds certify(const std::vector<float>& bounds, const RenderOptions& options,
                                    const CertifyPictureOptions& certify = {},
                                    const Progress& progress = {}) const;
  /// What pictures with this choice take: by bricks the buffer, unless image3d is asked for, which draw()
  /// then refuses. Throws ResourceError for an image3d that the device has not.
  [[nodiscard]] SamplerKind sampler(SamplerKind asked) const;
  /// As of Renderer::set_bounds().
  void set_bounds(const std::vector<float>& bounds);

  [[nodiscard]] const std::vector<Device*>& devices() const;
  [[nodiscard]] const MixedVolume& volume() const;
  [[nodiscard]] std::pair<float, float> value_range() const;
  [[nodiscard]] bool by_bricks() const;
  /// On the first device beside what a frame needs; by bricks the most so far.
  [[nodiscard]] std::uint64_t bytes() const;
  [[nodiscard]] std::optional<PagingCounts> paging() const;  ///< by bricks

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdvr
