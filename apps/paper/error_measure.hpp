// How far values lie from the truth: the measures of the paper's figures and tables. Called by the sections
// of the report.
#pragma once

#include <cstdint>
#include <span>

namespace vdvr::paper {

struct ErrorMeasure {
  std::int64_t count = 0;
  double rms = 0;  ///< root of the mean square of value - truth
  /// The same once the values are shifted and scaled to the mean and standard deviation of the truth, as the
  /// paper registers volumes for its Fig. 3: a wrong offset or gain does not count.
  double rms_normalised = 0;
  double max = 0;
  double p99 = 0;              ///< 99 of 100 values err by no more
  double mean_error = 0;       ///< mean of value - truth
  double deviation_ratio = 1;  ///< standard deviation of the values over that of the truth
};

/// Density units, sums in double. A value that is not finite makes every measure NaN. Throws InputError for
/// lengths that differ or are 0.
ErrorMeasure measure_error(std::span<const float> values, std::span<const float> truth);

}  // namespace vdvr::paper
