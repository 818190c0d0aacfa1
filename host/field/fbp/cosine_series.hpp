// Band-limited resampling under half-sample mirror extension (a DCT-II cosine series), as dense matrices in
// double precision.
//
// A row q_0 .. q_{n-1} defines q(x) = sum_i q_i [ g(x - i) + g(x + i + 1) ] with g(d) = (1/n) [1/2 +
// sum_{m=1}^{n-1} cos(pi m d / n)].
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace vdvr {

/// Columns of an upsampled detector row: column j lies at x = first + (j - pad) / rate, in detector pixels.
struct UpsampledColumns {
  int rate = 1;
  double first = 0;        ///< 0 for rate 1 (the detector's own pixels), else -1/2 (its edge)
  std::int64_t pad = 0;    ///< columns of the mirror extension before the first and after the last
  std::int64_t count = 0;  ///< with padding

  [[nodiscard]] double position(std::int64_t j) const { return first + static_cast<double>(j - pad) / rate; }
  /// The (real) column that a detector position falls on.
  [[nodiscard]] double column_of(double x) const { return (x - first) * rate + static_cast<double>(pad); }
};
/// Covers [-1/2 - margin, n - 1/2 + margin].
UpsampledColumns upsampled_columns(std::int64_t n, int rate, double margin_pixels);

/// double matrix[position][i]: the value (order 0) or a derivative of the series at each position, with x
/// measured in `pitch` units. `lattice` > 0 promises that positions are multiples of 1 / lattice; odd orders
/// need it.
std::vector<double> resampling_matrix(std::int64_t n, std::span<const double> positions, int order,
                                      double pitch, int lattice);

/// What a sample at distance d contributes, on both sides of every mirror: the g of the head, in closed form.
double cosine_kernel(std::int64_t n, double d);

/// How much errors of n samples, each by itself, can grow anywhere: the largest sum of magnitudes of a row of
/// the matrix for order 0, over all real positions. Cost: 4 n^2 additions.
double cosine_gain(std::int64_t n);

/// double matrix[m][i]: the cosine coefficients a_m, q(x) = sum_m a_m cos(pi m (x + 1/2) / n).
std::vector<double> analysis_matrix(std::int64_t n);

}  // namespace vdvr
