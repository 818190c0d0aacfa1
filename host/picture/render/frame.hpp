// What a renderer keeps on the device from one picture to the next, so that a turntable allocates and
// computes nothing twice: picture, transfer function, which bricks can be leapt over, bounds.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/picture/render/bake.hpp"
#include "host/volume/brick_layout.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// The field that a frame shows, whatever its samples are taken from.
struct DrawnField {
  opencl::State* state = nullptr;
  Grid grid;
  VdvrGrid bricks{};                          ///< as kernels take them
  std::span<const cl_float2> ranges;          ///< [bz][by][bx] least and greatest value
  std::pair<float, float> value_range{0, 0};  ///< of all samples
  int highest_level = 0;                      ///< of any brick and axis: log2 of samples per cell
  std::span<const std::uint8_t> has_tile;     ///< [bz][by][bx] 1: a level of its own; empty: not known
};

/// Of one field, whose ranges must outlive it.
class Frame {
 public:
  explicit Frame(const DrawnField& field) : field_(field) {}

  /// Brings all up to date for a picture; `slack` is how far a sample may leave the range of its brick.
  /// `base_first` makes the guide that VDVR_BASE_FIRST reads. Returns the transfer function's tables, empty
  /// for a slice. Throws ResourceError.
  const BakedTransfer& prepare(const RenderOptions& options, float slack, bool base_first = false);
  /// Throws InputError for another count than there are bricks.
  void set_bounds(std::span<const float> bounds);

  [[nodiscard]] const DrawnField& field() const { return field_; }
  /// The picture as it is shown, and the values of its pixels, made on the device; of colours, in all modes
  /// but integral. Enqueues: `image` and `values` say when it is there.
  void develop(const RenderOptions& options);
  [[nodiscard]] Image image(const RenderOptions& options) const;
  [[nodiscard]] FloatImage values(const RenderOptions& options) const;

  /// [y][x] as kernels/picture/render/raycast.cl writes it.
  [[nodiscard]] const opencl::DeviceArray<cl_float4>& picture() const { return picture_; }
  [[nodiscard]] const cl::Buffer& table() const { return table_.buffer(); }
  [[nodiscard]] const cl::Buffer& row_samples() const { return row_samples_.buffer(); }
  /// [bz][by][bx] bricks to the nearest one of another class (distance_to_other), or a guide
  /// (kernels/shared/raycast_params.h); of modes dvr and iso.
  [[nodiscard]] const cl::Buffer& distance() const { return distance_.buffer(); }
  [[nodiscard]] const cl::Buffer& bounds() const { return bounds_.buffer(); }
  [[nodiscard]] bool has_bounds() const { return bounds_.size() > 0; }
  /// Samples taken along the rays of the picture. Waits for it.
  [[nodiscard]] std::int64_t samples() const;

 private:
  void fit_picture(const RenderOptions& options);
  void bake_table(const RenderOptions& options);
  void update_distance(const RenderOptions& options, float slack, bool base_first);

  DrawnField field_;
  opencl::DeviceArray<cl_float4> picture_, table_;
  opencl::DeviceArray<cl_uchar4> rgb_;     ///< 3 to each 4 pixels, and
  opencl::DeviceArray<cl_float4> values_;  ///< 1 of kernels/picture/render/develop.cl
  opencl::DeviceArray<cl_uint> row_samples_;
  opencl::DeviceArray<cl_uchar> distance_;
  opencl::DeviceArray<float> bounds_;
  std::vector<float> distance_key_;  ///< what distance_ was computed for
  BakedTransfer baked_;              ///< what table_ holds
  std::vector<double> table_key_;    ///< what baked_ was made from
};

}  // namespace vdvr
