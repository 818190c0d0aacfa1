// Sums of cosines in double precision.
#include "host/verify/witness/cosine_sums.hpp"

#include <cmath>
#include <numbers>

#include "host/base/system/wide.hpp"

namespace vdvr::cosine_sums {

namespace {

// One sum after the other would wait for each of its additions: several columns' take turns. Named, they stay
// in registers.
constexpr std::int64_t columns_together = 6;

template <std::int64_t N>
VDVR_ALWAYS_INLINE void six_columns_in(const double* a, std::int64_t V, const double* basis,
                                       std::int64_t rows, double* line) {
  using Rows = wide::Doubles<N>;
  for (std::int64_t r = 0; r < rows; r += N) {
    typename Rows::Vector s0{}, s1{}, s2{}, s3{}, s4{}, s5{};
    const double* c = a;
    for (const double *b = basis + r, *end = b + V * rows; b < end; b += rows, ++c) {
      const typename Rows::Vector wave = Rows::at(b);
      s0 += c[0] * wave;
      s1 += c[V] * wave;
      s2 += c[2 * V] * wave;
      s3 += c[3 * V] * wave;
      s4 += c[4 * V] * wave;
      s5 += c[5 * V] * wave;
    }
    Rows::at(line + r) = s0;
    Rows::at(line + rows + r) = s1;
    Rows::at(line + 2 * rows + r) = s2;
    Rows::at(line + 3 * rows + r) = s3;
    Rows::at(line + 4 * rows + r) = s4;
    Rows::at(line + 5 * rows + r) = s5;
  }
}
VDVR_IN_WIDTHS(six_columns,
               (const double* a, std::int64_t V, const double* basis, std::int64_t rows, double* line),
               (a, V, basis, rows, line))

template <std::int64_t N>
VDVR_ALWAYS_INLINE void one_column_in(const double* a, std::int64_t V, const double* basis, std::int64_t rows,
                                      double* line) {
  using Rows = wide::Doubles<N>;
  for (std::int64_t r = 0; r < rows; r += N) {
    typename Rows::Vector sum{};
    for (std::int64_t l = 0; l < V; ++l) sum += a[l] * Rows::at(basis + l * rows + r);
    Rows::at(line + r) = sum;
  }
}
VDVR_IN_WIDTHS(one_column,
               (const double* a, std::int64_t V, const double* basis, std::int64_t rows, double* line),
               (a, V, basis, rows, line))

}  // namespace

void sum_rows(const double* a, std::int64_t U, std::int64_t V, const std::vector<double>& basis,
              std::int64_t rows, std::vector<double>& line) {
  std::int64_t m = 0;
  for (; m + columns_together <= U; m += columns_together)
    six_columns(a + m * V, V, basis.data(), rows, line.data() + m * rows);
  for (; m < U; ++m) one_column(a + m * V, V, basis.data(), rows, line.data() + m * rows);
}

std::vector<double> cosine_period(std::int64_t half) {
  std::vector<double> table(static_cast<std::size_t>(2 * half));
  for (std::int64_t i = 0; i < 2 * half; ++i)
    table[static_cast<std::size_t>(i)] =
        std::cos(std::numbers::pi * static_cast<double>(i) / static_cast<double>(half));
  return table;
}

}  // namespace vdvr::cosine_sums
