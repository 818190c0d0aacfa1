#include "apps/vdvr/sampler_json.hpp"

#include <nlohmann/json.hpp>

#include "vdvr/certified_picture.hpp"

namespace vdvr::cli {

Json sampler_term_json(const Certificate& certificate, bool image3d) {
  const auto charged = charged_sampler(certificate, image3d);
  if (!charged) return nullptr;
  return {{"sampler", charged->sampler}, {"value", charged->value}, {"method", charged->method}};
}

}  // namespace vdvr::cli
