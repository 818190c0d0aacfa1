// F itself along random rays of a picture that was certified.
#pragma once

#include <cstdint>
#include <utility>

#include "vdvr/certified_picture.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Of the light that was drawn the host knows that of central differences by the buffer sampler.
bool is_told_by_the_host(const PictureRecord& record);
/// Of random rays half go where the picture is not just the background. `value_range`: of V. Cost:
/// ExactField, and some hundred of its points a ray. Throws Interrupted.
RayCheck check_rays(const CertifiedPicture& picture, const MixedVolume& volume,
                    const std::pair<float, float>& value_range, const ProjectionSet& scan,
                    const FieldOptions& options, std::int64_t rays, const Progress& progress);

}  // namespace vdvr
