// Bounds by the amplitudes of the projections' waves (docs/error-bounds.md).
#pragma once

#include <utility>
#include <vector>

#include "host/field/fbp/filter_projections.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// Sum of |A| e over the spectrum of the mirror extension, e the proved worst error of a
/// wave (error_map.hpp), for interpolation in u at each rate and for gold at each rate. Cost: views * rows *
/// columns per rate, on the host, of every `step`-th view as for field_sups.
struct AmplitudeBounds {
  std::vector<std::pair<int, double>> projection, gold;
};
AmplitudeBounds amplitude_bounds(const FilteredScan& scan, const Grid& grid, const std::vector<int>& rates,
                                 std::int64_t step = 1);

}  // namespace vdvr
