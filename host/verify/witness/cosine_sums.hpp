// Sums of cosines over a detector, as `verify` computes them: in double precision, rows side by side. Shared
// by field_bounds.cpp and verify_field.cpp; nothing of build uses them.
#pragma once

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

/// Calls put(n, row, values of `lanes` rows) for 0 <= n <= steps * U: the sums over m of line[m][row] cos(m
/// pi n / (steps U)); `cosine` is cosine_period(steps U). cos(m (pi - x)) = (-1)^m cos(m x): odd and even m
/// apart give two columns at once.
template <class Put>
void sum_columns(const std::vector<double>& line, std::int64_t U, std::int64_t rows, std::int64_t steps,
                 const std::vector<double>& cosine, Put&& put) {
  const std::int64_t last = steps * U, period = 2 * last;
  std::vector<double> c(static_cast<std::size_t>(U));
  for (std::int64_t n = 0; 2 * n <= last; ++n) {
    for (std::int64_t m = 0, i = 0; m < U; ++m) {
      c[static_cast<std::size_t>(m)] = cosine[static_cast<std::size_t>(i)];
      i += n;
      if (i >= period) i -= period;
    }
    for (std::int64_t r = 0; r < rows; r += lanes) {
      std::array<double, lanes> even{}, odd{}, low{}, high{};
      const double* p = line.data() + r;
      std::int64_t m = 0;
      for (; m + 1 < U; m += 2, p += 2 * rows)
        for (std::size_t i = 0; i < lanes; ++i) {
          even[i] += c[static_cast<std::size_t>(m)] * p[i];
          odd[i] += c[static_cast<std::size_t>(m + 1)] * p[static_cast<std::size_t>(rows) + i];
        }
      if (m < U)
        for (std::size_t i = 0; i < lanes; ++i) even[i] += c[static_cast<std::size_t>(m)] * p[i];
      for (std::size_t i = 0; i < lanes; ++i) {
        low[i] = even[i] + odd[i];
        high[i] = even[i] - odd[i];
      }
      put(n, r, low);
      put(last - n, r, high);
    }
  }
}

}  // namespace vdvr::cosine_sums
