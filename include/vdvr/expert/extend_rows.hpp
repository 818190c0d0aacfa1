// Rows of a parallel scan that are made longer before the ramp filter, so that what is filtered, planned and
// certified is an ordinary scan of a wider detector (docs/geometry.md, "Half acquisition" and "Rows that go
// on").
//
// Half acquisition, a full turn about an axis off the middle: with t the distance from the axis towards the
// longer side and h that of the nearer edge, rows are p'(t) = 2 m(t) p(t), m(t) + m(-t) = 1:
//
//   m = 0 at t <= -h,   r^3 (10 - 15 r + 6 r^2), r = (1 + t / h) / 2,   1 at t >= h,
//
// and zeros are put beyond the nearer edge until the detector covers the circle of the longer side
// (F = 1/2 sum_i w_i ramp(p'_i), sum w_i = 2 pi). Padding goes on from the outermost sample, or its mirror
// image, times a factor that falls from 1 to 0 like 1 - m over half the detector's columns. Factors are
// rounded to float32, products once more.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/preparation_steps.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Whether axis and arc are those of half acquisition: more than three quarters of a turn about an axis that
/// lies more than twice as far from one edge of the detector as from the other.
VDVR_API bool looks_half_acquired(const ParallelGeometry& geometry);

/// Makes rows longer as `wanted` says, in place, and records it in geometry and report. Where it does not say
/// whether the scan is one of half acquisition, looks_half_acquired() does; the sentence that says so is
/// returned, else nothing. Rows that do not end in air where nothing is padded leave a note. Throws
/// InputError for half acquisition of less than a full turn, with an axis off the detector, or with an
/// overlap of less than 10 columns; for half acquisition of a sample that moved along columns; for either of
/// cone beam; ResourceError as read_scan. Cost: a pass over the data; memory: the longer rows beside the
/// scan's, in `scratch` where they take more than an eighth of the limit.
VDVR_API std::string extend_rows(ProjectionSet& scan, const Preparation& wanted,
                                 std::uint64_t max_memory_bytes = 0,
                                 const std::filesystem::path& scratch = {});

/// The detector itself, without the columns that were added.
VDVR_API ParallelGeometry own_detector(const ParallelGeometry& geometry);

/// What samples of the scan's rows were multiplied by, column by column; 0 in added ones.
VDVR_API std::vector<float> row_factors(const ParallelGeometry& geometry);

/// The rows as they were measured: within two roundings of float32. For what looks at noise and neighbours.
VDVR_API ProjectionSet own_rows(const ProjectionSet& scan);

}  // namespace vdvr
