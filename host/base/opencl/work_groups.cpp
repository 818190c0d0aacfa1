#include "host/base/opencl/work_groups.hpp"

#include <algorithm>
#include <bit>
#include <string>

#include "host/base/opencl/column_tuning.hpp"

namespace vdvr::opencl {

int lanes_of(const DeviceInfo& device, int most) {
  const int tuned = std::min(column_tuning(device).lanes, most);
  return tuned >= 16 ? 16 : tuned >= 8 ? 8 : tuned >= 4 ? 4 : 1;
}

int items_along(const DeviceInfo& device) { return device.is_gpu ? 32 : 1; }

Defines height_defines(const DeviceInfo& device, int most) {
  return {{"VDVR_LANES", std::to_string(lanes_of(device, most))},
          {"VDVR_ALONG", std::to_string(items_along(device))}};
}

Range in_groups(const DeviceInfo& device, const std::array<std::uint64_t, 3>& global,
                const std::array<std::uint64_t, 3>& elsewhere, std::size_t axis) {
  if (!device.is_gpu) return {global, elsewhere};
  std::array<std::uint64_t, 3> local{1, 1, 1};
  std::uint64_t left = 64;
  const auto give = [&](std::size_t a, std::uint64_t most) {
    local[a] = std::min({left, most, std::bit_ceil(std::max<std::uint64_t>(global[a], 1))});
    left /= local[a];
  };
  give(axis, 32);
  for (std::size_t a = 0; a < 3; ++a)
    if (a != axis) give(a, left);
  return {global, local};
}

Range shared_groups(const DeviceInfo& device, const std::array<std::uint64_t, 3>& groups) {
  const auto along = static_cast<std::uint64_t>(items_along(device));
  return {{along * groups[0], groups[1], groups[2]}, {along, 1, 1}};
}

cl::LocalSpaceArg shared_room(const DeviceInfo& device) {
  return cl::Local(static_cast<std::size_t>(items_along(device)) * sizeof(cl_int));
}

}  // namespace vdvr::opencl
