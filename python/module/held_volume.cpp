#include "held_volume.hpp"

#include "vdvr/error.hpp"

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

DrawnVolume& HeldVolume::drawn_on(const std::shared_ptr<Device>& device) {
  if (device_ != device) {
    drawn_.reset();
    safe_.clear();
    device_ = device;
  }
  if (!drawn_) {
    drawn_.emplace(std::vector<Device*>{device_.get()}, file_.volume);
    bounds_of_.reset();
  }
  return *drawn_;
}

const SafeSampler& HeldVolume::safe(SamplerKind asked) {
  auto found = safe_.find(asked);
  if (found == safe_.end()) {
    const SamplerKind here = drawn_->by_bricks() ? drawn_->sampler(asked) : asked;
    found =
        safe_
            .emplace(asked, safe_sampler(*device_, file_.volume, certificate(), here, !file_.altered.empty()))
            .first;
  }
  return found->second;
}

RenderResult HeldVolume::render(const std::shared_ptr<Device>& device, const RenderOptions& options,
                                BrickQuantity quantity) {
  const std::lock_guard guard(lock_);
  DrawnVolume& volume = drawn_on(device);
  const SafeSampler& sampler = safe(options.sampler);
  RenderOptions drawn = options;
  drawn.sampler = sampler.sampler;
  if (options.output == RenderOutput::error) {
    const std::pair wanted{volume.sampler(drawn.sampler), quantity};
    if (bounds_of_ != wanted)
      volume.set_bounds(brick_values(file_.volume, sampler.certificate.value_or(file_.certificate),
                                     wanted.first == SamplerKind::image3d, quantity)
                            .values);
    bounds_of_ = wanted;
  }
  return volume.draw(drawn);
}

CertifiedPicture HeldVolume::certified(const std::shared_ptr<Device>& device, const PictureRequest& request,
                                       const Progress& progress) {
  if (!file_.altered.empty()) throw InputError("nothing is certain of an altered file: " + file_.altered);
  const std::lock_guard guard(lock_);
  DrawnVolume& volume = drawn_on(device);
  const SafeSampler& sampler = safe(request.options.sampler);
  PictureRequest asked = request;
  asked.options.sampler = sampler.sampler;
  return certify_picture(volume, sampler.certificate.value_or(file_.certificate), asked, progress);
}

void HeldVolume::release() {
  const std::lock_guard guard(lock_);
  drawn_.reset();
  device_.reset();
}

}  // namespace vdvr::python
