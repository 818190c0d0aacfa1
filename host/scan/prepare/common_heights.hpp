// Views that saw the sample at other heights, brought to those that all of them see (docs/geometry.md,
// "Shifts by view").
//
// With d_k the shifts along rows less the middle of the least and the largest, V rows measured and D the
// range of d_k, there are V' = floor(V - D) common heights, and the row j of view k becomes
//
//   p'_k(j) = S_v[p_k]((V - V') / 2 + j + d_k),
//
// S_v the cosine series through the view's rows. Sums are taken in double precision and rounded once; a row
// that is hit (to 1e-9 of a row) stays as it is. What is filtered, planned and certified is an ordinary scan
// of these rows, whose middle is z = 0.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// V', 0 where views share no height.
std::int64_t count_of_common_heights(const ParallelGeometry& geometry);

/// In place, and recorded in geometry and report, of shifted rows. Throws InputError where views share no
/// height, ResourceError as read_scan. Cost: views * columns * rows^2 multiply-adds.
void common_heights(ProjectionSet& scan, std::uint64_t max_memory_bytes,
                    const std::filesystem::path& scratch);

/// S_v: what each of so many rows weighs at a place among them.
std::vector<double> row_weights_at(std::int64_t rows, double place);

}  // namespace vdvr
