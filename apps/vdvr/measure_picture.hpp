// The picture of what is measured. Called by measure.cpp.
#pragma once

#include "apps/vdvr/options.hpp"
#include "vdvr/expert/measure_picture.hpp"

namespace vdvr::cli {

/// --picture, --slice-axis, --slice-position, --size.
void add_measure_picture(Arguments& args);
/// Throws InputError for options that go with none, and a file that is no PNG.
void check_measure_picture(const Arguments& args, bool of_range, bool of_histogram);
MeasurePictureOptions measure_picture_options(const Arguments& args);

}  // namespace vdvr::cli
