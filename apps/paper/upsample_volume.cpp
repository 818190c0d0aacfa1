#include "apps/paper/upsample_volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/paper/parallel_rows.hpp"
#include "vdvr/error.hpp"

namespace vdvr::paper {
namespace {

/// cos(pi m (x + 1/2) / n) of all m: the series that interpolates n samples under half-sample mirror
/// extension.
std::vector<double> waves(std::int64_t n, double x) {
  std::vector<double> out;
  for (std::int64_t m = 0; m < n; ++m)
    out.push_back(std::cos(std::numbers::pi * static_cast<double>(m) * (x + 0.5) / static_cast<double>(n)));
  return out;
}

/// double matrix[new sample][old sample] of one axis: (1 + 2 sum over m > 0 of both samples' waves) / n.
std::vector<double> axis_matrix(std::int64_t old_cells, std::int64_t new_cells) {
  const std::int64_t n = old_cells + 1;
  std::vector<std::vector<double>> old;
  for (std::int64_t i = 0; i < n; ++i) old.push_back(waves(n, static_cast<double>(i)));
  std::vector<double> matrix;
  for (std::int64_t j = 0; j <= new_cells; ++j) {
    const std::vector<double> at =
        waves(n, static_cast<double>(j) * static_cast<double>(old_cells) / static_cast<double>(new_cells));
    for (const auto& o : old) {
      double sum = 0;
      for (std::size_t m = 1; m < at.size(); ++m) sum += at[m] * o[m];
      matrix.push_back((1 + 2 * sum) / static_cast<double>(n));
    }
  }
  return matrix;
}

/// double matrix[m][i]: the coefficients of that series.
std::vector<double> analysis_matrix(std::int64_t n) {
  std::vector<double> matrix(static_cast<std::size_t>(n * n));
  for (std::int64_t i = 0; i < n; ++i) {
    const std::vector<double> at = waves(n, static_cast<double>(i));
    for (std::int64_t m = 0; m < n; ++m)
      matrix[static_cast<std::size_t>(m * n + i)] =
          (m == 0 ? 1 : 2) * at[static_cast<std::size_t>(m)] / static_cast<double>(n);
  }
  return matrix;
}

/// out[outer][m][inner] = matrix[m][n] in[outer][n][inner].
std::vector<float> along_axis(const std::vector<float>& in, const std::vector<double>& matrix,
                              std::int64_t outer, std::int64_t n, std::int64_t m, std::int64_t inner,
                              const Progress& progress, const std::string& stage) {
  std::vector<float> out(static_cast<std::size_t>(outer * m * inner));
  parallel_rows(outer * m, progress, stage, [&](std::int64_t row) {
    const std::int64_t block = row / m, j = row % m;
    std::vector<double> sum(static_cast<std::size_t>(inner));
    for (std::int64_t i = 0; i < n; ++i) {
      const double weight = matrix[static_cast<std::size_t>(j * n + i)];
      const auto from = in.begin() + (block * n + i) * inner;
      for (std::size_t k = 0; k < sum.size(); ++k)
        sum[k] += weight * static_cast<double>(from[static_cast<std::ptrdiff_t>(k)]);
    }
    std::transform(sum.begin(), sum.end(), out.begin() + row * inner,
                   [](double s) { return static_cast<float>(s); });
  });
  return out;
}

}  // namespace

Volume upsample_volume(const Volume& volume, const Index3& cells, const Progress& progress) {
  const Grid& grid = volume.grid;
  if (static_cast<std::int64_t>(volume.samples.size()) != grid.sample_count())
    throw InputError(
        fmt::format("{} samples do not fill a grid of {}", volume.samples.size(), grid.sample_count()));
  Volume out{grid, {}};
  for (std::size_t a = 0; a < 3; ++a) {
    if (cells[a] < 1 || cells[a] > (1 << 16))
      throw InputError(
          fmt::format("a volume cannot be upsampled to {} x {} x {} cells", cells[0], cells[1], cells[2]));
    out.grid.cells[a] = cells[a];
    out.grid.spacing[a] =
        grid.spacing[a] * static_cast<double>(grid.cells[a]) / static_cast<double>(cells[a]);
  }
  const Index3 from = grid.samples(), to = out.grid.samples();
  // The slowest axis last: the rows that are combined are then whole, and the small volume goes first.
  out.samples = volume.samples;
  std::int64_t inner = 1, outer = grid.sample_count();
  for (std::size_t a = 0; a < 3; ++a) {
    outer /= from[a];
    out.samples = along_axis(out.samples, axis_matrix(grid.cells[a], cells[a]), outer, from[a], to[a], inner,
                             progress, "upsample volume");
    inner *= to[a];
  }
  return out;
}

std::vector<float> cosine_spectrum(std::vector<float> values, const Index3& size, const Progress& progress) {
  std::int64_t inner = 1;
  for (const std::int64_t n : size) {
    values = along_axis(values, analysis_matrix(n), static_cast<std::int64_t>(values.size()) / (inner * n), n,
                        n, inner, progress, "spectrum");
    inner *= n;
  }
  return values;
}

Index3 cells_for_samples(const Index3& cells, double samples) {
  const auto scaled = [&](double scale) {
    Index3 c{};
    for (std::size_t a = 0; a < 3; ++a)
      c[a] = std::max<std::int64_t>(1, std::llround(static_cast<double>(cells[a]) * scale));
    return c;
  };
  const auto count = [&](double scale) {
    const Index3 c = scaled(scale);
    return static_cast<double>(c[0] + 1) * static_cast<double>(c[1] + 1) * static_cast<double>(c[2] + 1);
  };
  double low = 0, high = 1;
  while (count(high) < samples && high < 64) high *= 2;
  for (int i = 0; i < 60; ++i) (count(0.5 * (low + high)) < samples ? low : high) = 0.5 * (low + high);
  return samples - count(low) < count(high) - samples ? scaled(low) : scaled(high);
}

}  // namespace vdvr::paper
