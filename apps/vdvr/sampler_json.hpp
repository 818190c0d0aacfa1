// What is charged for the sampler that a picture was drawn with.
#pragma once

#include "apps/common/common_options.hpp"
#include "vdvr/expert/certificate.hpp"

namespace vdvr::cli {

/// Its name `sampler`, `value` and `method`; null where the certificate has none. The texture unit's is each
/// brick's own: the largest of them.
Json sampler_term_json(const Certificate& certificate, bool image3d);

}  // namespace vdvr::cli
