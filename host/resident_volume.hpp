// What ResidentVolume holds on the device, and how tiles are regrouped into one 3D image.
//
// Atlas: image texel[z][y][x] of CL_R / CL_FLOAT. The base volume lies at (0, 0, 0). The tiles of a triple
// stand on one another along z in columns of sx x sy texels; because a triple's tiles are contiguous in the
// sample buffer, one buffer-to-image copy fills a column. Columns of one triple fill shelves along x; shelves
// follow one another along y, below the base. Called by: raycast.cpp, verify.cpp (samples, bricks, grid).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/brick_layout.hpp"
#include "host/opencl/array.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// What a device allows for the atlas; tests pass small ones.
struct ImageLimits {
  bool linear_float = false;
  std::array<std::uint64_t, 3> size{0, 0, 0};  ///< texels, x, y, z
  std::uint64_t bytes = 0;                     ///< of one image
};
ImageLimits image_limits(const DeviceInfo& info, std::uint64_t memory_left);

/// The columns of one triple's tiles.
struct AtlasShelves {
  std::array<std::uint64_t, 3> tile{1, 1, 1};  ///< texels, x, y, z
  std::uint64_t first_y = 0;                   ///< of its first shelf
  std::uint64_t columns_per_shelf = 1, tiles_per_column = 1, tiles = 0;

  /// Texel of tile i's first sample.
  [[nodiscard]] std::array<std::uint64_t, 3> origin(std::uint64_t i) const {
    const std::uint64_t column = i / tiles_per_column;
    return {column % columns_per_shelf * tile[0], first_y + column / columns_per_shelf * tile[1],
            i % tiles_per_column * tile[2]};
  }
};

struct AtlasLayout {
  bool fits = false;
  std::string reason;                          ///< why it does not, or its size
  std::array<std::uint64_t, 3> size{0, 0, 0};  ///< texels, x, y, z
  std::map<LevelTriple, AtlasShelves> shelves;
  [[nodiscard]] std::uint64_t bytes() const { return size[0] * size[1] * size[2] * sizeof(float); }
};
/// The smallest atlas found within the limits. Host only; microseconds to milliseconds.
AtlasLayout pack_atlas(const MixedVolume& volume, const ImageLimits& limits);

/// Distance of each brick, in bricks (largest axis), to the nearest one with occupied != 0; 0 there, at most
/// 255. [bz][by][bx].
std::vector<std::uint8_t> distance_to_occupied(const std::vector<std::uint8_t>& occupied,
                                               const Index3& bricks);

struct ResidentVolume::Impl {
  Impl(Device& device, const MixedVolume& volume, const ImageLimits& limits);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// The atlas, built on first use. Throws ResourceError when the device has no room for it any more.
  const cl::Image3D& atlas();
  [[nodiscard]] std::uint64_t bytes() const;  ///< on the device, between frames

  opencl::State* state;
  Grid grid;
  VdvrGrid sampler_grid;
  opencl::DeviceArray<float> samples;     ///< host/brick_layout.hpp
  opencl::DeviceArray<VdvrBrick> bricks;  ///< [bz][by][bx]
  opencl::DeviceArray<cl_float2> ranges;  ///< [bz][by][bx] min, max over the samples of the closed brick
  std::vector<cl_float2> host_ranges;     ///< the same
  std::pair<float, float> value_range{0, 0};
  AtlasLayout layout;

  /// Kept between frames so that a frame allocates nothing but its picture.
  struct FrameCache {
    opencl::DeviceArray<cl_float4> picture, table;
    opencl::DeviceArray<cl_uint> row_samples;
    opencl::DeviceArray<cl_uchar> distance;
    std::vector<float> distance_key;  ///< what `distance` was computed for
    std::vector<cl_float4> table_values;
  } frame;

 private:
  std::map<LevelTriple, std::uint64_t> offsets_;
  std::optional<cl::Image3D> atlas_;
};

}  // namespace vdvr
