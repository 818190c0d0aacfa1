// A stored field on the device: sample buffer, brick records, and what kernels must be compiled for to read
// them. Read by mixed_sampler.h.
#pragma once

#include <functional>
#include <memory>
#include <span>

#include "host/base/opencl/array.hpp"
#include "host/volume/brick_layout.hpp"

namespace vdvr {

/// VDVR_SAMPLE_TYPES and VDVR_RECORDS: what kernels that read this volume through such records are compiled
/// for.
opencl::Defines field_defines(const MixedVolume& volume, RecordKind records);

/// What no place of a stored sample is above, places counting samples of a tile's own type.
std::uint64_t highest_place(const MixedVolume& volume);

struct DeviceField {
  /// In `scratch`, where that is given and the device computes in the host's memory.
  DeviceField(opencl::State& state, const MixedVolume& volume,
              const std::shared_ptr<Scratch>& scratch = nullptr);
  DeviceField(opencl::State& state, const MixedVolume& volume, const PackedRecords& records,
              const std::shared_ptr<Scratch>& scratch = nullptr);
  /// The samples are written by `fill`, into all of the buffer.
  DeviceField(opencl::State& state, const MixedVolume& volume, const PackedRecords& records,
              const std::function<void(std::span<std::uint8_t>)>& fill);
  opencl::DeviceArray<std::uint8_t> samples;  ///< host/volume/brick_layout.hpp
  opencl::DeviceArray<std::uint32_t> bricks;  ///< [bz][by][bx][words]
  VdvrGrid grid;
  opencl::Defines defines;  ///< field_defines()
  std::uint64_t highest_place = 0;
};

/// VDVR_COARSE_X, _Y, _Z, for kernels that read bricks through packet_sampler.h.
opencl::Defines coarse_defines(const VdvrGrid& grid);

}  // namespace vdvr
