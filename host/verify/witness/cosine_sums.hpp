// Sums of cosines over a detector, as `verify` computes them: in double precision, rows side by side. Shared
// by field_bounds.cpp and verify_field.cpp; nothing of build uses them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace vdvr::cosine_sums {

/// Rows summed side by side.
constexpr std::int64_t lanes = 8;

/// line[m][row] = sum over l of a[m][l] basis[l][row], for U columns of V coefficients; `rows` is a multiple
/// of `lanes`.
void sum_rows(const double* a, std::int64_t U, std::int64_t V, const std::vector<double>& basis,
              std::int64_t rows, std::vector<double>& line);

/// cos(pi i / half) for 0 <= i < 2 half.
std::vector<double> cosine_period(std::int64_t half);

/// Columns summed at once.
constexpr std::int64_t columns_together = 4;
/// low[column][row], high[column][row]: the sums over m of line[m][row] c[m][column], and of (-1)^m that, of
/// `columns_together` columns and all rows.
void sum_column_block(const double* line, const double* c, std::int64_t U, std::int64_t rows, double* low,
                      double* high);

/// Calls put(n, row, values of `lanes` rows) for 0 <= n <= steps * U: the sums over m of line[m][row] cos(m
/// pi n / (steps U)); `cosine` is cosine_period(steps U). cos(m (pi - x)) = (-1)^m cos(m x): odd and even m
/// apart give two columns at once.
template <class Put>
void sum_columns(const std::vector<double>& line, std::int64_t U, std::int64_t rows, std::int64_t steps,
                 const std::vector<double>& cosine, Put&& put) {
  const std::int64_t last = steps * U, period = 2 * last;
  std::vector<double> c(static_cast<std::size_t>(U * columns_together)),
      low(static_cast<std::size_t>(rows * columns_together)), high(low);
  std::array<double, lanes> values{};
  const auto give = [&](std::int64_t n, const double* sums) {
    for (std::int64_t r = 0; r < rows; r += lanes) {
      std::copy_n(sums + r, lanes, values.begin());
      put(n, r, values);
    }
  };
  for (std::int64_t first = 0; 2 * first <= last; first += columns_together) {
    for (std::int64_t i = 0; i < columns_together; ++i)
      for (std::int64_t m = 0, at = 0; m < U; ++m) {
        c[static_cast<std::size_t>(m * columns_together + i)] = cosine[static_cast<std::size_t>(at)];
        at += first + i;
        if (at >= period) at -= period;
      }
    sum_column_block(line.data(), c.data(), U, rows, low.data(), high.data());
    for (std::int64_t i = 0; i < columns_together && 2 * (first + i) <= last; ++i) {
      give(first + i, low.data() + i * rows);
      give(last - first - i, high.data() + i * rows);
    }
  }
}

}  // namespace vdvr::cosine_sums
