// The casts between signed sizes, which arithmetic is done in, and the types that containers and kernels
// take; sizes are checked where they come in, here nothing is. And between degrees, which files have, and
// radians.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>

namespace vdvr {

/// An index of a container.
constexpr std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }
/// A number of elements or work-items.
constexpr std::uint64_t count(std::int64_t n) { return static_cast<std::uint64_t>(n); }
/// An argument of a kernel.
constexpr int to_int(std::int64_t n) { return static_cast<int>(n); }

inline constexpr double radians_per_degree = std::numbers::pi / 180,
                        degrees_per_radian = 180 / std::numbers::pi;

}  // namespace vdvr
