// How kernels that carry heights are built and launched, by device class: one rule for all of them, which
// never changes what they compute.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "host/base/opencl/kernel.hpp"

namespace vdvr::opencl {

/// Heights that a work-item carries: what is tuned, or as many of 16, 8, 4 and 1 as `most` allows.
int lanes_of(const DeviceInfo& device, int most);

/// Work-items of a work-group that shares a column, a row or a brick: 1 on a CPU, which then needs no
/// barrier.
int items_along(const DeviceInfo& device);

/// VDVR_LANES and VDVR_ALONG (kernels/device/lanes.h, shared_column.h).
Defines height_defines(const DeviceInfo& device, int most);

/// `global`, in the device's groups. On a GPU memory is read in lines by work-items side by side: 32 of them
/// along `axis`, along which neighbours lie in memory, and 64 in all where the ranges have so many. Elsewhere
/// work-items are loops, in groups of `elsewhere`.
Range in_groups(const DeviceInfo& device, const std::array<std::uint64_t, 3>& global,
                const std::array<std::uint64_t, 3>& elsewhere = {1, 1, 1}, std::size_t axis = 0);

/// Groups that share, one after the other along each axis.
Range shared_groups(const DeviceInfo& device, const std::array<std::uint64_t, 3>& groups);

/// Where they meet: the last argument of their kernel (SHARED_ROOM).
cl::LocalSpaceArg shared_room(const DeviceInfo& device);

}  // namespace vdvr::opencl
