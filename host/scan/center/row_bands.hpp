// Views averaged over bands of rows: the centre is the same in all, and the mean has less noise.
#pragma once

#include <cstdint>
#include <numbers>
#include <vector>

#include "vdvr/expert/projections.hpp"

namespace vdvr::center {

inline constexpr double pi = std::numbers::pi;

/// double data[view][band][column].
struct RowBands {
  std::int64_t views = 0, bands = 0, columns = 0;
  std::vector<double> data;
  [[nodiscard]] const double* row(std::int64_t view, std::int64_t band) const {
    return data.data() + (view * bands + band) * columns;
  }
};

/// Of the views named, in their order; at most `most_bands`.
RowBands average_rows(const ProjectionSet& scan, const std::vector<std::int64_t>& views,
                      std::int64_t most_bands);
/// A Gaussian with a standard deviation of one column: interpolation between columns then neither adds nor
/// removes noise to speak of, which would pull the correlation's peak to half columns.
void smooth_columns(RowBands& set);
/// `factor` columns become one, their mean; what is left over at the end is dropped.
RowBands binned_columns(const RowBands& set, std::int64_t factor);
/// Differences of neighbours, one column fewer: what is the same all over a row counts no more.
RowBands differences(const RowBands& set);

/// Order of the views by angle.
std::vector<std::int64_t> by_angle(const std::vector<double>& theta);
/// The median step between different angles modulo a turn; 0 where there is one angle.
double median_step(std::vector<double> theta);
/// The extremum of the parabola through (-1, a), (0, b), (1, c), within half a step.
double parabola_peak(double a, double b, double c);

}  // namespace vdvr::center
