// Sums of cosines in double precision.
#include "host/verify/witness/cosine_sums.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "host/base/system/wide.hpp"

namespace vdvr::cosine_sums {

namespace {

// A vector of `lanes` rows, whatever the processor has.
typedef double Rows __attribute__((vector_size(lanes * sizeof(double)), aligned(alignof(double)), may_alias));

const Rows& rows_at(const double* p) { return *reinterpret_cast<const Rows*>(p); }
Rows& rows_at(double* p) { return *reinterpret_cast<Rows*>(p); }

}  // namespace

// The line is read once for all columns of the block.
VDVR_WIDE void sum_column_block(const double* line, const double* c, std::int64_t U, std::int64_t rows,
                                double* low, double* high) {
  for (std::int64_t r = 0; r < rows; r += lanes) {
    Rows even0{}, even1{}, even2{}, even3{}, odd0{}, odd1{}, odd2{}, odd3{};
    const double* p = line + r;
    std::int64_t m = 0;
    for (; m + 1 < U; m += 2, p += 2 * rows) {
      const Rows a = rows_at(p), b = rows_at(p + rows);
      const double* of = c + m * columns_together;
      even0 += of[0] * a;
      even1 += of[1] * a;
      even2 += of[2] * a;
      even3 += of[3] * a;
      odd0 += of[4] * b;
      odd1 += of[5] * b;
      odd2 += of[6] * b;
      odd3 += of[7] * b;
    }
    if (m < U) {
      const Rows a = rows_at(p);
      const double* of = c + m * columns_together;
      even0 += of[0] * a;
      even1 += of[1] * a;
      even2 += of[2] * a;
      even3 += of[3] * a;
    }
    rows_at(low + r) = even0 + odd0;
    rows_at(low + rows + r) = even1 + odd1;
    rows_at(low + 2 * rows + r) = even2 + odd2;
    rows_at(low + 3 * rows + r) = even3 + odd3;
    rows_at(high + r) = even0 - odd0;
    rows_at(high + rows + r) = even1 - odd1;
    rows_at(high + 2 * rows + r) = even2 - odd2;
    rows_at(high + 3 * rows + r) = even3 - odd3;
  }
}

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
