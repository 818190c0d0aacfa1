// What interpolation can do to the waves of a scan: the spectrum of one filtered projection or of a volume,
// times the map of worst errors (docs/error-bounds.md, section 3). Comparison only, it decides nothing.
#pragma once

#include <cstdint>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/error_map.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Ramp-filtered, times the view's weight: its share of F.
struct FilteredView {
  std::int64_t view = 0, columns = 0, rows = 0;
  std::vector<float> samples;  ///< [v][u]
  double largest = 0;          ///< max |q|
};

/// The view with the most energy, the first of several. Cost: the ramp filter of the whole scan.
VDVR_API FilteredView strongest_view(Device& device, const ProjectionSet& scan, const FieldOptions& field,
                                     const Progress& progress = {});

/// The frequencies of cosine coefficients 0 .. n - 1 of n samples, in radians per sample.
VDVR_API FrequencyAxis cosine_axis(std::int64_t n);

/// The sum over all coefficients A of |A| times the proved error of a wave (wave_error_bound) at spacing d /
/// rate. `spectrum`: cosine coefficients [z][y][x] under half-sample mirror extension. Cost: one map entry on
/// the device per coefficient, in slabs.
VDVR_API double amplitude_sum(Device& device, const std::vector<float>& spectrum, const Index3& size,
                              int rate);

}  // namespace vdvr
