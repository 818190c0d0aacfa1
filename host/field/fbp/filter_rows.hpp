// The ramp filter of detector rows, in ways that agree to rounding: zero-padded FFTs (clFFT), or the product
// with the kernel's Toeplitz matrix, which is faster for short rows on CPUs. In fp32, or in double precision
// and then rounded once, to the sample that is stored. FFTs on the host stand in where the device has no
// double precision.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/base/opencl/fft.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

enum class FilterMethod { automatic, fourier, product, host };

using fft::Precision;

/// float values[z / 16][view][column][16] on the device: `count` columns from detector column `first`, which
/// may be negative (mirrored about the outer edges, once), of the detector rows `rows`.
struct DeviceColumns {
  opencl::DeviceArray<float>* values = nullptr;
  std::int64_t first = 0, count = 0;
  std::span<const std::int64_t> rows;
};

/// q[view][u][v] = weight[view] * sum_m kernel[|u - m|] rows[view][v][m], the linear convolution.
class RowFilter {
 public:
  virtual ~RowFilter() = default;
  /// Cost: views * rows FFTs of twice the columns, or views * rows * columns^2 multiply-adds (half of them
  /// for a ramp without window). Memory on the device: about 64 MiB, or one view.
  virtual void operator()(std::span<const float> rows, std::span<const double> weights, std::span<float> out,
                          const Progress& progress) = 0;
  /// The same values, put where the back-projection reads them without a round trip through the host. False,
  /// with nothing done, where the method cannot. Throws InputError for a view that is not finite.
  virtual bool to_device(std::span<const float> rows, std::span<const double> weights,
                         const DeviceColumns& target, const Progress& progress) = 0;
  /// A bound on the error of the samples of a view, from its weight, the largest 2-norm of its rows and the
  /// largest of its stored samples (docs/error-bounds.md, section 7). Samples below 2^-126 may be flushed
  /// besides.
  [[nodiscard]] virtual double error(double weight, double row_norm, double largest) const = 0;
};

/// What a view is refused with whose line integrals overflow fp32.
InputError not_finite(std::int64_t view);

/// Whether the device can be given FilterMethod::fourier: GPUs up to what clFFT makes one kernel of.
bool has_transform(const DeviceInfo& device, std::int64_t columns, Precision precision);

/// `kernel`: g[0 .. columns - 1] of an even kernel. `automatic` takes what the device's tuning says, products
/// where it has no transform, and the host where the device lacks the precision.
std::unique_ptr<RowFilter> make_row_filter(opencl::State& state, const ParallelGeometry& geometry,
                                           const std::vector<double>& kernel, FilterMethod method,
                                           Precision precision);

}  // namespace vdvr
