// Programs as their compiler left them, kept for the next process in the cache folder
// (host/system/cache_files.hpp), by what they were made of: source, options, device, driver and version. For
// platforms that keep none themselves; VDVR_KERNEL_CACHE=on or off says otherwise. Called by program.cpp.
#pragma once

#include <optional>
#include <string>

#include "host/opencl/state.hpp"

namespace vdvr::opencl {

/// The program, built, or nothing: unknown, damaged, or not taken by the device.
std::optional<cl::Program> kept_program(const State& state, const std::string& source,
                                        const std::string& options);
/// Keeps a program that was built of its source. What fails leaves it to be built again.
void keep_program(const State& state, const std::string& source, const std::string& options,
                  const cl::Program& built) noexcept;

}  // namespace vdvr::opencl
