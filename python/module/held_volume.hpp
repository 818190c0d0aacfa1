// A certified volume as Python holds it: the file's contents, and what pictures of it keep on a device.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "vdvr/automatic_view.hpp"
#include "vdvr/certified_picture.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certified_points.hpp"
#include "vdvr/expert/drawn_volume.hpp"
#include "vdvr/expert/error_slice.hpp"
#include "vdvr/expert/safe_sampler.hpp"
#include "vdvr/raycast.hpp"
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
  /// A picture and what is certain of it, by the same sampler. Throws InputError for a file that was altered;
  /// else as certify_picture.
  CertifiedPicture certified(const std::shared_ptr<Device>& device, const PictureRequest& request,
                             const Progress& progress);
  /// None of a comparison, which certifies nothing.
  [[nodiscard]] std::optional<Certificate> certificate() const;
  /// Gives back what pictures keep on the device.
  void release();

 private:
  /// Where pictures are drawn from now on.
  DrawnVolume& drawn_on(const std::shared_ptr<Device>& device);
  /// Of what is drawn.
  const SafeSampler& safe(SamplerKind asked);

  VdvrFile file_;
  std::mutex lock_;
  std::optional<Brightness> brightness_;
  std::optional<CertifiedPoints> points_;
  std::shared_ptr<Device> device_;
  std::optional<DrawnVolume> drawn_;
  std::map<SamplerKind, SafeSampler> safe_;                         // by what was asked for, on the device
  std::optional<std::pair<SamplerKind, BrickQuantity>> bounds_of_;  // as drawn_ has them
};

}  // namespace vdvr::python
