// Cells of neighbouring bricks that touch, whatever their levels.
#pragma once

#include "host/measure/label_bricks.hpp"

namespace vdvr::measured {

/// Joins parts of two bricks whose positions differ by at most 1 along each axis: possible ones where closed
/// cells touch; sure ones where bricks and cells share a face, a point of which is in the region. Cost: cells
/// on what the bricks share.
void join_bricks(const Field& field, const LabelledBrick& a, const LabelledBrick& b, UnionFind& possible,
                 UnionFind& sure);

}  // namespace vdvr::measured
