// What the steps of a preparation leave of white noise.
#pragma once

#include <cstdint>

#include "vdvr/expert/line_noise.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Whether it does more than binning, which leaves white noise white.
bool changes_noise(Preparation preparation);

/// The noise of prepared projections, of that of the unprepared ones (`rows` x `columns` pixels): white noise
/// of its variance is pushed through the steps, on top of the prepared projections, blurred by a pixel, since
/// medians pass more of it on slopes. Some four million samples of it, from the middle rows; of stripes,
/// which need all views, at least 4 rows. Cost: the steps on those, and 128 multiply-adds for each. Memory:
/// 16 bytes for each; throws ResourceError beyond `max_memory_bytes`, 0 for no limit. The same on every
/// machine.
LineIntegralNoise passed_noise(const LineIntegralNoise& noise, std::int64_t rows, std::int64_t columns,
                               const ProjectionSet& prepared, std::uint64_t max_memory_bytes);

}  // namespace vdvr
