// Stripes in a sinogram, after Vo, Atwood and Drakopoulos, Optics Express 26, 2018, 28396. A stripe is a
// column that answers otherwise than its neighbours, in all views or in some. Sinograms are double
// sinogram[view][column] of line integrals. Called by prepare.cpp.
//
// Deviation: the paper corrects columns by a factor, of intensities. Of line integrals a factor of intensity
// is an offset, so columns are compared by differences; a column that was found to be far off gets its
// neighbours' values rank by rank, which no offset changes.
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
/// is. `scale`: a rise below 1e-6 of it counts as that.
std::vector<bool> outstanding(const std::vector<double>& values, double ratio, double scale);
/// Dead and fluctuating columns (algorithm 6), between their nearest sound neighbours afterwards. Returns how
/// many there were.
std::int64_t remove_dead_stripes(Sinogram& sinogram, double ratio, int window);
/// Columns that differ from their neighbours alike for a sixth of the views or more, which what is seen of an
/// object that turns does not: the difference is taken off them. Returns how many there were. Not of the
/// paper: sorting moves such a stripe's views among the ranks, and nine tenths of one that fills half of the
/// views stay.
std::int64_t remove_lasting_stripes(Sinogram& sinogram, double ratio);
/// Columns far off their neighbours (algorithm 5), in stripes of at most a fifth of the window: wider ones
/// are the object's (the paper takes them too, which damages the middle of a slice). Returns how many there
/// were.
std::int64_t remove_large_stripes(Sinogram& sinogram, double ratio, int window);
/// All others (algorithm 3): columns sorted along the views, each rank the median of its neighbours', and
/// back. Cost: views columns (log views + window).
void remove_small_stripes(Sinogram& sinogram, int window);

}  // namespace vdvr
