// Rows of views that saw the sample at other heights, brought to heights that are one scan's.
#pragma once

#include <cstdint>
#include <filesystem>

#include "vdvr/expert/preparation_steps.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Upright rows where the axis leans (upright_rows.hpp); common heights (common_heights.hpp) or all
/// (series_of_heights.hpp) where rows are shifted, as `wanted` says, else as more are covered. In place, and
/// recorded in geometry and report. Does nothing where rows lie as they should, or where `wanted` leaves them
/// as seen. Throws InputError where no height is left, ResourceError as read_scan.
void bring_to_heights(ProjectionSet& scan, const Preparation& wanted, std::uint64_t max_memory_bytes,
                      const std::filesystem::path& scratch);

}  // namespace vdvr
