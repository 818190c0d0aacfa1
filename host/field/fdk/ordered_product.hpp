// Products of matrices in double precision whose sums run in the order of the inner index: each element has
// the bits of the plain loop.
#pragma once

#include <cstdint>
#include <vector>

namespace vdvr {

/// The right factor, b[n][columns], laid out in panels of columns.
class OrderedFactor {
 public:
  OrderedFactor(const double* b, std::int64_t n, std::int64_t columns);
  /// out[r][m] = sum over i of a[r][i] b[i][m]. Cost: rows * n * columns multiply-adds. Thread-safe.
  void product(const double* a, std::int64_t rows, double* out) const;

 private:
  std::int64_t n_, columns_;
  std::vector<double> panels_;  ///< [panel][i][column of the panel]; zeros beyond the last column
};

}  // namespace vdvr
