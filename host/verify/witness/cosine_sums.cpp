// Sums of cosines in double precision.
#include "host/verify/witness/cosine_sums.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "host/base/system/wide.hpp"

namespace vdvr::cosine_sums {

namespace {

VDVR_WIDE void rows_of(const double* a, std::int64_t U, std::int64_t V, const double* basis,
                       std::int64_t rows, double* line) {
  for (std::int64_t m = 0; m < U; ++m)
    for (std::int64_t r = 0; r < rows; r += lanes) {
      std::array<double, lanes> sum{};
      for (std::int64_t l = 0; l < V; ++l) {
        const double c = a[m * V + l];
        const double* b = basis + l * rows + r;
        for (std::size_t i = 0; i < lanes; ++i) sum[i] += c * b[i];
      }
      std::copy(sum.begin(), sum.end(), line + m * rows + r);
    }
}

}  // namespace

void sum_rows(const double* a, std::int64_t U, std::int64_t V, const std::vector<double>& basis,
              std::int64_t rows, std::vector<double>& line) {
  rows_of(a, U, V, basis.data(), rows, line.data());
}

std::vector<double> cosine_period(std::int64_t half) {
  std::vector<double> table(static_cast<std::size_t>(2 * half));
  for (std::int64_t i = 0; i < 2 * half; ++i)
    table[static_cast<std::size_t>(i)] =
        std::cos(std::numbers::pi * static_cast<double>(i) / static_cast<double>(half));
  return table;
}

}  // namespace vdvr::cosine_sums
