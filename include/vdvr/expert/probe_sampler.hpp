// How a device reads a stored field: in fp32 arithmetic from a buffer, or by the texture unit from an image,
// and what that unit was found to do.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

enum class SamplerKind { automatic, image3d, buffer };

/// What the device's filter of one image format does to weights and constants (docs/error-bounds.md, section
/// on samplers).
struct FilterProbe {
  bool image3d = false;  ///< the device has a linear CL_R 3D image sampler of this format
  /// What a value was found to err by, over the sum of the cell's steps along the three axes: the largest.
  double weight_error = 0;
  double delta = 0;  ///< charged: 2^-22 fp32, 2^-9 rounding to 8 bits, 2^-8 truncation, else 1.1 measured;
                     ///< never below weight_error
  /// What a value is charged, by the steps of samples along the axes: 1 on those whose bit is set in the
  /// index, 1/2 on the others. [0]: 0.
  std::array<double, 8> by_steps{};
  /// Of steps along the axes, those of more than half of the largest, a bit each.
  template <class Real>
  [[nodiscard]] static std::size_t above_half(const std::array<Real, 3>& steps) {
    const Real half = std::max({steps[0], steps[1], steps[2]}) / 2;
    return std::size_t{steps[0] > half} | std::size_t{steps[1] > half} << 1 |
           std::size_t{steps[2] > half} << 2;
  }
  /// What a value is charged in a cell whose samples differ by at most `steps` along each axis.
  [[nodiscard]] double of_steps(const std::array<double, 3>& steps) const {
    return std::max({steps[0], steps[1], steps[2]}) * by_steps[above_half(steps)];
  }
  /// rho: largest error on constant, affine and random tiles beyond that, relative to the largest sample, or
  /// to the format's whole scale where it is normalised.
  double constant_error = 0;
  /// Whether it errs by no more than fp32 does; the weights of texture units have few bits.
  [[nodiscard]] bool weighs_in_fp32() const { return delta <= 0x1p-22; }
};

/// The device's image3d sampler. What it inherits is that of CL_FLOAT.
struct SamplerProbe : FilterProbe {
  FilterProbe u16, u8;  ///< CL_UNORM_INT16, CL_UNORM_INT8
  [[nodiscard]] const FilterProbe& of(SampleType type) const {
    return type == SampleType::f32 ? *this : type == SampleType::u16 ? u16 : u8;
  }
  [[nodiscard]] double largest_constant_error() const {
    return std::max({constant_error, u16.constant_error, u8.constant_error});
  }
  double buffer_rate = 0, image3d_rate = 0;  ///< samples per second, measured
  std::string chosen;                        ///< "buffer" or "image3d": what `auto` takes, by those rates
  std::string note;  ///< the class that delta was charged for, or why there is no image3d sampler
};
/// Measured once per device and process (about a second, most of it for the rates). What certificates charge
/// is remembered in the cache folder, as the device's own test is (docs/robustness.md); rates are not.
VDVR_API SamplerProbe probe_sampler(Device& device);
/// What certificates charge. `chosen` is empty and rates are 0 unless they are known already.
VDVR_API SamplerProbe probe_filters(Device& device);

}  // namespace vdvr
