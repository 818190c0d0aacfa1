// Frames of a D2vrScene, and what the classes hold on the device.
#pragma once

#include <optional>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/field/fbp/coverage.hpp"
#include "host/picture/render/raycast.hpp"
#include "shared/d2vr_params.h"
#include "vdvr/expert/d2vr.hpp"

namespace vdvr {

/// Its ranges are the scene's.
DrawnField drawn_field(const D2vrScene& scene);
/// `frame` is of the scene's drawn_field().
Enqueued enqueue_frame(Frame& frame, const D2vrScene& scene, const RenderOptions& options,
                       const RaycastTuning& tuning = {});
FloatPicture raycast_float(const D2vrScene& scene, const RenderOptions& options,
                           const RaycastTuning& tuning = {});

/// [bz][by][bx] least and greatest value that a brick of `granularity` cells is taken to have (d2vr.hpp).
std::vector<cl_float2> occupied_ranges(const Volume& samples, int granularity);

struct D2vrField::Impl {
  /// What kernels take for cell coordinates of `grid`.
  [[nodiscard]] VdvrDetector detector(const Grid& grid) const;
  [[nodiscard]] std::vector<cl_float4> views(const Grid& grid) const;

  opencl::State* state = nullptr;
  ParallelGeometry geometry;  ///< with the centre in use
  std::optional<Coverage> coverage;
  int rate = 1;
  double first_column = 0, first_row = 0;  ///< where stored column and row 0 lie, detector pixels
  std::int64_t columns = 0, rows = 0;      ///< stored
  opencl::DeviceArray<float> samples;      ///< [view][column][row]
};

}  // namespace vdvr
