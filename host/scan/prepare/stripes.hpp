// Stripes in a sinogram, after Vo, Atwood and Drakopoulos, Optics Express 26, 2018, 28396. A stripe is a
// column that answers otherwise than its neighbours, in all views or in some. Sinograms are double
// sinogram[view][column] of line integrals.
//
// Deviation: the paper corrects columns by a factor, of intensities. Of line integrals a factor of intensity
// is an offset, so columns are compared by differences.
#pragma once

#include <cstdint>
#include <vector>

namespace vdvr {

struct Sinogram {
  std::int64_t views = 0, columns = 0;
  std::vector<double> data;
  double* row(std::int64_t view) { return data.data() + view * columns; }
  [[nodiscard]] const double* row(std::int64_t view) const { return data.data() + view * columns; }
};

/// Columns whose value stands out (algorithm 4): sorted, the values' middle half is a line; its rise is the
/// noise, and what lies beyond its ends by more than `ratio` times that is marked. At least 8 values, or none
/// is. A rise below `least_rise` counts as that.
std::vector<bool> outstanding(const std::vector<double>& values, double ratio, double least_rise);
/// Dead and fluctuating columns (algorithm 6), between their nearest sound neighbours afterwards. Returns how
/// many there were.
std::int64_t remove_dead_stripes(Sinogram& sinogram, double ratio, int window);
/// Columns that lie off those around them alike for a quarter of the scan or more, up to half of `window`
/// wide: the difference is taken off them. Returns how many there were. Deviation: in place of the paper's
/// algorithm 5, which compares ranks with those of 51 columns. On a detector of a few hundred columns it
/// takes the limbs of an object, and what lies near the axis, for stripes; and of a stripe that fills half of
/// the views sorting leaves nine tenths.
std::int64_t remove_lasting_stripes(Sinogram& sinogram, double ratio, int window);
/// All others (algorithm 3): columns sorted along the views, each rank the median of its neighbours', and
/// back. Cost: views columns (log views + window).
void remove_small_stripes(Sinogram& sinogram, int window);

}  // namespace vdvr
