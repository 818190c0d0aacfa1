// Sums of cosines along v, as `verify` computes them: in double precision, rows side by side. Nothing of
// build uses them.
#pragma once

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

}  // namespace vdvr::cosine_sums
