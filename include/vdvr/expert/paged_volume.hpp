// A volume larger than a device, or than a limit of memory, drawn by the bricks that rays need.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

/// What the pictures of a PagedVolume cost so far.
struct PagingCounts {
  std::uint64_t parts = 0;         ///< of pictures, drawn one after another
  std::uint64_t bricks = 0;        ///< brought to the device, each as often as it was
  std::uint64_t bytes = 0;         ///< of their samples
  std::uint64_t largest_part = 0;  ///< bytes that the bricks of one part took on the device
};

/// A volume whose base and index lie on a device, and of whose tiles those that a part of a picture needs: a
/// RenderCrew of it (render_crew.hpp) cuts each picture into parts, until the bricks that a part's rays pass
/// fit, and draws part after part. Rays know nothing of parts, so that the picture is the one of
/// ResidentVolume, to the bit.
///
/// `memory_bytes` bounds what it takes on the device and for its index on the host; 0: what the device has
/// left. `volume` must outlive it, and is where tiles come from: in scratch (read_vdvr) it needs not fit
/// memory. Construction looks at every sample once.
///
/// Threads: one Renderer at a time. Throws ResourceError where base and index alone do not fit, InputError as
/// ResidentVolume.
class VDVR_API PagedVolume {
 public:
  PagedVolume(Device& device, const MixedVolume& volume, std::uint64_t memory_bytes = 0);
  ~PagedVolume();
  PagedVolume(PagedVolume&&) noexcept;
  PagedVolume& operator=(PagedVolume&&) noexcept;

  [[nodiscard]] PagingCounts counts() const;
  [[nodiscard]] std::uint64_t memory_bytes() const;  ///< that bricks, base and index may take
  [[nodiscard]] std::pair<float, float> value_range() const;

  struct Impl;
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// Whether a device has room for all of a volume (ResidentVolume), and for what pictures need beside.
VDVR_API bool fits(const Device& device, const MixedVolume& volume);

}  // namespace vdvr
