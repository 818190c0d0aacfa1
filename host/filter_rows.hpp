// The ramp filter of detector rows, two ways that agree to rounding: zero-padded FFTs (clFFT), or the product
// with the kernel's Toeplitz matrix, which is faster for short rows on CPUs. Called by
// filter_projections.cpp.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "host/opencl/state.hpp"
#include "vdvr/progress.hpp"
#include "vdvr/projections.hpp"

namespace vdvr {

enum class FilterMethod { automatic, fourier, product };

/// q[view][u][v] = weight[view] * sum_m kernel[|u - m|] rows[view][v][m], the linear convolution.
class RowFilter {
 public:
  virtual ~RowFilter() = default;
  /// Cost: views * rows FFTs of twice the columns, or views * rows * columns^2 multiply-adds. Memory on the
  /// device: about 64 MiB, or one view.
  virtual void operator()(std::span<const float> rows, std::span<const float> weights, std::span<float> out,
                          const Progress& progress) = 0;
  /// A bound on the error of a filtered sample before the weight, from the row's 2-norm
  /// (docs/error-bounds.md, section 7); the weight's two roundings are in it.
  [[nodiscard]] virtual double error(double row_norm) const = 0;
};

/// `kernel`: g[0 .. columns - 1] of an even kernel. `automatic` takes what the device's tuning says.
std::unique_ptr<RowFilter> make_row_filter(opencl::State& state, const ParallelGeometry& geometry,
                                           const std::vector<double>& kernel, FilterMethod method);

}  // namespace vdvr
