// A certified volume as Python holds it: the file's contents, and what pictures of it keep on a device.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "vdvr/automatic_view.hpp"
#include "vdvr/certified_points.hpp"
#include "vdvr/device.hpp"
#include "vdvr/error_slice.hpp"
#include "vdvr/raycast.hpp"
#include "vdvr/resident_volume.hpp"
#include "vdvr/safe_sampler.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr::python {

class HeldVolume {
 public:
  explicit HeldVolume(VdvrFile file) : file_(std::move(file)) {}

  [[nodiscard]] const VdvrFile& file() const { return file_; }
  /// Made once.
  const Brightness& brightness();
  const CertifiedPoints& points();
  /// One picture, with the sampler asked for or, of `automatic`, one for which the certificate holds on this
  /// device; threads take turns. Throws as safe_sampler and Renderer::render.
  /// `quantity`: what RenderOutput::error shows.
  RenderResult render(const std::shared_ptr<Device>& device, const RenderOptions& options,
                      BrickQuantity quantity);
  /// None of a comparison, which certifies nothing.
  [[nodiscard]] std::optional<Certificate> certificate() const;
  /// Gives back what pictures keep on the device.
  void release();

 private:
  VdvrFile file_;
  std::mutex lock_;
  std::optional<Brightness> brightness_;
  std::optional<CertifiedPoints> points_;
  std::shared_ptr<Device> device_;
  std::optional<ResidentVolume> resident_;  // before the renderer, which uses it
  std::optional<Renderer> renderer_;
  std::map<SamplerKind, SafeSampler> safe_;                         // by what was asked for, on the device
  std::optional<std::pair<SamplerKind, BrickQuantity>> bounds_of_;  // that the renderer has
};

}  // namespace vdvr::python
