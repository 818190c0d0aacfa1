// The mean and the integral of F, and its extremes.
#pragma once

#include "host/measure/measured_field.hpp"

namespace vdvr::measured {

MeanMeasure measure_mean(const Field& field, const Progress& progress);
ExtremesMeasure measure_extremes(const Field& field, const Progress& progress);

}  // namespace vdvr::measured
