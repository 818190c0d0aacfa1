// What ResidentVolume holds on the device, and how tiles are regrouped into 3D images.
//
// Atlas: one image texel[z][y][x] per sample type, CL_R of CL_FLOAT, CL_UNORM_INT16 or CL_UNORM_INT8. The
// base volume lies at (0, 0, 0) of its type's. The tiles of a triple stand on one another along z in columns
// of sx x sy texels; because a triple's tiles are contiguous in the sample buffer, one buffer-to-image copy
// fills a column. Columns of one triple fill shelves along x; shelves follow one another along y, below the
// base. So tiles of any size fit any device's limits on each axis.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/volume/sampler/device_field.hpp"
#include "host/volume/sampler/lit_samples.hpp"
#include "vdvr/expert/resident_volume.hpp"

namespace vdvr {

/// What a device allows for the atlas; tests pass small ones.
struct ImageLimits {
  std::array<bool, 3> linear{false, false, false};  ///< by SampleType: readable with the linear filter
  std::array<std::uint64_t, 3> size{0, 0, 0};       ///< texels, x, y, z
  std::uint64_t image_bytes = 0;                    ///< of one image
  std::uint64_t bytes = 0;                          ///< of all
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
  std::string reason;  ///< why it does not, or its size
  /// Texels x, y, z of the image of each SampleType; 0 where the volume has no such samples.
  std::array<std::array<std::uint64_t, 3>, 3> size{};
  std::map<TileKind, AtlasShelves> shelves;  ///< in the image of the tiles' type
  [[nodiscard]] std::uint64_t bytes() const;
  /// The longest side of any image.
  [[nodiscard]] std::uint64_t longest() const;
};
/// The smallest atlas found within the limits. Host only; microseconds to milliseconds.
AtlasLayout pack_atlas(const MixedVolume& volume, const ImageLimits& limits);

/// Distance of each brick, in bricks (largest axis), to the nearest one of another class, at most 255; 0 for
/// bricks of class 0. [bz][by][bx].
std::vector<std::uint8_t> distance_to_other(const std::vector<std::uint8_t>& classes, const Index3& bricks);

/// Throws InputError for grids that cannot be drawn: 1 to 8192 cells an axis, spacings above 0.
void check_drawn_grid(const Grid& grid);

/// The atlas by SampleType; types that do not occur share another's image.
struct Atlas {
  std::array<cl::Image3D, 3> images;
  opencl::DeviceArray<std::uint32_t> bricks;  ///< records whose places are texels
};

/// What is said of all samples of a volume, whichever of them are on the device.
struct FieldFacts {
  std::vector<cl_float2> ranges;       ///< [bz][by][bx] min, max over the samples of the closed brick
  std::vector<std::uint8_t> has_tile;  ///< [bz][by][bx] 1: a level of its own, 0: reads the base
  std::pair<float, float> value_range{0, 0};
  float largest = 0;      ///< that a texel can decode to, in magnitude
  int highest_level = 0;  ///< of any brick and axis: log2 of samples per cell
};
/// Looks at every sample once.
FieldFacts facts_of(const MixedVolume& volume);

/// A volume with the tiles of some of its bricks: the others' records lead to other tiles of their triples.
struct VolumePart {
  MixedVolume volume;              ///< sizes, index and tables of what is here; its samples are not looked at
  std::vector<std::uint8_t> here;  ///< by brick 1: its tile is here
  std::function<void(std::span<std::uint8_t>)> fill;  ///< writes the sample buffer (brick_layout.hpp)
  std::shared_ptr<const FieldFacts> facts;            ///< of the whole volume
};

/// Whatever is const may be called from several threads: what is made on first use is made under a lock.
struct ResidentVolume::Impl {
  Impl(Device& device, const MixedVolume& volume, const ImageLimits& limits);
  /// `limits`: without images there is no atlas.
  Impl(opencl::State& state, const VolumePart& part, const ImageLimits& limits);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// Made on first use. Throws ResourceError when the device has no room for it any more.
  const Atlas& atlas() const;
  /// As DeviceField::defines, for kernels that read the atlas.
  [[nodiscard]] const opencl::Defines& atlas_defines() const { return atlas_defines_; }
  /// Samples with gradients, made on first use. Throws ResourceError when the device has no room for them.
  const LitSamples& lit() const;
  /// Whether they were made or would fit what is left.
  [[nodiscard]] bool lit_fits() const;
  /// [bz][by][bx] min, max over the samples of the closed brick; on the device from the first call on.
  const cl::Buffer& ranges() const;
  [[nodiscard]] std::uint64_t bytes() const;  ///< on the device

  opencl::State* state;
  Grid grid;
  std::shared_ptr<const FieldFacts> facts;
  const std::vector<cl_float2>& host_ranges = facts->ranges;  ///< what ranges() holds
  bool is_uniform = false;  ///< every brick reads a float32 base as fine as the grid
  AtlasLayout layout;
  LitLayout lit_layout;
  DeviceField field;

 private:
  void lay_atlas(const MixedVolume& volume, ImageLimits limits);
  void set_texels(const MixedVolume& volume, PackedRecords& records) const;
  void fill_image(const cl::Image3D& image, SampleType type) const;
  [[nodiscard]] std::array<cl::Image3D, 3> make_images() const;

  Index3 base_samples_{};
  std::map<TileKind, std::uint64_t> offsets_;
  std::map<TileKind, SampleType> types_;  ///< of the tiles; base under none
  std::uint64_t counted_ = 0;             ///< of the memory account, for facts
  std::vector<std::uint32_t> texel_records_;
  opencl::Defines atlas_defines_;

  mutable std::mutex lock_;  ///< of what follows
  mutable std::optional<Atlas> atlas_;
  mutable opencl::DeviceArray<cl_float2> ranges_;
  mutable std::optional<LitSamples> lit_;
};

}  // namespace vdvr
