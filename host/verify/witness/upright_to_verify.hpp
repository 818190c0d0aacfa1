// Rows of a leaning axis brought upright by means of verify's own (docs/geometry.md, "A leaning axis").
// Deviation from upright_rows.cpp on purpose: that has transforms and coefficients, this has the weight of
// each sample for each place, by the barycentric formula of the cosine series (Salzer 1972; its second form,
// which is stable: Higham 2004),
//
//   S[x](y) = sum over v of w_v x_v / sum over v of w_v,   w_v = (-1)^v sin(b_v) / (cos(b_v) - cos(pi (y +
//   1/2) / n)),
//
// b_v = pi (v + 1/2) / n, in long double.
#pragma once

#include <cstdint>
#include <vector>

#include "host/verify/witness/rows_room.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Weights of n samples for places among them.
class SeriesWeights {
 public:
  explicit SeriesWeights(std::int64_t n);
  /// For the place y: n weights that sum to 1.
  [[nodiscard]] std::vector<double> operator()(long double y) const;

 private:
  std::vector<long double> cosine_, signed_sine_;
};

/// In place; `scan` is as it was measured, with the axis' roll. Throws InputError where nothing is left.
/// Cost: views * rows * columns * (rows + columns) multiply-adds; where rows are shifted by view, as many
/// weights too.
void to_upright_rows(ProjectionSet& scan, const RowsRoom& room);

}  // namespace vdvr
