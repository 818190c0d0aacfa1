// The paper's curvature bounds as the paper computes them: derivatives in frequency space, their maxima taken
// at the samples. They can lie below the truth (docs/error-bounds.md), so they are printed and never decide.
#pragma once

#include <vector>

#include "host/field/fbp/filter_projections.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// Eq. 7 at each rate: bilinear interpolation in u and v, summed over the views. Cost: 10 * views * rows *
/// columns * max(rows, columns) multiply-adds on the device. Of every `step`-th view, times all views over
/// those: an estimate where it is not 1.
std::vector<Bound> paper_projection_bounds(opencl::State& state, const FilteredScan& scan,
                                           const std::vector<int>& rates, std::int64_t step = 1);

/// Eq. 9 at each rate, from the 1x volume cut out of the field: the derivatives of another function than F.
/// Cost: 18 * samples * samples per axis.
std::vector<Bound> paper_gold_bounds(opencl::State& state, const Volume& base, const std::vector<int>& rates);

}  // namespace vdvr
