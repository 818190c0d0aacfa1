// A block of samples times a matrix along one of its axes: cosine analysis, derivatives.
#pragma once

#include <cstdint>
#include <span>

#include "host/base/opencl/array.hpp"
#include "host/base/opencl/kernel.hpp"
#include "shared/axis_product.h"

namespace vdvr {

/// matrix[j * n + m] of the n x n matrix with exact[m * n + j]: what AxisProduct takes.
opencl::DeviceArray<float> transposed_on_device(opencl::State& state, std::span<const double> exact,
                                                std::int64_t n);

class AxisProduct {
 public:
  explicit AxisProduct(opencl::State& state);
  /// float out[outer][n][inner] = the matrix times the middle axis of in[outer][n][inner]. Cost: n multiply-
  /// adds per element.
  void operator()(const opencl::DeviceArray<float>& out, const opencl::DeviceArray<float>& in,
                  const opencl::DeviceArray<float>& matrix, std::int64_t outer, std::int64_t n,
                  std::int64_t inner);

 private:
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrAxisProduct> kernel_;
};

}  // namespace vdvr
