// The launcher of kernels/certify/bounds/error_map.cl.
#include "vdvr/expert/error_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/opencl/kernel.hpp"
#include "host/certify/bounds/wave_error.hpp"
#include "shared/error_map.h"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrFrequencies) == 44);

namespace {

void check_axis(const FrequencyAxis& axis) {
  constexpr std::int64_t most = 1 << 24;  // integers that fp32 holds exactly
  const double first = static_cast<double>(axis.first) * axis.step,
               last = static_cast<double>(axis.first + axis.count - 1) * axis.step;
  if (axis.count < 1 || axis.count > most || std::abs(axis.first) > most ||
      std::isinf(wave_error_of_axis(first)) || std::isinf(wave_error_of_axis(last)))
    throw InputError(
        fmt::format("error map: {} frequencies from {:.6g} to {:.6g} radians per sample; they have to lie "
                    "within [-pi, pi]",
                    axis.count, first, last));
}

}  // namespace

ErrorMap error_map(Device& device, const std::array<FrequencyAxis, 3>& axes, int rate) {
  if (rate < 1) throw InputError(fmt::format("error map: rate {}; the least is 1", rate));
  ErrorMap map;
  std::uint64_t entries = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    check_axis(axes[a]);
    map.size[a] = axes[a].count;
    const auto n = static_cast<std::uint64_t>(axes[a].count);
    if (n > UINT64_MAX / 16 / entries)
      throw ResourceError(fmt::format("error map: {} x {} x {} frequencies pass 2^64 bytes", axes[0].count,
                                      axes[1].count, axes[2].count));
    entries *= n;
  }
  // Rounding: kappa 2 u, sine 4 ulp, both doubled by the square, and three sums and products: below 64 u.
  constexpr double margin = 1 + 0x1p-17;
  std::vector<float> table;
  for (const auto& of_axes : wave_error_table())
    for (const double b : of_axes) table.push_back(static_cast<float>(b * (1 + 0x1p-23)));
  opencl::State& state = device.state();
  const opencl::DeviceArray<float> beyond(state, std::span<const float>(table), "bounds of the wave error");
  const opencl::DeviceArray<float> centre(state, entries, "error map"), bound(state, entries, "error map");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrFrequencies> kernel(
      state, "certify/bounds/error_map", "error_map",
      {{"VDVR_TABLE_STEPS", std::to_string(wave_error_steps)}});
  const auto n = [&](std::size_t a) { return static_cast<std::uint64_t>(axes[a].count); };
  const auto first = [&](std::size_t a) { return static_cast<cl_int>(axes[a].first); };
  const auto count = [&](std::size_t a) { return static_cast<cl_int>(axes[a].count); };
  const auto step = [&](std::size_t a) { return static_cast<cl_float>(axes[a].step / rate); };
  const VdvrFrequencies frequencies{.first_x = first(0),
                                    .first_y = first(1),
                                    .first_z = first(2),
                                    .count_x = count(0),
                                    .count_y = count(1),
                                    .count_z = count(2),
                                    .step_x = step(0),
                                    .step_y = step(1),
                                    .step_z = step(2),
                                    .exact_product = static_cast<cl_float>(kExactProduct),
                                    .margin = static_cast<cl_float>(margin)};
  kernel({{n(0), n(1), n(2)}, {64, 1, 1}}, centre.buffer(), bound.buffer(), beyond.buffer(), frequencies);
  opencl::finish(state, "error map");
  map.centre = centre.to_host();
  map.bound = bound.to_host();
  return map;
}

}  // namespace vdvr
