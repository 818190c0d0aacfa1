#include "host/certify/kept/base_of_gold.hpp"

#include <algorithm>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fbp/back_project.hpp"

namespace vdvr {
namespace {

// Of the samples of some rows, on their way.
constexpr std::uint64_t band_bytes = std::uint64_t{32} << 20;

}  // namespace

Volume base_of_gold(opencl::State& state, KeptGold& kept, const Coverage& coverage, const Grid& grid,
                    double margin, const Progress& progress) {
  const Index3 n = grid.samples();
  const GoldLattice lattice = kept.lattice(grid, 1);
  kept.prepare(lattice, {{{0, 0, 0}, n}}, progress);
  Volume out;
  out.grid = grid;
  out.samples.assign(at(n[0] * n[1] * n[2]), 0.0f);
  const std::int64_t stride = column_stride(n[2]);
  const auto rows =
      std::clamp<std::int64_t>(static_cast<std::int64_t>(band_bytes / 4) / (n[0] * stride), 1, n[1]);
  const opencl::DeviceArray<float> band(state, count(rows * n[0] * stride), "base samples");
  for (std::int64_t y0 = 0; y0 < n[1]; y0 += rows) {
    const std::int64_t ny = std::min(rows, n[1] - y0);
    kept.fill(lattice, GoldBox{{0, y0, 0}, {n[0], ny, n[2]}}, band, 0, stride);
    const std::vector<float> found = band.to_host();
    parallel_for(n[2], {}, "", [&](std::int64_t z) {
      if (coverage.margin_z(grid.position({0, 0, z})[2]) < -4 * grid.spacing[2]) return;
      for (std::int64_t y = 0; y < ny; ++y)
        for (std::int64_t x = 0; x < n[0]; ++x) {
          const Vec3 p = grid.position({x, y0 + y, z});
          if (coverage.margin_above(p[0], p[1], -margin) < -margin) continue;
          out.samples[at((z * n[1] + y0 + y) * n[0] + x)] = found[at((y * n[0] + x) * stride + z)];
        }
    });
  }
  return out;
}

}  // namespace vdvr
