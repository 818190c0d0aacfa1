// Checks of what is to be done to projections, its words, and what binning does to columns
// (docs/preparation.md).
#pragma once

#include <cstdint>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/expert/preparation_steps.hpp"

namespace vdvr {

/// Throws InputError naming the member for a value out of its range.
VDVR_API void check_preparation(const Preparation& preparation);
/// What a reader is asked for, to do what a certificate records and no more: it leaves nothing to the files.
VDVR_API Preparation as_recorded(Preparation preparation);
/// With the windows of stripes set for a detector of so many columns.
VDVR_API Preparation for_columns(Preparation preparation, std::int64_t columns);
/// "stripes 3,51,21; binning 2": every step with its numbers; "none".
VDVR_API std::string text_of(const Preparation& preparation);
/// The column of a detector whose pixels are binned that shows what column `center` showed before.
VDVR_API double binned_center(double center, int binning);
/// And back.
VDVR_API double unbinned_center(double center, int binning);

}  // namespace vdvr
