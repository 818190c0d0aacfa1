// Bounds that go with a block of gold samples (docs/error-bounds.md): P from derivatives of the filtered
// projections, T from second differences of gold, and the node slack that the node test adds to |V - gold|.
// Layouts: derivatives float d[z / 16][view][column n][16]; table float2 table[cell z][view][n] = weighted
// sup of the positive and of the negative part over the rows of a cell and the stencil of column cell n; p
// float[block][cell z][y][x]; gold float[block][y + halo][x + halo][gold stride], node z at z + halo, with a
// halo of at least one node; margin float[block][y + halo][x + halo]; cells float[block][y][x][stride] with
// cell z at z + 1; slack float[block][y][x][stride], node z at z. Called by host/node_slack.cpp and
// host/bound_table.cpp.
#include "shared/largest.h"
#include "shared/untested.h"

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

// A bound of base cells along gold columns: rows[block][base cell y][base cell x][stride], 0 beyond the
// block.
__kernel void expand_bound(__global float* rows, __global const float* p, int cells_x, int cells_y,
                           int cells_z, int rate, int stride, int blocks) {
  const int z = (int)get_global_id(0), x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / cells_y, y = (int)get_global_id(2) - block * cells_y;
  if (z >= stride || x >= cells_x || block >= blocks) return;
  const int cell = z / rate;
  rows[(((size_t)block * cells_y + y) * cells_x + x) * stride + z] =
      cell < cells_z ? p[(((size_t)block * cells_z + cell) * cells_y + y) * cells_x + x] : 0.0f;
}

// Second differences along x, y, z at 16 nodes, into the largest positive and the smallest negative so far.
#define DIFFERENCES(node)                                                                           \
  {                                                                                                 \
    __global const float* centre = node;                                                            \
    const float16 twice = 2.0f * vload16(0, centre);                                                \
    const float16 dx = vload16(0, centre - gold_stride) + vload16(0, centre + gold_stride) - twice; \
    const float16 dy = vload16(0, centre - row) + vload16(0, centre + row) - twice;                 \
    const float16 dz = vload16(0, centre - 1) + vload16(0, centre + 1) - twice;                     \
    px = fmax(px, dx);                                                                              \
    mx = fmin(mx, dx);                                                                              \
    py = fmax(py, dy);                                                                              \
    my = fmin(my, dy);                                                                              \
    pz = fmax(pz, dz);                                                                              \
    mz = fmin(mz, dz);                                                                              \
  }
#define RANGE(node)                     \
  {                                     \
    const float16 v = vload16(0, node); \
    low = fmin(low, v);                 \
    high = fmax(high, v);               \
  }
#define CORNERS(M)    \
  M(at)               \
  M(at + 1)           \
  M(at + gold_stride) \
  M(at + gold_stride + 1) M(at + row) M(at + row + 1) M(at + row + gold_stride) M(at + row + gold_stride + 1)

// Slack of each gold cell: how far F may lie above and below gold's interpolant there. Where F is convex it
// lies below, so `below` is the sum of the largest positive second differences at the cell's corners, by
// axis, / 8, `above` that of the negative ones, each plus `addend`, which is 2.5 P + the remainder of T by
// base cell, plus t_constant. Cells beyond the block, and with `windowed` those whose range misses the
// window, are VDVR_UNTESTED. The host pads gold and the strides so that no 16-lane access leaves its column's
// room.
__kernel void cell_slack(__global float* cells_above, __global float* cells_below, __global const float* gold,
                         __global const float* addend, int nx, int ny, int nz, int halo, int gold_stride,
                         int stride, int rate, int cells_x, int cells_y, int blocks, int counted,
                         float t_constant, int windowed, float window_low, float window_high) {
  const int z = (int)get_global_id(0) * 16, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / (ny - 1), y = (int)get_global_id(2) - block * (ny - 1);
  if (z >= nz || x >= nx - 1 || block >= blocks)
    return;  // one cell more than there is: it must be marked VDVR_UNTESTED
  const int row = (nx + 2 * halo) * gold_stride;
  __global const float* at =
      gold + ((size_t)block * (ny + 2 * halo) + y + halo) * row + (size_t)(x + halo) * gold_stride + z + halo;
  float16 px = (float16)(0.0f), py = px, pz = px, mx = px, my = px, mz = px;
  CORNERS(DIFFERENCES)
  const float16 bound =
      vload16(0, addend + (((size_t)block * cells_y + y / rate) * cells_x + x / rate) * stride + z);
  float16 below = (px + py + pz) * 0.125f + t_constant + bound,
          above = -(mx + my + mz) * 0.125f + t_constant + bound;
  const int16 k = z + (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  int16 out = k > nz - 2;
  if (windowed) {
    float16 low = vload16(0, at), high = low;
    CORNERS(RANGE)
    // F may enter the window between corners that computed gold leaves out of it: by no more than the slack.
    out |= (low - below > window_high) | (high + above < window_low);
  }
  // Whatever is no number here is no bound.
  above = select((float16)(INFINITY), counted ? above : (float16)(0.0f), above <= FLT_MAX);
  below = select((float16)(INFINITY), counted ? below : (float16)(0.0f), below <= FLT_MAX);
  above = select(above, (float16)(VDVR_UNTESTED), out);
  below = select(below, (float16)(VDVR_UNTESTED), out);
  const size_t column = (((size_t)block * ny + y) * nx + x) * stride;
  vstore16(above, 0, cells_above + column + z + 1);
  vstore16(below, 0, cells_below + column + z + 1);
  if (z == 0) cells_above[column] = cells_below[column] = VDVR_UNTESTED;
}

// Slack of each node: the largest of either of the cells around it, VDVR_UNTESTED where no such cell meets
// the covered region. margin: per block and column the coverage margin across z; nodes with less than
// `lowest` are untested, as are those outside [z_first, z_last] and [0, x_last[block]] x [0, y_last[block]].
__kernel void node_slack(__global float* above, __global float* below, __global const float* cells_above,
                         __global const float* cells_below, __global const float* margin,
                         __global const int2* last, int nx, int ny, int nz, int halo, int stride, int blocks,
                         float lowest, int z_first, int z_last) {
  const int z = (int)get_global_id(0) * 16, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / ny, y = (int)get_global_id(2) - block * ny;
  if (z >= nz || x >= nx || block >= blocks) return;
  const size_t column = ((size_t)block * ny + y) * nx + x;
  float16 a = (float16)(VDVR_UNTESTED), b = a;
  const int2 end = last[block];
  const size_t here = ((size_t)block * (ny + 2 * halo) + y + halo) * (nx + 2 * halo) + x + halo;
  if (margin[here] >= lowest && x <= end.x && y <= end.y) {
    for (int dy = -1; dy <= 0; ++dy)
      for (int dx = -1; dx <= 0; ++dx) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= end.x || y + dy >= end.y) continue;
        const size_t at = (column + dy * nx + dx) * stride + z;
        a = fmax(a, fmax(vload16(0, cells_above + at), vload16(0, cells_above + at + 1)));
        b = fmax(b, fmax(vload16(0, cells_below + at), vload16(0, cells_below + at + 1)));
      }
    const int16 k = z + (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const int16 out = (k < z_first) | (k > z_last) | (k > nz - 1);
    a = select(a, (float16)(VDVR_UNTESTED), out);
    b = select(b, (float16)(VDVR_UNTESTED), out);
  }
  vstore16(a, 0, above + column * stride + z);
  vstore16(b, 0, below + column * stride + z);
}
