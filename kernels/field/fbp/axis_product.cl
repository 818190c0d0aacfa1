// One axis of a block times a matrix: out[o][m][i] = sum_j a[m][j] in[o][j][i], with `a` the analysis or
// derivative matrix of host/field/fbp/cosine_series.hpp, stored transposed (float at[j][m]). Called by
// host/field/fbp/axis_product.cpp in this form, one for both the fast axis and the others:
//   out[b][r][c] = sum_j s[r][j] v[b][j][c], c contiguous in out and v.
// Any other axis: b = o, r = m, c = i, s = at, v = in. The fast axis (no i): one batch, r = o, c = m, s = in,
// v = at. A work-item does 16 columns of 4 rows, so that each vector it reads is used four times. Sums run in
// runs of 32 terms, as in kernels/field/fbp/batched_product.cl, for rounding.
#include "shared/axis_product.h"

// The last columns, fewer than 16.
static inline float element(__global const float* s, __global const float* v, int terms, int columns,
                            int s_term) {
  float total = 0.0f;
  for (int first = 0; first < terms; first += 32) {
    const int last = min(first + 32, terms);
    float sum = 0.0f;
    for (int j = first; j < last; ++j) sum = fma(s[(size_t)j * s_term], v[(size_t)j * columns], sum);
    total += sum;
  }
  return total;
}

__kernel void axis_product(__global float* restrict out, __global const float* restrict s_all,
                           __global const float* restrict v_all, VdvrAxisProduct shape) {
  // Copies, which no store can be taken to change.
  const int rows = shape.rows, terms = shape.terms, columns = shape.columns, s_row = shape.s_row,
            s_term = shape.s_term;
  const int c = (int)get_global_id(0) * 16, r = (int)get_global_id(1) * 4, b = (int)get_global_id(2);
  if (c >= columns || r >= rows || b >= shape.batches) return;
  __global const float* s = s_all + (size_t)r * s_row;
  __global const float* v = v_all + (size_t)b * terms * columns + c;
  __global float* to = out + ((size_t)b * rows + r) * columns + c;
  const int used = min(4, rows - r);
  if (c + 16 > columns) {
    for (int k = 0; k < used; ++k)
      for (int i = 0; i < columns - c; ++i)
        to[(size_t)k * columns + i] = element(s + (size_t)k * s_row, v + i, terms, columns, s_term);
    return;
  }
  // Rows beyond the last repeat it and are not stored. Named sums, not arrays: they stay in registers.
  __global const float *s0 = s, *s1 = s + (size_t)min(1, used - 1) * s_row,
                       *s2 = s + (size_t)min(2, used - 1) * s_row, *s3 = s + (size_t)min(3, used - 1) * s_row;
  float16 total0 = (float16)(0.0f), total1 = total0, total2 = total0, total3 = total0;
  for (int first = 0; first < terms; first += 32) {
    const int last = min(first + 32, terms);
    float16 sum0 = (float16)(0.0f), sum1 = sum0, sum2 = sum0, sum3 = sum0;
    for (int j = first; j < last; ++j) {
      const float16 x = vload16(0, v + (size_t)j * columns);
      const size_t at = (size_t)j * s_term;
      sum0 = fma((float16)(s0[at]), x, sum0);
      sum1 = fma((float16)(s1[at]), x, sum1);
      sum2 = fma((float16)(s2[at]), x, sum2);
      sum3 = fma((float16)(s3[at]), x, sum3);
    }
    total0 += sum0;
    total1 += sum1;
    total2 += sum2;
    total3 += sum3;
  }
  vstore16(total0, 0, to);
  if (used > 1) vstore16(total1, 0, to + columns);
  if (used > 2) vstore16(total2, 0, to + 2 * (size_t)columns);
  if (used > 3) vstore16(total3, 0, to + 3 * (size_t)columns);
}
