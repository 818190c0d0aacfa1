// What weights of a cell's corners that are not the trilinear ones do to a value, for any samples
// (docs/error-bounds.md, section on samplers).
#pragma once

#include <array>

namespace vdvr {

/// Of one cell; bit a of a corner's number is its place on axis a.
using Corners = std::array<double, 8>;
/// By the steps of samples along the axes: 1 on those whose bit is set in the index, 1/2 on the others. [0]:
/// 0.
using BySteps = std::array<double, 8>;

Corners trilinear_weights(const std::array<double, 3>& fraction);
/// The sum of the three steps.
double sum_of_steps(std::size_t steps);

/// Raises `largest` to the most that a value can err by where weights err by `off`, which sum to 0, and
/// samples differ by at most those steps along each edge of the cell. NaN becomes infinite.
void raise_to_error(BySteps& largest, const Corners& off);

}  // namespace vdvr
