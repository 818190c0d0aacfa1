// Several devices that draw one volume together.
#pragma once

#include <memory>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/paged_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// A Renderer (raycast.hpp) over several devices, or over one whose volume comes by bricks. Each device has
/// the volume. With several a picture is cut into bands of rows, which go to whichever device is free, and is
/// that of one device, to the bit, where the devices are of one kind. What `automatic` stands for the first
/// of them decides.
///
/// Used by one thread at a time; has one thread for each further device while it draws. Must not outlive
/// devices and volumes.
class VDVR_API RenderCrew {
 public:
  struct Member {
    Device* device = nullptr;
    const ResidentVolume* volume = nullptr;  ///< or
    const PagedVolume* paged = nullptr;
  };
  /// Throws InputError where a member has no device, or not one volume.
  explicit RenderCrew(const std::vector<Member>& members);
  ~RenderCrew();
  RenderCrew(RenderCrew&&) noexcept;
  RenderCrew& operator=(RenderCrew&&) noexcept;

  /// As Renderer::render; `seconds` are those of all devices together. `progress` is told of what is drawn,
  /// one device at a time. Throws Interrupted too.
  RenderResult render(const RenderOptions& options, const Progress& progress = {});
  void set_bounds(const std::vector<float>& bounds);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdvr
