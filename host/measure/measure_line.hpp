// A line through V, piece by piece, and what is certain of F on it.
#pragma once

#include "host/measure/measured_field.hpp"
#include "vdvr/expert/measure_line.hpp"

namespace vdvr::measured {

LineMeasure measure_line(const Field& field, const Vec3& p, const Vec3& q, const LineOptions& options);

}  // namespace vdvr::measured
