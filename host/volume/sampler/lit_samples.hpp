// Lit samples: the stored field on the device as float32, and behind all samples their gradients, 4 bytes
// each, in the layout of tiles (kernels/volume/sampler/lit_samples.cl). Each stands beside the next one along
// y. Made on the device from the field as it is stored. Read by packet_corners.h with VDVR_LIT.
#pragma once

#include <span>
#include <vector>

#include "host/volume/sampler/device_field.hpp"
#include "shared/lit_params.h"

namespace vdvr {

/// Of a value and a gradient, each beside the next one along y.
constexpr std::uint64_t lit_sample_bytes = 16;

/// Where lit samples lie; from levels alone. Host only.
class LitLayout {
 public:
  /// `here`: by brick 1 where its tile is there at all; empty: everywhere. The records of others lead to a
  /// tile of their triple, which has one here.
  explicit LitLayout(const MixedVolume& volume, std::span<const std::uint8_t> here = {});
  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  [[nodiscard]] std::uint64_t sample_bytes() const;  ///< of the array with values and gradients
  [[nodiscard]] std::uint64_t bytes() const;         ///< samples and records on the device
  /// Whether 31 bits number its samples and the words of its records, as kernels do.
  [[nodiscard]] bool is_addressable() const;
  /// No brick has a tile, and the base is as fine as the grid.
  [[nodiscard]] bool is_uniform() const { return is_uniform_; }

 private:
  friend class LitSamples;
  struct Block {
    VdvrLitBlock params;
    std::vector<std::uint32_t> bricks;  ///< of its tiles
  };
  std::vector<Block> blocks_;           ///< base first
  std::vector<std::uint32_t> records_;  ///< two words a brick (mixed_sampler.h)
  std::uint64_t samples_ = 0;
  bool is_uniform_ = false;
};

class LitSamples {
 public:
  /// `range`: width of the field's values, which sets the unit of gradients: components up to half of it per
  /// smallest spacing fit, to 1/1022 of it; longer gradients keep their direction. Throws ResourceError.
  /// Cost: some tens of nanoseconds a sample and core.
  LitSamples(opencl::State& state, const DeviceField& field, const LitLayout& layout, const Grid& world,
             float range);
  [[nodiscard]] const cl::Buffer& samples() const { return samples_.buffer(); }
  [[nodiscard]] const cl::Buffer& bricks() const { return bricks_.buffer(); }
  /// `step` is the unit of gradients, per density and smallest spacing.
  [[nodiscard]] const VdvrGrid& grid() const { return grid_; }
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  opencl::DeviceArray<cl_uint> samples_;  ///< values, then gradients
  opencl::DeviceArray<std::uint32_t> bricks_;
  VdvrGrid grid_;
};

}  // namespace vdvr
