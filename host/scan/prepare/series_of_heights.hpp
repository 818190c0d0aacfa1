// Views that saw the sample at other heights, put together into a scan of all heights that are seen from
// every direction (docs/geometry.md, "Series of heights"): stands of a sample that is taller than the
// detector, or a helix of parallel beam.
//
// With the weights W_k and w of weights_by_height.hpp, row n of a view that the series becomes is
//
//   p'(n) = sum over its measured views k of (W_k(n) / w) S_v[p_k](n - d_0 + d_k),
//
// S_v the cosine series through the measured view's rows; a row that is hit (to 1e-9 of a row) is taken as it
// is. Heights are those of the first view's rows, and others a whole number of rows away. Sums are taken in
// double and rounded once. What is filtered, planned and certified is an ordinary scan of these rows, whose
// middle is z = 0.
#pragma once

#include <cstdint>
#include <filesystem>

#include "host/scan/geometry/weights_by_height.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// How the views of shifted rows were measured.
HeightSeries series_of(const ParallelGeometry& geometry, bool full_turn);

/// In place, and recorded in geometry and report. Views of one direction become one unless some moved along
/// columns, which is refused. Throws InputError where no height is covered, or where heights between others
/// are not; ResourceError as read_scan. Cost: measured views * columns * rows^2 multiply-adds, rows * columns
/// where shifts are whole rows.
void series_of_heights(ProjectionSet& scan, const HeightSeries& series, const WeightsByHeight& weights,
                       std::uint64_t max_memory_bytes, const std::filesystem::path& scratch);

}  // namespace vdvr
