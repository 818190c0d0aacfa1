// The noise of a detector (the paper's section 5 recipe); its median, blur and binning are
// host/scan/prepare/view_filters.
#pragma once

#include <cstdint>

#include "host/scan/prepare/view_filters.hpp"

namespace vdvr {

/// Adds normal deviates of the given standard deviation: Box-Muller on std::mt19937_64, whose stream is fixed
/// by the standard and seeded (seed, view): the same on every platform (up to the last bit of log and cos)
/// and any thread count.
void add_noise(View& view, double sigma, std::uint64_t seed, std::int64_t view_index);

}  // namespace vdvr
