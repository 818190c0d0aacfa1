// Launcher of kernels/cosine_spectrum.cl: planes first (x, then y), then bundles of lines along z.
#include "host/cosine_spectrum.hpp"

#include <algorithm>

#include "host/cosine_series.hpp"
#include "host/opencl/kernel.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using opencl::DeviceArray;
constexpr std::int64_t kBlockSamples = std::int64_t{8} << 20;  // two such buffers: 64 MiB

std::uint64_t count(std::int64_t n) { return static_cast<std::uint64_t>(n); }

/// The analysis matrix, at[j][m].
DeviceArray<float> transposed_matrix(opencl::State& state, std::int64_t n) {
  const std::vector<double> a = analysis_matrix(n);
  const auto width = static_cast<std::size_t>(n);
  std::vector<float> at(a.size());
  for (std::size_t m = 0; m < width; ++m)
    for (std::size_t j = 0; j < width; ++j) at[j * width + m] = static_cast<float>(a[m * width + j]);
  return {state, std::span<const float>(at), "cosine matrix"};
}

class Axes {
 public:
  explicit Axes(opencl::State& state) : kernel_(state, "cosine_spectrum", "cosine_axis") {}
  /// [outer][n][inner]
  void operator()(const DeviceArray<float>& out, const DeviceArray<float>& in, const DeviceArray<float>& at,
                  std::int64_t outer, std::int64_t n, std::int64_t inner) {
    const auto i = [](std::int64_t v) { return static_cast<cl_int>(v); };
    const opencl::Range range = inner == 1
                                    ? opencl::Range{{count(n), 1, count(outer)}, {64, 1, 1}}
                                    : opencl::Range{{count(inner), count(n), count(outer)}, {64, 1, 1}};
    kernel_(range, out.buffer(), in.buffer(), at.buffer(), i(outer), i(n), i(inner));
  }

 private:
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> kernel_;
};

}  // namespace

void cosine_spectrum(Device& device, std::vector<float>& values, const Index3& size,
                     const Progress& progress) {
  const std::int64_t plane = size[0] * size[1], depth = size[2];
  if (size[0] < 1 || size[1] < 1 || depth < 1 || count(plane) * count(depth) != values.size())
    throw InputError(fmt::format("cosine spectrum: {} samples are not {} x {} x {}", values.size(), size[0],
                                 size[1], size[2]));
  opencl::State& state = device.state();
  Axes axis(state);
  const std::string stage = "spectrum";

  // Step 1: planes
  {
    const std::int64_t block = std::clamp<std::int64_t>(kBlockSamples / plane, 1, depth);
    DeviceArray<float> a(state, count(block * plane), "spectrum block"),
        b(state, count(block * plane), "spectrum block");
    const auto x = transposed_matrix(state, size[0]), y = transposed_matrix(state, size[1]);
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
  const auto matrix = transposed_matrix(state, depth);
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
