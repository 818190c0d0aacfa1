// The place about which one row is the mirror image of another, for many pairs of rows at once.
#pragma once

#include <optional>

#include "host/scan/center/row_bands.hpp"

namespace vdvr::center {

struct Pair {
  std::int64_t a, b;  ///< views of a RowBands
};

/// a(i) = b(sum - i).
struct Mirror {
  double sum = 0;          ///< twice the column of the mirror
  double correlation = 0;  ///< normalised, of the rows over their overlap
  double deviation = 0;    ///< of `sum`: what the rows leave unexplained over how fast they change
};

/// All columns of the detector are tried as the mirror, and whole pairs of rows of differences compared, so
/// that a narrow overlap with the structure counts for more than a wide one without. `rival`: how likely the
/// next best place that is no neighbour is, as a part of the best one's logarithm of likelihood.
struct CoarseMirror {
  double sum = 0, rival = 1;
};
std::optional<CoarseMirror> search_mirror(const RowBands& set, const std::vector<Pair>& pairs);

/// The peak of the correlation near `sum`, within `reach`. `set` is smooth.
Mirror refine_mirror(const RowBands& set, const std::vector<Pair>& pairs, double sum, double reach);

/// Cubic (Catmull-Rom) interpolation at j + f; columns j - 1 to j + 2 must exist.
double cubic_at(const double* p, std::int64_t j, double f);

/// The largest value outside the hill of `best`, which ends where the curve rises again on either side.
double rival_of(const std::vector<double>& curve, std::size_t best);

}  // namespace vdvr::center
