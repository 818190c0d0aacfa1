// Rows of a series of heights by means of verify's own (docs/geometry.md, "Series of heights"). Deviation
// from series_of_heights.cpp and weights_by_height.cpp on purpose: those take views away one by one and
// change the weights of their neighbours, this weighs the views of each share anew, in long double, and has
// each row by the barycentric formula.
#pragma once

#include "host/verify/witness/rows_room.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// In place; `scan` is as it was measured, with its shifts. `full_turn`: of half acquisition. Throws
/// InputError where no height is covered.
void to_all_heights(ProjectionSet& scan, bool full_turn, const RowsRoom& room);

}  // namespace vdvr
