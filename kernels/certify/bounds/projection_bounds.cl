// The largest magnitudes of filtered projections or of their derivatives, of which global bounds are made
// (docs/error-bounds.md). Layout: float d[z / 16][view][column n][16]. Called by
// host/certify/bounds/projection_bounds.cpp.

#include "device/lanes.h"

// Maxima drop NaN: what is no number counts as infinite.
static inline VEC finite_or_infinite(VEC v) { return v <= (VEC)(FLT_MAX) ? v : (VEC)(INFINITY); }

// Largest |d| over the columns of VDVR_LANES rows: sup[view][z].
__kernel void row_sup(__global float* sup, __global const float* d, int views, int columns, int z_padded) {
  const int z = (int)get_global_id(0) * VDVR_LANES, k = (int)get_global_id(1);
  if (z >= z_padded || k >= views) return;
  __global const float* p = d + ((size_t)(z / 16) * views + k) * columns * 16 + z % 16;
  VEC largest = (VEC)(0.0f);
  for (int n = 0; n < columns; ++n) {
    const VEC size = fabs(LOAD(p + (size_t)n * 16));
    largest = fmax(largest, finite_or_infinite(size));
  }
  STORE(largest, sup + (size_t)k * z_padded + z);
}

// Rows become columns: out[n / 16][view][v][16] of d, z being v; columns beyond the last are 0.
__kernel void turn(__global float* out, __global const float* d, int views, int columns, int rows) {
  const int v = (int)get_global_id(0), chunk = (int)get_global_id(1), k = (int)get_global_id(2);
  if (v >= rows || k >= views || chunk * 16 >= columns) return;
  __global const float* p = d + ((size_t)(v / 16) * views + k) * columns * 16 + v % 16;
  __global float* target = out + (((size_t)chunk * views + k) * rows + v) * 16;
  for (int i = 0; i < 16; ++i) {
    const int n = chunk * 16 + i;
    target[i] = n < columns ? p[(size_t)n * 16] : 0.0f;
  }
}
