#include "held_volume.hpp"

namespace vdvr::python {

const Brightness& HeldVolume::brightness() {
  const std::lock_guard guard(lock_);
  if (!brightness_) brightness_ = brightness_of(file_.volume);
  return *brightness_;
}

const CertifiedPoints& HeldVolume::points() {
  const std::lock_guard guard(lock_);
  if (!points_) points_.emplace(file_.volume, file_.certificate);
  return *points_;
}

std::optional<Certificate> HeldVolume::certificate() const {
  return file_.certificate.comparison ? std::nullopt : std::optional(file_.certificate);
}

RenderResult HeldVolume::render(const std::shared_ptr<Device>& device, const RenderOptions& options) {
  const std::lock_guard guard(lock_);
  if (device_ != device) {
    renderer_.reset();
    resident_.reset();
    device_ = device;
  }
  if (!resident_) resident_.emplace(*device_, file_.volume);
  if (!renderer_) {
    renderer_.emplace(*device_, *resident_);
    has_bounds_ = false;
  }
  if (options.output == RenderOutput::error && !has_bounds_) {
    renderer_->set_bounds(
        brick_bounds(file_.certificate, renderer_->sampler(options.sampler) == SamplerKind::image3d));
    has_bounds_ = true;
  }
  return renderer_->render(options);
}

void HeldVolume::release() {
  const std::lock_guard guard(lock_);
  renderer_.reset();
  resident_.reset();
  device_.reset();
}

}  // namespace vdvr::python
