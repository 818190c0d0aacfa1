// The pieces of the ramp filter around the FFT along u: zero-padding, the product with the kernel's real
// spectrum, and the crop that turns rows [view][v][u] into columns [view][u][v] with v contiguous, or into
// columns that are cut along v (shared/chunks.h), as back-projection reads them (method: linear convolution,
// docs/geometry.md). VDVR_DOUBLE 1: in double precision, rounded once, to the float that is stored. Called by
// host/field/fbp/filter_rows.cpp.
#include "shared/filter_rows.h"

#ifndef VDVR_DOUBLE
#error "VDVR_DOUBLE must be 0 or 1"
#endif
#if VDVR_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#define REAL double
#define REAL2 double2
#else
#define REAL float
#define REAL2 float2
#endif

__kernel void pad_rows(__global REAL* padded, __global const float* rows, int columns, int length,
                       int count) {
  const int i = (int)get_global_id(0), r = (int)get_global_id(1);
  if (i >= length || r >= count) return;
  padded[(size_t)r * length + i] = i < columns ? rows[(size_t)r * columns + i] : 0;
}

__kernel void multiply_spectrum(__global REAL2* spectrum, __global const REAL* filter, int bins, int count) {
  const int i = (int)get_global_id(0), r = (int)get_global_id(1);
  if (i >= bins || r >= count) return;
  spectrum[(size_t)r * bins + i] *= filter[i];
}

__kernel void crop_transposed(__global float* columns_out, __global const REAL* padded,
                              __global const REAL* weights, int columns, int rows, int length, int views) {
  const int v = (int)get_global_id(0), u = (int)get_global_id(1), k = (int)get_global_id(2);
  if (v >= rows || u >= columns || k >= views) return;
  columns_out[((size_t)k * columns + u) * rows + v] =
      (float)(weights[k] * padded[((size_t)k * rows + v) * length + u]);
}

// `rows` of `height` to a view; those beyond, to z_padded, are 0. As filter_rows.cl: columns beyond the
// detector's edges are its mirror images.
__kernel void crop_to_chunks(__global float* out, __global int* broken, __global const REAL* rows,
                             __global const REAL* weights, int height, int length, VdvrFilteredRows shape) {
  const int z = (int)get_global_id(0), c = (int)get_global_id(1), k = (int)get_global_id(2);
  if (z >= shape.z_padded || c >= shape.out_columns || k >= shape.views) return;
  const int at = shape.first_column + c;
  const int u = at < 0 ? -1 - at : at >= shape.columns ? 2 * shape.columns - 1 - at : at;
  float value = 0.0f;
  if (z < height) value = (float)(weights[k] * rows[((size_t)k * height + z) * length + u]);
  if (!isfinite(value)) broken[k] = 1;
  out[shape.out.first + (size_t)k * shape.out.batch + (size_t)(z / 16) * shape.out.chunk + (size_t)c * 16 +
      z % 16] = value;
}
