// The volume of the points where F is in a range: docs/measure.md, "Sure and possible".
#pragma once

#include "host/measure/measured_field.hpp"

namespace vdvr::measured {

/// Thresholds of V: F is surely in the range where V is in the inner one, and possibly where it is in the
/// outer one. An inner range may be empty. Rounded outward.
struct Thresholds {
  double inner_least = 0, inner_largest = 0, outer_least = 0, outer_largest = 0;
};
Thresholds thresholds_of(const ValueRange& range, double bound);
/// Throws InputError for a range that is empty or not finite.
void require_range(const ValueRange& range);

/// Of a box: the shares where V is in the inner, and in the outer range.
struct RangeShares {
  Interval sure{0, 0}, possible{0, 0};
};
RangeShares shares_in(const AffineForm& form, const Thresholds& t);

VolumeMeasure measure_volume(const Field& field, const ValueRange& range, const MeasureOptions& options,
                             const Progress& progress);
/// What one part adds: volumes of its sure and its possible points, without halving it.
Interval volume_of_part(const MeasuredRegion& region, const Part& part, bool whole, const Thresholds& t);

}  // namespace vdvr::measured
