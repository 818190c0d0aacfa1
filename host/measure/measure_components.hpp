// Components of what is in a range, layer of bricks by layer, so that no more than two layers are held.
#pragma once

#include "host/measure/measured_field.hpp"
#include "vdvr/expert/components.hpp"

namespace vdvr::measured {

ComponentTable measure_components(const Field& field, const ValueRange& range,
                                  const ComponentsOptions& options, const Progress& progress);

}  // namespace vdvr::measured
