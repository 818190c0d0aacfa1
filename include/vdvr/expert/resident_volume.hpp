// A volume on a device, for many frames.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

struct ImageLimits;  // host/volume/sampler/resident_volume.hpp

/// A volume on a device, uploaded once for many frames: sample buffer, brick records, brick min/max. What
/// only some frames need is made when one first does: the image3d atlas where the device has one that fits,
/// samples with stored gradients (GradientKind::stored).
///
/// Threads: after its constructor it never changes what it says, and any number of threads may draw it at
/// once, each with a Renderer of its own (raycast.hpp); what is made on first use is made under a lock.
///
/// Must not outlive the device. Throws ResourceError (memory) and InputError (sizes that do not match, an
/// axis beyond 8192 cells).
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
  [[nodiscard]] std::uint64_t bytes() const;         ///< on the device by now
  [[nodiscard]] std::pair<float, float> value_range() const;
  [[nodiscard]] const Grid& grid() const;

  struct Impl;
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdvr
