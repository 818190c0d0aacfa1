// What F is worth: the standard deviation that the noise of the projections leaves in it (docs/noise.md). F
// is linear in the projections, so its variance is one more back-projection, of theirs with squared weights:
//
//   var F(x) = sum_k w_k(x)^2 sum_{r,i} S_v(z, r)^2 g(t_k(x) - i)^2 v_{k,r,i}
//
// with g the band-limited kernel of the filter and S_v the interpolant between rows. (Riederer, Pelc and
// Chesler, Phys. Med. Biol. 23, 1978; Wunderlich and Noo, Phys. Med. Biol. 53, 2008.) It is an estimate, no
// bound: nothing that is certified rests on it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/line_noise.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr {

/// What a user states of the noise, in place of what the scan tells.
struct NoiseOptions {
  std::optional<double> photons{};  ///< of a pixel in the open beam
  std::optional<double> sigma_p{};  ///< the standard deviation of every line integral
};

/// What is known of a scan's noise, and from where.
struct ScanNoise {
  LineIntegralNoise model;  ///< the one to use
  /// Photons of a pixel in the open beam, as each source has them. Texture makes the last two too few; pixels
  /// that share signal, and counts of a few photons, make them too many (docs/noise.md).
  std::optional<double> by_flats, by_differences, by_wedge;
  /// Whether the model was stated, or two sources have the same photons within a factor of 1.5.
  bool agreed = false;
  /// The share of the pixels' variance that passed the preparation, and Ram-Lak's ramp after it.
  double passed = 1;
  std::string words;  ///< one line: the source, what it found, what the others say
};

/// Of what is stated, else of flats (`by_flats`, as read_line_noise() has it), else of the projections alone:
/// the larger number of photons of two estimates, since texture, which is in most scans, makes them fewer.
/// (1) Second differences along views and columns (Immerkaer 1996), median; (2) the empty wedge of a sinogram
/// in frequency, parallel beam with even steps alone. Nothing where none can be had, where the projections
/// were prepared by more than binning, or where more photons are found than detectors count (10^9): such data
/// were not measured. Line integrals beyond 30, or below 0.01, are no logarithms of counts: they get one
/// variance for all, and so do those whose estimates agree within 1.5 on that alone. `why` gets one line
/// where there is nothing. Cost: a pass over at most a few million samples. Throws InputError for numbers
/// that are not positive and finite.
VDVR_API std::optional<ScanNoise> scan_noise(const ProjectionSet& scan, const NoiseOptions& options = {},
                                             const std::optional<LineIntegralNoise>& by_flats = {},
                                             std::string* why = nullptr);

/// The same of a scan that was read from `path` as `how` says, with what its flats tell. Where projections
/// were prepared by more than binning, noise is that of the unprepared ones, which are read once more, times
/// what passed: white noise of that variance is pushed through the same steps (docs/noise.md). Memory: of
/// prepared ones a second scan, held as `how` has it, and some 100 MiB; nothing where that is too much.
/// Throws what read_scan() throws; FileError where the scan was changed since.
VDVR_API std::optional<ScanNoise> read_scan_noise(const std::filesystem::path& path, const ScanOptions& how,
                                                  const ProjectionSet& scan, const NoiseOptions& options = {},
                                                  std::string* why = nullptr, const Progress& progress = {});

/// float sigma[z][y][x] of F on the samples of a grid, density units: coarser than the scan's, since it is
/// smooth. Samples that views do not see hold anything finite; of cone beam 0. Cost: a back-projection of
/// as many samples, and 25 multiply-adds for each pixel of rows that the grid's planes need (all rows where
/// they lie between rows). Memory: 16 rows of the scan at two columns to a pixel; of cone beam the scan once
/// more. Throws what reconstruct() throws.
VDVR_API Volume noise_of_field(Device& device, const ProjectionSet& scan, const FieldOptions& field,
                               const LineIntegralNoise& noise, const Grid& grid,
                               const Progress& progress = {});

/// The noise of averaged flats. It is common to all views, so that it makes rings, which neither the
/// projections alone nor the split of the views show: at r columns from the axis it adds at(r) of F's
/// variance to it (docs/noise.md).
struct RingNoise {
  std::int64_t flats = 0;
  double at_axis = 0;  ///< of the variance
  double slope = 0;    ///< at(r) = slope / r, where that is less
  [[nodiscard]] double at(double r) const { return r * at_axis > slope ? slope / r : at_axis; }
  /// Columns within which it adds more than a tenth.
  [[nodiscard]] double radius() const { return at_axis > 0.1 ? slope / 0.1 : 0; }
};
/// Of parallel beam and a scan whose line integrals are of `flats` averaged flats; nothing of others. Cost: a
/// pass over at most a million samples.
VDVR_API std::optional<RingNoise> ring_noise(const ProjectionSet& scan, std::int64_t flats);

/// The grid of a sample per brick corner, on which noise_of_field() is asked for.
VDVR_API Grid noise_grid(const Grid& grid, int granularity);

/// A check without a model: half the difference of F from every other view and F from those between them has
/// the variance of F, and beside it what too few views, motion or drift add.
struct SplitOfViews {
  double sigma = 0;      ///< root mean square of that half difference
  double predicted = 0;  ///< of the sigma of F at the same samples
  std::int64_t samples = 0;
  /// Whether the whole object lies within K / pi pixels of these samples, for K views in each half; if not,
  /// the difference holds beside noise what so few views alias.
  bool resolved = false;
  [[nodiscard]] double ratio() const { return sigma / predicted; }
};

/// In planes through the middle rows: at the samples that the whole object lies close enough to, if there are
/// any, else within K / 2 pi pixels of the axis. Nothing of fewer than 50 samples. Cost: an FBP of a few
/// planes.
VDVR_API std::optional<SplitOfViews> split_of_views(Device& device, const ProjectionSet& scan,
                                                    const FieldOptions& field, const LineIntegralNoise& noise,
                                                    const Progress& progress = {});

}  // namespace vdvr
