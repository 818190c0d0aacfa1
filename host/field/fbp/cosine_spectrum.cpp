// Cosine analysis axis by axis: planes first (x, then y), then bundles of lines along z.
#include "vdvr/expert/cosine_spectrum.hpp"

#include <algorithm>

#include "host/base/system/casts.hpp"
#include "host/field/fbp/axis_product.hpp"
#include "host/field/fbp/cosine_series.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using opencl::DeviceArray;
constexpr std::int64_t kBlockSamples = std::int64_t{8} << 20;  // two such buffers: 64 MiB

}  // namespace

void cosine_spectrum(Device& device, std::vector<float>& values, const Index3& size,
                     const Progress& progress) {
  const std::int64_t plane = size[0] * size[1], depth = size[2];
  if (size[0] < 1 || size[1] < 1 || depth < 1 || count(plane) * count(depth) != values.size())
    throw InputError(fmt::format("cosine spectrum: {} samples are not {} x {} x {}", values.size(), size[0],
                                 size[1], size[2]));
  opencl::State& state = device.state();
  AxisProduct axis(state);
  const auto analysis = [&](std::int64_t n) { return transposed_on_device(state, analysis_matrix(n), n); };
  const std::string stage = "spectrum";

  // Step 1: planes
  {
    const std::int64_t block = std::clamp<std::int64_t>(kBlockSamples / plane, 1, depth);
    DeviceArray<float> a(state, count(block * plane), "spectrum block"),
        b(state, count(block * plane), "spectrum block");
    const auto x = analysis(size[0]), y = analysis(size[1]);
    for (std::int64_t z = 0; z < depth; z += block) {
      const std::int64_t planes = std::min(block, depth - z);
      const std::span<float> slab(values.data() + z * plane, static_cast<std::size_t>(planes * plane));
      a.write(slab);
      axis(b, a, x, planes * size[1], size[0], 1);
      axis(a, b, y, planes, size[1], size[0]);
      a.read(slab);
      report(progress, stage, 0.6 * static_cast<double>(z + planes) / static_cast<double>(depth));
    }
  }
  if (depth == 1) return;

  // Step 2: lines along z
  const std::int64_t bundle = std::clamp<std::int64_t>(kBlockSamples / depth, 1, plane);
  DeviceArray<float> a(state, count(bundle * depth), "spectrum block"),
      b(state, count(bundle * depth), "spectrum block");
  const auto matrix = analysis(depth);
  std::vector<float> lines(static_cast<std::size_t>(bundle * depth));
  for (std::int64_t first = 0; first < plane; first += bundle) {
    const std::int64_t n = std::min(bundle, plane - first);
    const std::span<float> used(lines.data(), static_cast<std::size_t>(n * depth));
    for (std::int64_t z = 0; z < depth; ++z)
      std::copy_n(values.begin() + z * plane + first, n, used.begin() + z * n);
    a.write(used);
    axis(b, a, matrix, 1, depth, n);
    b.read(used);
    for (std::int64_t z = 0; z < depth; ++z)
      std::copy_n(used.begin() + z * n, n, values.begin() + z * plane + first);
    report(progress, stage, 0.6 + 0.4 * static_cast<double>(first + n) / static_cast<double>(plane));
  }
}

}  // namespace vdvr
