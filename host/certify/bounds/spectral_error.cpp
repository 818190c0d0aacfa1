#include "vdvr/expert/spectral_error.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/field/fbp/filter_projections.hpp"

namespace vdvr {

FilteredView strongest_view(Device& device, const ProjectionSet& scan, const FieldOptions& field,
                            const Progress& progress) {
  const FilteredScan filtered = filter_projections(device.state(), scan, field, progress);
  const std::int64_t U = scan.geometry.columns, V = scan.geometry.rows, size = U * V;
  FilteredView out{0, U, V, {}, 0};
  double most = -1;
  for (std::int64_t k = 0; k < scan.geometry.views(); ++k) {
    double energy = 0;
    for (std::int64_t i = 0; i < size; ++i)
      energy += std::pow(static_cast<double>(filtered.samples[static_cast<std::size_t>(k * size + i)]), 2);
    if (energy > most) {
      most = energy;
      out.view = k;
    }
  }
  // [u][v] to [v][u]
  out.samples.resize(static_cast<std::size_t>(size));
  for (std::int64_t u = 0; u < U; ++u)
    for (std::int64_t v = 0; v < V; ++v) {
      const float q = filtered.samples[static_cast<std::size_t>(out.view * size + u * V + v)];
      out.samples[static_cast<std::size_t>(v * U + u)] = q;
      out.largest = std::max(out.largest, static_cast<double>(std::abs(q)));
    }
  return out;
}

FrequencyAxis cosine_axis(std::int64_t n) { return {0, n, std::numbers::pi / static_cast<double>(n)}; }

double amplitude_sum(Device& device, const std::vector<float>& spectrum, const Index3& size, int rate) {
  constexpr std::int64_t slab_entries = std::int64_t{4} << 20;
  const std::int64_t plane = size[0] * size[1],
                     slab = std::clamp<std::int64_t>(slab_entries / plane, 1, size[2]);
  double sum = 0;
  for (std::int64_t first = 0; first < size[2]; first += slab) {
    const std::int64_t planes = std::min(slab, size[2] - first);
    FrequencyAxis z = cosine_axis(size[2]);
    z.first = first;
    z.count = planes;
    const ErrorMap map = error_map(device, {cosine_axis(size[0]), cosine_axis(size[1]), z}, rate);
    for (std::size_t i = 0; i < map.bound.size(); ++i)
      sum += static_cast<double>(std::abs(spectrum[static_cast<std::size_t>(first * plane) + i])) *
             static_cast<double>(map.bound[i]);
  }
  return sum;
}

}  // namespace vdvr
