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
