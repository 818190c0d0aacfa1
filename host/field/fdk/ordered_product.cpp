#include "host/field/fdk/ordered_product.hpp"

#include <algorithm>

#include "host/base/system/casts.hpp"
#include "host/base/system/wide.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t lanes = 8, rows_together = 4;

// Of four rows, a[row][n], and a panel, b[n][lanes]: out[row][lanes].
template <std::int64_t N>
VDVR_ALWAYS_INLINE void four_rows_in(const double* a, std::int64_t n, const double* b, double* out) {
  using Lanes = wide::Doubles<N>;
  const double *a0 = a, *a1 = a + n, *a2 = a + 2 * n, *a3 = a + 3 * n;
  for (std::int64_t lane = 0; lane < lanes; lane += N, b += N, out += N) {
    typename Lanes::Vector s0{}, s1{}, s2{}, s3{};
    for (std::int64_t i = 0; i < n; ++i) {
      const typename Lanes::Vector of = Lanes::at(b + i * lanes);
      s0 += a0[i] * of;
      s1 += a1[i] * of;
      s2 += a2[i] * of;
      s3 += a3[i] * of;
    }
    Lanes::at(out) = s0;
    Lanes::at(out + lanes) = s1;
    Lanes::at(out + 2 * lanes) = s2;
    Lanes::at(out + 3 * lanes) = s3;
  }
}
VDVR_IN_WIDTHS(four_rows, (const double* a, std::int64_t n, const double* b, double* out), (a, n, b, out))

}  // namespace

OrderedFactor::OrderedFactor(const double* b, std::int64_t n, std::int64_t columns)
    : n_(n), columns_(columns), panels_(at((columns + lanes - 1) / lanes * lanes * n), 0.0) {
  for (std::int64_t first = 0; first < columns; first += lanes)
    for (std::int64_t i = 0; i < n; ++i)
      std::copy_n(b + i * columns + first, std::min(lanes, columns - first),
                  panels_.begin() + first * n + i * lanes);
}

void OrderedFactor::product(const double* a, std::int64_t rows, double* out) const {
  std::vector<double> last;  // rows that are no four, and others beside them
  std::vector<double> sums(at(rows_together * lanes));
  for (std::int64_t r = 0; r < rows; r += rows_together) {
    const double* four = a + r * n_;
    const std::int64_t count = std::min(rows_together, rows - r);
    if (count < rows_together) {
      last.assign(at(rows_together * n_), 0.0);
      std::copy_n(four, count * n_, last.begin());
      four = last.data();
    }
    for (std::int64_t first = 0; first < columns_; first += lanes) {
      four_rows(four, n_, panels_.data() + first * n_, sums.data());
      for (std::int64_t i = 0; i < count; ++i)
        std::copy_n(sums.begin() + i * lanes, std::min(lanes, columns_ - first),
                    out + (r + i) * columns_ + first);
    }
  }
}

}  // namespace vdvr
