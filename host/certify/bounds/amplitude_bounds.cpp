#include "host/certify/bounds/amplitude_bounds.hpp"

#include <cmath>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/certify/bounds/projection_bounds.hpp"
#include "host/certify/bounds/wave_error.hpp"
#include "host/field/fbp/cosine_series.hpp"

namespace vdvr {
namespace {

// Of wave number `index` of the cosine series of so many pixels.
double frequency(std::int64_t index, std::int64_t count, double pitch) {
  return std::numbers::pi * static_cast<double>(index) / static_cast<double>(count) / pitch;
}

// So that neighbouring sums are made side by side.
std::vector<double> transposed(const std::vector<double>& square, std::int64_t side) {
  std::vector<double> out(square.size());
  for (std::int64_t i = 0; i < side; ++i)
    for (std::int64_t j = 0; j < side; ++j) out[at(j * side + i)] = square[at(i * side + j)];
  return out;
}

}  // namespace

AmplitudeBounds amplitude_bounds(const FilteredScan& scan, const Grid& grid, const std::vector<int>& rates,
                                 std::int64_t step) {
  const ParallelGeometry& g = scan.geometry;
  const std::int64_t U = g.columns, V = g.rows;
  const auto du = analysis_matrix(U), dv = transposed(analysis_matrix(V), V);
  // [view][rate], summed in the order of views: a build made twice says the same to the bit.
  std::vector<std::vector<double>> projection(at(g.views())), gold(at(g.views()));
  parallel_for((g.views() + step - 1) / step, {}, "amplitude", [&](std::int64_t i) {
    const std::int64_t k = i * step;
    const float* q = scan.samples.data() + k * U * V;
    std::vector<double> a(at(U * V)), b(at(U * V));  // [m][v], then [m][l]
    for (std::int64_t m = 0; m < U; ++m)
      for (std::int64_t u = 0; u < U; ++u)
        for (std::int64_t v = 0; v < V; ++v)
          a[at(m * V + v)] += du[at(m * U + u)] * static_cast<double>(q[u * V + v]);
    for (std::int64_t m = 0; m < U; ++m)
      for (std::int64_t v = 0; v < V; ++v)
        for (std::int64_t l = 0; l < V; ++l) b[at(m * V + l)] += dv[at(v * V + l)] * a[at(m * V + v)];
    const double c = std::cos(g.theta_rad[at(k)]), s = std::sin(g.theta_rad[at(k)]);
    std::vector<double> p(rates.size()), f(rates.size());
    std::vector<double> of_z(at(V));
    for (std::size_t r = 0; r < rates.size(); ++r) {
      for (std::int64_t l = 0; l < V; ++l)
        of_z[at(l)] = wave_error_of_axis(frequency(l, V, g.pitch_v) * grid.spacing[2] / rates[r]);
      for (std::int64_t m = 0; m < U; ++m) {
        const double wu = frequency(m, U, g.pitch_u), eu = 1 - std::cos(wu * g.pitch_u / rates[r] / 2),
                     of_x = wave_error_of_axis(wu * c * grid.spacing[0] / rates[r]),
                     of_y = wave_error_of_axis(wu * s * grid.spacing[1] / rates[r]);
        for (std::int64_t l = 0; l < V; ++l) {
          const double magnitude = std::abs(b[at(m * V + l)]);
          p[r] += magnitude * eu;
          f[r] += magnitude * wave_error_bound_of({of_x, of_y, of_z[at(l)]});
        }
      }
    }
    projection[at(k)] = std::move(p);
    gold[at(k)] = std::move(f);
  });
  AmplitudeBounds out;
  const auto sum = [&](const std::vector<std::vector<double>>& by_view, std::size_t r) {
    double total = 0;
    for (const auto& view : by_view)
      if (!view.empty()) total += view[r];
    return total * share_of_views(g.views(), step);
  };
  for (std::size_t r = 0; r < rates.size(); ++r) {
    out.projection.emplace_back(rates[r], sum(projection, r));
    out.gold.emplace_back(rates[r], sum(gold, r));
  }
  return out;
}

}  // namespace vdvr
