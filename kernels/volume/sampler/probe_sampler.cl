// Measures the image3d sampler: what it returns at given texel coordinates, and how fast both samplers run.
// Called by: probe_sampler() in host/volume/sampler/probe_sampler.cpp. Calls: vdvr_sample_in_brick of
// mixed_sampler.h.
#include "shared/mixed_sampler.h"

// A device without images cannot compile image arguments.
#ifdef __IMAGE_SUPPORT__
// values[i] = the filtered image at points[i].xyz (texels, unnormalised).
__kernel void read_points(__read_only image3d_t image, __global const float4* restrict points, uint count,
                          __global float* restrict values) {
  const sampler_t linear = CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_LINEAR;
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  values[i] = read_imagef(image, linear, (float4)(points[i].x, points[i].y, points[i].z, 0.0f)).x;
}
#endif

// The walk of one work-item in a cube of `side` samples: `steps` positions along x from its own row, as a ray
// would.
VDVR_INLINE float3 walk_at(uint i, uint k, uint side, uint steps) {
  const float cells = (float)(side - 1);
  const float y = (float)(i % side) * (cells - 1.0f) / (float)side,
              z = (float)(i / side % side) * (cells - 1.0f) / (float)side;
  return (float3)((float)k * (cells - 1.0f) / (float)steps, y + 0.37f, z + 0.41f);
}

#ifdef __IMAGE_SUPPORT__
__kernel void rate_image(__read_only image3d_t image, uint side, uint count, uint steps,
                         __global float* restrict sums) {
  const sampler_t linear = CLK_NORMALIZED_COORDS_FALSE | CLK_ADDRESS_CLAMP_TO_EDGE | CLK_FILTER_LINEAR;
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  float sum = 0.0f;
  for (uint k = 0; k < steps; ++k) {
    const float3 c = walk_at(i, k, side, steps) + 0.5f;
    sum += read_imagef(image, linear, (float4)(c, 0.0f)).x;
  }
  sums[i] = sum;
}
#endif

__kernel void rate_buffer(__global const float* restrict samples, uint side, uint count, uint steps,
                          __global float* restrict sums) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  float sum = 0.0f;
  for (uint k = 0; k < steps; ++k) {
    const float3 c = walk_at(i, k, side, steps);
    // One brick of the whole cube, at level 0: the arithmetic of the certified field, without the index.
    const int cells = (int)side - 1;
    const VdvrBrick cube = {0, side, side * side, 0, 0, 0, 0, VDVR_F32, 1.0f, 0.0f};
    sum +=
        vdvr_sample_in_brick(samples, cube, vdvr_local(c.x, 0, 0, cells, cells, 0),
                             vdvr_local(c.y, 0, 0, cells, cells, 0), vdvr_local(c.z, 0, 0, cells, cells, 0));
  }
  sums[i] = sum;
}
