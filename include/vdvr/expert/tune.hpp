// Launch parameters measured on the device at hand.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

struct TuneCandidate {
  int lanes = 0, tile = 0, vectors = 0, tiles = 0;
  std::array<std::uint64_t, 3> local{};
  double gups = 0;        ///< 1e9 sample updates per second, median
  bool recorded = false;  ///< what the table in the source says for this class of device
};

struct TuneFilter {
  std::int64_t columns = 0;
  double product_seconds = 0, fourier_seconds = 0;  ///< medians, for the same number of detector pixels
};

struct TuneResult {
  std::vector<TuneCandidate> candidates;  ///< fastest first
  std::vector<TuneFilter> filters;
  std::int64_t product_columns = 0;  ///< the widest row measured for which the product won, 0 if it never did
};

/// Back-projects size^3 samples from `views` views with every candidate, and filters rows of several lengths
/// both ways. Every candidate's samples are compared with the recorded one's before it is timed. Cost: some
/// twenty such reconstructions per repetition. Throws MismatchError where a candidate's samples differ beyond
/// rounding.
VDVR_API TuneResult tune(Device& device, std::int64_t size, std::int64_t views, int repetitions,
                         const Progress& progress = {});

}  // namespace vdvr
