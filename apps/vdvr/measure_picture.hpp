// The picture of what is measured. Called by measure.cpp and run.cpp.
#pragma once

#include <optional>

#include "apps/vdvr/options.hpp"
#include "vdvr/expert/measure_picture.hpp"

namespace vdvr::cli {

/// --picture, --slice-axis, --slice-position, --size.
void add_measure_picture(Arguments& args);
/// Throws InputError for options that go with none, and a file that is no PNG.
void check_measure_picture(const Arguments& args, bool of_range, bool of_histogram);
/// A slice through the middle of the grid unless options say where.
MeasurePictureOptions measure_picture_options(const Arguments& args, const Grid& grid);

}  // namespace vdvr::cli
