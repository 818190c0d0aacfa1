// A volume on a device, for many frames.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/device.hpp"
#include "vdvr/export.hpp"
#include "vdvr/mixed_volume.hpp"

namespace vdvr {

struct ImageLimits;  // host/sampler/resident_volume.hpp

/// A volume on a device, uploaded once for many frames: sample buffer, brick records, brick min/max, and the
/// image3d atlas where the device has one that fits (built when a frame first needs it). Must not outlive the
/// device. Throws ResourceError (memory) and InputError (sizes that do not match, an axis beyond 8192 cells).
class VDVR_API ResidentVolume {
 public:
  ResidentVolume(Device& device, const MixedVolume& volume);
  /// With other limits of the atlas than the device's own.
  ResidentVolume(Device& device, const MixedVolume& volume, const ImageLimits& limits);
  ~ResidentVolume();
  ResidentVolume(ResidentVolume&&) noexcept;
  ResidentVolume& operator=(ResidentVolume&&) noexcept;

  [[nodiscard]] bool has_image3d() const;
  [[nodiscard]] std::string image3d_reason() const;  ///< why not, or the atlas' size
  [[nodiscard]] std::uint64_t bytes() const;
  [[nodiscard]] std::pair<float, float> value_range() const;
  [[nodiscard]] const Grid& grid() const;
  /// [bz][by][bx] what the field errs by at most in each brick, infinite where nothing is known
  /// (certificate.hpp, brick_bounds): what RenderOutput::error looks up. Throws InputError for another count.
  void set_bounds(const std::vector<float>& bounds);

  struct Impl;
  [[nodiscard]] Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdvr
