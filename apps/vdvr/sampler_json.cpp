#include "apps/vdvr/sampler_json.hpp"

namespace vdvr::cli {

Json sampler_term_json(const Certificate& certificate, bool image3d) {
  const SamplerTerms& terms = certificate.budget.sampler;
  if (image3d && !terms.image3d) return nullptr;
  const ErrorTerm& term = image3d ? *terms.image3d : terms.buffer;
  return {{"sampler", image3d ? "image3d" : "buffer"}, {"value", term.value}, {"method", term.method}};
}

}  // namespace vdvr::cli
