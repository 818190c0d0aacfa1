// Views about an axis that leans in the detector's plane, brought to rows that stand upright on it
// (docs/geometry.md, "A leaning axis").
//
// With u, v the distances of a pixel from the detector's middle, and t, z across and along the axis, all in
// world units, c and s the cosine and sine of the roll,
//
//   u = t c + z s,   v = -t s + z c:
//
// at higher rows a positive roll has the axis at higher columns. Two interpolations along lines make the
// view's row z + d, d how far the sample stood along the axis,
//
//   h(i, z) = S_v[p(i, .)] at v = (z + d) / c - u_i s / c      along each measured column i,
//   p'(t, z) = S_u[h(., z)] at u = t c + (z + d) s               along each row,
//
// S the cosine series through the samples of a line. Sums are double, p' is rounded once. There are as many
// rows as every column of every view sees, and as many columns as each of these has in every view, a whole
// number fewer on either side than the detector has.
#pragma once

#include <cstdint>
#include <filesystem>

#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Shifts by view across and along the axis, of shifts along columns and rows of the detector. In place.
void turn_shifts(ParallelGeometry& geometry);

/// In place, and recorded in geometry and report. Throws InputError where no row or fewer than two columns
/// are left, ResourceError as read_scan. Cost: views * (columns + rows) * 2 FFTs of four to eight times a
/// line.
void upright_rows(ProjectionSet& scan, std::uint64_t max_memory_bytes, const std::filesystem::path& scratch);

/// The pixel of a detector of so many rows and columns that is nearest to one of the upright rows, where the
/// sample stood in the middle: for what is known pixel by pixel. `upright` as upright_rows() left it.
std::int64_t nearest_pixel(const ParallelGeometry& upright, std::int64_t rows, std::int64_t columns,
                           std::int64_t row, std::int64_t column);

}  // namespace vdvr
