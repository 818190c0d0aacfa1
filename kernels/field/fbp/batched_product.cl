// out[b][i][z] = sum_j a[b][i][j] v[b][j][z]: the dense products of cosine-series resampling (rows to the
// grid's z positions, columns to the upsampled positions in u, and their derivatives; docs/geometry.md).
// z-vectors are stored in chunks of 16 (shared/chunks.h), with i or j for the column. Sums run in runs of
// VDVR_RUN terms, and what adding a run to the others rounds off is summed beside them (Knuth's TwoSum,
// additions alone: nothing to contract): the rounding error is that of one run (docs/error-bounds.md, section
// 7). Called by host/field/fbp/batched_product.cpp.
#include "device/lanes.h"
#include "shared/batched_product.h"

#ifndef VDVR_RUN
#error "VDVR_RUN must be the terms of a run"
#endif

// Eight rows of `a` share each vector of `v`. Named sums, not arrays: compilers keep these in registers.
#define FOR_ROWS(M) M(0) M(1) M(2) M(3) M(4) M(5) M(6) M(7)
// Rows beyond the matrix repeat its last one and are not stored.
#define ROW(r)                                                                                         \
  __global const float* row##r = a + (size_t)b * shape.a_batch + (size_t)min(i + r, rows - 1) * terms; \
  VEC total##r = (VEC)(0.0f), rest##r = (VEC)(0.0f);
#define CLEAR(r) VEC sum##r = (VEC)(0.0f);
#define ADD(r) sum##r = fma((VEC)(row##r[j]), x, sum##r);
#define TOTAL(r)                                          \
  {                                                       \
    const VEC t = total##r + sum##r, part = t - total##r; \
    rest##r += (total##r - (t - part)) + (sum##r - part); \
    total##r = t;                                         \
  }
#define PUT(r) \
  if (i + r < rows) STORE(total##r + rest##r, target + r * 16);

__kernel void batched_product(__global float* out, __global const float* a, __global const float* v,
                              VdvrProduct shape) {
  // Copies, which no store can be taken to change.
  const int rows = shape.rows, terms = shape.terms;
  const int z = (int)get_global_id(0) * VDVR_LANES;
  const int i = (int)get_global_id(1) * 8;
  const int b = (int)get_global_id(2);
  if (z >= shape.z_padded || i >= rows || b >= shape.batches) return;
  __global const float* column =
      v + shape.v.first + (size_t)b * shape.v.batch + (size_t)(z / 16) * shape.v.chunk + z % 16;
  FOR_ROWS(ROW)
  for (int first = 0; first < terms; first += VDVR_RUN) {
    const int last = min(first + VDVR_RUN, terms);
    FOR_ROWS(CLEAR)
    for (int j = first; j < last; ++j) {
      const VEC x = LOAD(column + (size_t)j * 16);
      FOR_ROWS(ADD)
    }
    FOR_ROWS(TOTAL)
  }
  __global float* target = out + shape.out.first + (size_t)b * shape.out.batch +
                           (size_t)(z / 16) * shape.out.chunk + (size_t)i * 16 + z % 16;
  FOR_ROWS(PUT)
}
