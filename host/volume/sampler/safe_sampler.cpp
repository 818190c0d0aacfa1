#include "vdvr/expert/safe_sampler.hpp"

#include <fmt/format.h>

#include "host/volume/sampler/sampler_terms.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

void forget_image3d(Certificate& c) {
  c.budget.sampler.image3d.reset();
  c.budget.sampler.image3d_by_brick.clear();
  c.total_image3d.reset();
  c.holds_image3d.reset();
}

bool may_draw_image3d(Device& device, SamplerKind asked) {
  if (asked != SamplerKind::automatic) return asked == SamplerKind::image3d;
  return device.info().linear_float_image && probe_sampler(device).chosen == "image3d";
}

std::string why_not(const Device& device, const Certificate& here) {
  const double share = here.budget.sampler.image3d->value;
  if (*here.total_image3d <= here.epsilon_abs)
    return fmt::format(
        "the texture unit of '{}' may err by {:.3g}, with which a brick's bound is {:.4g} of its sigma",
        device.info().name, share, worst_in_sigma(here, true));
  return fmt::format(
      "the texture unit of '{}' may err by {:.3g}, with which the total {:.4g} exceeds epsilon {:.4g}",
      device.info().name, share, *here.total_image3d, here.epsilon_abs);
}

}  // namespace

Certificate certificate_on(Device& device, const MixedVolume& volume, const Certificate& stored) {
  const DeviceInfo& info = device.info();
  SamplerTerms here =
      sampler_terms(field_slopes(volume), volume.grid, probe_filters(device), atlas_length(info, volume),
                    stored.epsilon_abs, volume.rate, sampler_underflow(info));
  Certificate c = stored;
  forget_image3d(c);
  const bool more_of_buffer = !info.subnormals && !(here.buffer.value <= c.budget.sampler.buffer.value);
  if (!more_of_buffer) here.buffer = c.budget.sampler.buffer;
  charge_samplers(c, std::move(here));
  if (more_of_buffer) c.holds_buffer = c.holds_buffer && within_tolerance(c, c.total_buffer, false);
  // Where nothing is certified of the arithmetic that is the same everywhere, nothing is of this.
  if (c.total_image3d)
    c.holds_image3d = stored.holds_buffer && !c.comparison && within_tolerance(c, *c.total_image3d, true);
  return c;
}

SafeSampler safe_sampler(Device& device, const MixedVolume& volume, const std::optional<Certificate>& stored,
                         SamplerKind asked, bool unverified) {
  SafeSampler safe{asked, "", stored};
  if (!stored) return safe;
  Certificate& here = *safe.certificate;
  const bool image3d = may_draw_image3d(device, asked);
  if (image3d || !device.info().subnormals) here = certificate_on(device, volume, *stored);
  if (!image3d) {
    forget_image3d(here);
    return safe;
  }
  // Without an atlas there is no such sampler: whoever draws says why.
  if (!here.holds_image3d || *here.holds_image3d) return safe;
  if (asked == SamplerKind::automatic) {
    safe.sampler = SamplerKind::buffer;
    safe.reason = here.comparison ? "nothing is certified of a volume for comparison" : why_not(device, here);
    forget_image3d(here);
    return safe;
  }
  if (!unverified && !here.comparison)
    throw ToleranceError("the certificate does not hold for the image3d sampler here: " +
                         why_not(device, here) + "; use `sampler` buffer");
  return safe;
}

}  // namespace vdvr
