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

RenderResult HeldVolume::render(const std::shared_ptr<Device>& device, const RenderOptions& options,
                                BrickQuantity quantity) {
  const std::lock_guard guard(lock_);
  if (device_ != device) {
    renderer_.reset();
    resident_.reset();
    safe_.clear();
    device_ = device;
  }
  auto safe = safe_.find(options.sampler);
  if (safe == safe_.end())
    safe = safe_
               .emplace(options.sampler, safe_sampler(*device_, file_.volume, certificate(), options.sampler,
                                                      !file_.altered.empty()))
               .first;
  RenderOptions drawn = options;
  drawn.sampler = safe->second.sampler;
  if (!resident_) resident_.emplace(*device_, file_.volume);
  if (!renderer_) {
    renderer_.emplace(*device_, *resident_);
    bounds_of_.reset();
  }
  if (options.output == RenderOutput::error) {
    const std::pair wanted{renderer_->sampler(drawn.sampler), quantity};
    if (bounds_of_ != wanted)
      renderer_->set_bounds(brick_values(file_.volume, safe->second.certificate.value_or(file_.certificate),
                                         wanted.first == SamplerKind::image3d, quantity)
                                .values);
    bounds_of_ = wanted;
  }
  return renderer_->render(drawn);
}

void HeldVolume::release() {
  const std::lock_guard guard(lock_);
  renderer_.reset();
  resident_.reset();
  device_.reset();
}

}  // namespace vdvr::python
