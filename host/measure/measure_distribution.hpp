// The distribution of F: volumes of {F >= edge}, all edges in one pass.
#pragma once

#include "host/measure/measured_field.hpp"

namespace vdvr::measured {

Distribution measure_distribution(const Field& field, const std::vector<double>& edges,
                                  const Progress& progress);

}  // namespace vdvr::measured
