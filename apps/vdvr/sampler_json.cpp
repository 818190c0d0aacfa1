#include "apps/vdvr/sampler_json.hpp"

#include <algorithm>

namespace vdvr::cli {

Json sampler_term_json(const Certificate& certificate, bool image3d) {
  const SamplerTerms& terms = certificate.budget.sampler;
  if (image3d && !terms.image3d) return nullptr;
  if (!image3d)
    return {{"sampler", "buffer"}, {"value", terms.buffer.value}, {"method", terms.buffer.method}};
  float largest = 0;
  for (const float term : terms.image3d_by_brick) largest = std::max(largest, term);
  return {{"sampler", "image3d"}, {"value", largest}, {"method", terms.image3d->method}};
}

}  // namespace vdvr::cli
