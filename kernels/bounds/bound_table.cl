// P from derivatives of the filtered projections (docs/error-bounds.md): tables of their sups by cell, and a
// sum over the views per base cell. Layouts: derivatives float d[z / 16][view][column n][16]; table float2
// table[cell z][view][n] = weighted sup of the positive and of the negative part over the rows of a cell and
// the stencil of column cell n; p float[block][cell z][y][x]. Called by host/bounds/bound_table.cpp and
// host/bounds/projection_bounds.cpp.
#include "device/largest.h"

// Maxima drop NaN: what is no number counts as infinite.
inline float finite_or_infinite(float v) { return v <= FLT_MAX ? v : INFINITY; }

// Largest |d| over the columns of every row: sup[view][z].
__kernel void row_sup(__global float* sup, __global const float* d, int views, int columns, int z_padded) {
  const int z = (int)get_global_id(0), k = (int)get_global_id(1);
  if (z >= z_padded || k >= views) return;
  __global const float* p = d + ((size_t)(z / 16) * views + k) * columns * 16 + z % 16;
  float largest = 0.0f;
  for (int n = 0; n < columns; ++n) largest = fmax(largest, finite_or_infinite(fabs(p[(size_t)n * 16])));
  sup[(size_t)k * z_padded + z] = largest;
}

// Adds `weight` times the sup of the positive and of the negative part of a derivative, per column cell n and
// cell c, to the table (or writes it, with `begin`). The stencil of column cell n is n - below .. n + above;
// cell c has the rows c * row_step .. c * row_step + row_count - 1. `remainder` times the row's sup, and
// `view_rise`, are how far the derivative can rise above its computed samples between columns and rows.
__kernel void bound_table(__global float2* table, __global const float* d, __global const float* sup,
                          __global const float* view_rise, int first_view, int chunk_views, int all_views,
                          int columns, int z_padded, int rows, int row_step, int row_count, int cells_z,
                          int below, int above, float remainder, float weight, int begin) {
  const int n = (int)get_global_id(0), k = (int)get_global_id(1), c = (int)get_global_id(2);
  if (n >= columns || k >= chunk_views || c >= cells_z) return;
  const int first = c * row_step, last = min(first + row_count, rows) - 1;
  const float also = view_rise[first_view + k];
  float16 plus = (float16)(0.0f), minus = plus;
  for (int z = first / 16 * 16; z <= last; z += 16) {
    __global const float* p = d + ((size_t)(z / 16) * chunk_views + k) * columns * 16;
    float16 high = (float16)(-INFINITY), low = -high;
    for (int m = max(n - below, 0); m <= min(n + above, columns - 1); ++m) {
      const float16 v = vload16(m, p);
      high = fmax(high, v);
      low = fmin(low, v);
    }
    const float16 rise = remainder * (vload16(0, sup + (size_t)k * z_padded + z) + also) + also;
    const int16 row = z + (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const int16 outside = (row < first) | (row > last);
    plus = fmax(plus, select(high + rise, (float16)(0.0f), outside));
    minus = fmax(minus, select(rise - low, (float16)(0.0f), outside));
  }
  __global float2* entry = table + ((size_t)c * all_views + first_view + k) * columns + n;
  const float2 term = weight * (float2)(largest_of_16(plus), largest_of_16(minus));
  *entry = begin ? term : *entry + term;
}

// Running maximum: out[.][n] = max of table[.][n - reach .. n + reach], reach by view. A cell's shadow on the
// columns has the same width wherever the cell lies.
__kernel void dilate_table(__global float2* out, __global const float2* table, __global const int* reach,
                           int views, int columns, int rows) {
  const int n = (int)get_global_id(0), r = (int)get_global_id(1);
  if (n >= columns || r >= rows) return;
  const int width = reach[r % views];
  __global const float2* row = table + (size_t)r * columns;
  float2 largest = (float2)(0.0f);
  for (int m = max(n - width, 0); m <= min(n + width, columns - 1); ++m) largest = fmax(largest, row[m]);
  out[(size_t)r * columns + n] = largest;
}

// The bound of each cell: for each view the dilated table's entry under the cell's centre.
// first_z: the table's cell that the blocks begin at.
// steps: per block and view {s per cell along x, along y, s at the first cell's centre, 0}. `lost`: what
// products of all views can have lost below the normal numbers.
__kernel void project_bound(__global float* p, __global const float2* table, __global const float4* steps,
                            int views, int columns, int cells_x, int cells_y, int cells_z, int blocks,
                            int first_z, float factor, float lost) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / cells_z, z = (int)get_global_id(2) - block * cells_z;
  if (x >= cells_x || y >= cells_y || block >= blocks) return;
  float2 sum = (float2)(0.0f);
  for (int k = 0; k < views; ++k) {
    const float4 step = steps[(size_t)block * views + k];
    const int n = clamp((int)floor(step.z + step.x * (float)x + step.y * (float)y), 0, columns - 1);
    sum += table[((size_t)(first_z + z) * views + k) * columns + n];
  }
  const float bound = factor * (fmax(sum.x, sum.y) + lost) + FLT_MIN;
  p[(((size_t)block * cells_z + z) * cells_y + y) * cells_x + x] = finite_or_infinite(bound);
}
