// The spectrum of an image or volume (Fig. 5), and frequency-domain upsampling of a stored volume, what the
// paper sets certified volumes against (Figs. 11 and 14): the spectrum of the samples, padded with zeros.
// Called by the sections of the report.
#pragma once

#include <vector>

#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr::paper {

/// The volume on a grid of `cells` over the same box: the discrete spectrum of the samples under half-sample
/// mirror extension, zero-padded and evaluated at the new samples, in double precision. The mirror keeps the
/// faces from being joined to the opposite ones, which a bare FFT would do; any number of cells will do, not
/// only multiples. Where old and new samples coincide the values are the old ones to rounding. The series is
/// evaluated at the new samples themselves: an FFT would put them at its own, half a spacing off the old
/// faces. Cost: samples of one axis multiply-adds per sample and axis, on the host. Memory: the largest
/// volume in between, twice. Throws InputError for a size below 1 cell or a volume that does not match its
/// grid.
Volume upsample_volume(const Volume& volume, const Index3& cells, const Progress& progress = {});

/// The cosine coefficients of the same extension: float values[z][y][x] of `size` (x, y, z) become
/// a[m_z][m_y][m_x], with values = sum over m of a times the product of cos(pi m_j (x_j + 1/2) / n_j). Cost
/// as above.
std::vector<float> cosine_spectrum(std::vector<float> values, const Index3& size,
                                   const Progress& progress = {});

/// Cells per axis, in the proportions of `cells`, whose samples are as near as can be to `samples` in number:
/// the uniform grid that takes the place of a certified volume.
Index3 cells_for_samples(const Index3& cells, double samples);

}  // namespace vdvr::paper
