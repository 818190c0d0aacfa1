// The only includer of clFFT is fft.cpp: library lifetime, a plan cache, good lengths, errors with sizes.
// clfftBakePlan is not thread-safe and takes 1 to 3 s cold on a CPU; plans are baked under a lock and kept
// as long as their device.
#pragma once

#include <cstdint>

#include "host/base/opencl/state.hpp"

namespace vdvr::fft {

/// The smallest length >= n that clFFT takes and runs fast: 2^a, 3 * 2^a or 5 * 2^a.
std::int64_t good_length(std::int64_t n);

enum class Precision { fp32, fp64 };

/// The longest rows that one kernel of clFFT transforms. Of longer ones it makes several, which assign const
/// pointers to others: NVIDIA's compiler refuses them, as OpenCL C does; PoCL's does not.
constexpr std::int64_t longest_in_one_kernel(Precision precision) {
  return precision == Precision::fp64 ? 2048 : 4096;
}

/// Real to Hermitian along contiguous rows: T in[batch][length] -> T2 out[batch][length/2 + 1], T float or
/// double. Enqueues only.
void forward_real(opencl::State& state, Precision precision, std::int64_t length, std::int64_t batch,
                  const cl::Buffer& in, const cl::Buffer& out);

/// Hermitian to real, scaled by 1/length. `in` may be overwritten. Enqueues only.
void inverse_real(opencl::State& state, Precision precision, std::int64_t length, std::int64_t batch,
                  const cl::Buffer& in, const cl::Buffer& out);

}  // namespace vdvr::fft
