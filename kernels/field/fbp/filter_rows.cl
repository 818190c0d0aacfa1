// The ramp filter of detector rows as a product with its Toeplitz matrix, of which only the taps are stored:
// q[k][u] = weight[k] * sum_j g[|u - j|] p[k][j], 16 rows in a vector (method: linear convolution,
// docs/geometry.md). Layouts: float in[view][v / 16][u][16]; float taps[offset + e] = g at the difference
// VDVR_STEP * (e + 1) - 1; out: as shared/chunks.h says, with a view for a batch; its columns count from
// detector column first_column, and those beyond the detector's edges are its mirror images. VDVR_STEP 2:
// every second tap is zero but the centre (Ram-Lak), so that a column sees only those of the other parity and
// itself. Sums run in runs of 16 terms that are then added. VDVR_DOUBLE 1: taps, weights and sums in double
// precision, rounded once, to the float that is stored. Called by host/field/fbp/filter_rows.cpp.
#include "device/lanes.h"
#include "shared/filter_rows.h"

#ifndef VDVR_STEP
#error "VDVR_STEP must be 1 (any kernel) or 2 (even taps are zero but the centre)"
#endif

// Eight columns share each vector of `in`. Named sums, not arrays: compilers keep these in registers.
#define FOR_COLUMNS(M) M(0) M(1) M(2) M(3) M(4) M(5) M(6) M(7)
#define ZERO(r) SUM total##r = (SUM)(0.0f);
#define CLEAR(r) SUM sum##r = (SUM)(0.0f);
#define ADD(r) sum##r = fma((SUM)(tap[r - n]), x, sum##r);
#define TOTAL(r) total##r += sum##r;
#if VDVR_STEP == 2
#define CENTRE(r) \
  total##r = fma((SUM)(centre), WIDE(LOAD(source + (size_t)min(i + 2 * r, columns - 1) * 16)), total##r);
#else
#define CENTRE(r)
#endif
// A column, and its images beyond the detector's edges.
#define PUT_AT(value, position)                                           \
  {                                                                       \
    const int c = (position)-first_column;                                \
    if (c >= 0 && c < out_columns) STORE(value, target + (size_t)c * 16); \
  }
#define PUT(r)                                                                   \
  if (i + VDVR_STEP * r < columns) {                                             \
    const int u = i + VDVR_STEP * r;                                             \
    const VEC value = NARROW(weight * total##r);                                 \
    if (!ALL(isfinite(value))) broken[k] = 1;                                    \
    PUT_AT(value, u)                                                             \
    if (first_column < 0) PUT_AT(value, -1 - u)                                  \
    if (first_column + out_columns > columns) PUT_AT(value, 2 * columns - 1 - u) \
  }

__kernel void filter_rows(__global float* out, __global int* broken, __global const float* in,
                          __global const REAL* taps, __global const REAL* weights, REAL centre,
                          VdvrFilteredRows shape) {
  // Copies, which no store can be taken to change.
  const int columns = shape.columns, z_padded = shape.z_padded, first_column = shape.first_column,
            out_columns = shape.out_columns;
  const int z = (int)get_global_id(0) * VDVR_LANES;
  const int group = (int)get_global_id(1), k = (int)get_global_id(2);
  const int i = group / VDVR_STEP * (8 * VDVR_STEP) + group % VDVR_STEP;
  if (z >= z_padded || i >= columns || k >= shape.views) return;
  __global const float* source = in + ((size_t)k * (z_padded / 16) + z / 16) * columns * 16 + z % 16;
  // The first column seen; tap[r - n] is that between column i + STEP r and the n-th one seen.
  const int first_seen = VDVR_STEP == 2 ? 1 - i % 2 : 0;
  const int seen = (columns - first_seen + VDVR_STEP - 1) / VDVR_STEP;
  __global const REAL* tap = taps + shape.offset + (i - first_seen - (VDVR_STEP - 1)) / VDVR_STEP;
  FOR_COLUMNS(ZERO)
  for (int first = 0; first < seen; first += 16) {
    const int last = min(first + 16, seen);
    FOR_COLUMNS(CLEAR)
    for (int n = first; n < last; ++n) {
      const SUM x = WIDE(LOAD(source + (size_t)(first_seen + VDVR_STEP * n) * 16));
      FOR_COLUMNS(ADD)
    }
    FOR_COLUMNS(TOTAL)
  }
  FOR_COLUMNS(CENTRE)
  const SUM weight = (SUM)(weights[k]);
  __global float* target =
      out + shape.out.first + (size_t)k * shape.out.batch + (size_t)(z / 16) * shape.out.chunk + z % 16;
  FOR_COLUMNS(PUT)
}
