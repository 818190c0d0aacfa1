// T from second differences of gold, and the node slack T + P that the node test adds to |V - gold|
// (docs/error-bounds.md). Layouts: gold float[block][y + halo][x + halo][gold stride], node z at z + halo,
// with a halo of at least one node; margin float[block][y + halo][x + halo]; cells
// float[block][y][x][stride] with cell z at z + 1; slack float[block][y][x][stride], node z at z. Called by
// host/certify/gold/node_slack.cpp.
#include "device/lanes.h"
#include "shared/untested.h"

// What bricks add along gold columns: rows[block][brick y][brick x][stride], 0 beyond the block.
__kernel void expand_addend(__global float* rows, __global const float* addend, int bricks_x, int bricks_y,
                            int bricks_z, int side, int stride, int blocks) {
  const int z = (int)get_global_id(0), x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / bricks_y, y = (int)get_global_id(2) - block * bricks_y;
  if (z >= stride || x >= bricks_x || block >= blocks) return;
  const int brick = z / side;
  rows[(((size_t)block * bricks_y + y) * bricks_x + x) * stride + z] =
      brick < bricks_z ? addend[(((size_t)block * bricks_z + brick) * bricks_y + y) * bricks_x + x] : 0.0f;
}

// Second differences along x, y, z at VDVR_LANES nodes, into the largest positive and the smallest negative
// so far.
#define DIFFERENCES(node)                                                           \
  {                                                                                 \
    __global const float* centre = node;                                            \
    const VEC twice = 2.0f * READ(centre);                                          \
    const VEC dx = READ(centre - gold_stride) + READ(centre + gold_stride) - twice; \
    const VEC dy = READ(centre - row) + READ(centre + row) - twice;                 \
    const VEC dz = READ(centre - 1) + READ(centre + 1) - twice;                     \
    px = fmax(px, dx);                                                              \
    mx = fmin(mx, dx);                                                              \
    py = fmax(py, dy);                                                              \
    my = fmin(my, dy);                                                              \
    pz = fmax(pz, dz);                                                              \
    mz = fmin(mz, dz);                                                              \
  }
#define RANGE(node)           \
  {                           \
    const VEC v = READ(node); \
    low = fmin(low, v);       \
    high = fmax(high, v);     \
  }
#define CORNERS(M)    \
  M(at)               \
  M(at + 1)           \
  M(at + gold_stride) \
  M(at + gold_stride + 1) M(at + row) M(at + row + 1) M(at + row + gold_stride) M(at + row + gold_stride + 1)

// Slack of each gold cell: how far F may lie above and below gold's interpolant there. Where F is convex it
// lies below, so `below` is the sum of the largest positive second differences at the cell's corners, by
// axis, times `curvature` (an eighth, or what finer gold would have of these), `above` that of the negative
// ones, each plus what its brick adds (interpolation, rounding, the remainder of T). Cells beyond the block,
// and with `windowed` those whose range misses the window, are VDVR_UNTESTED. The host pads gold and the
// strides so that no 16-lane access leaves its column's room. cell_test.cl has the same by cell, without
// arrays.
__kernel void cell_slack(__global float* cells_above, __global float* cells_below, __global const float* gold,
                         __global const float* addend, int nx, int ny, int nz, int halo, int gold_stride,
                         int stride, int side, int bricks_x, int bricks_y, int blocks, int counted,
                         int windowed, float window_low, float window_high, float curvature) {
  const int z = (int)get_global_id(0) * VDVR_LANES, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / (ny - 1), y = (int)get_global_id(2) - block * (ny - 1);
  if (z >= nz || x >= nx - 1 || block >= blocks)
    return;  // one cell more than there is: it must be marked VDVR_UNTESTED
  const int row = (nx + 2 * halo) * gold_stride;
  __global const float* at =
      gold + ((size_t)block * (ny + 2 * halo) + y + halo) * row + (size_t)(x + halo) * gold_stride + z + halo;
  VEC px = (VEC)(0.0f), py = px, pz = px, mx = px, my = px, mz = px;
  CORNERS(DIFFERENCES)
  const VEC bound = READ(addend + (((size_t)block * bricks_y + y / side) * bricks_x + x / side) * stride + z);
  VEC below = fma(px + py + pz, (VEC)(curvature), bound),
      above = fma(-(mx + my + mz), (VEC)(curvature), bound);
  const INT k = z + INDEX;
  INT out = k > nz - 2;
  if (windowed) {
    VEC low = READ(at), high = low;
    CORNERS(RANGE)
    // F may enter the window between corners that computed gold leaves out of it: by no more than the slack.
    out |= (low - below > window_high) | (high + above < window_low);
  }
  // Whatever is no number here is no bound.
  above = select((VEC)(INFINITY), counted ? above : (VEC)(0.0f), above <= FLT_MAX);
  below = select((VEC)(INFINITY), counted ? below : (VEC)(0.0f), below <= FLT_MAX);
  above = select(above, (VEC)(VDVR_UNTESTED), out);
  below = select(below, (VEC)(VDVR_UNTESTED), out);
  const size_t column = (((size_t)block * ny + y) * nx + x) * stride;
  WRITE(above, cells_above + column + z + 1);
  WRITE(below, cells_below + column + z + 1);
  if (z == 0) cells_above[column] = cells_below[column] = VDVR_UNTESTED;
}

// Slack of each node: the largest of either of the cells around it, VDVR_UNTESTED where no such cell meets
// the covered region. margin: per block and column the coverage margin across z; nodes with less than
// `lowest` are untested, as are those outside [z_first, z_last] and [0, x_last[block]] x [0, y_last[block]].
__kernel void node_slack(__global float* above, __global float* below, __global const float* cells_above,
                         __global const float* cells_below, __global const float* margin,
                         __global const int2* last, int nx, int ny, int nz, int halo, int stride, int blocks,
                         float lowest, int z_first, int z_last) {
  const int z = (int)get_global_id(0) * VDVR_LANES, x = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / ny, y = (int)get_global_id(2) - block * ny;
  if (z >= nz || x >= nx || block >= blocks) return;
  const size_t column = ((size_t)block * ny + y) * nx + x;
  VEC a = (VEC)(VDVR_UNTESTED), b = a;
  const int2 end = last[block];
  const size_t here = ((size_t)block * (ny + 2 * halo) + y + halo) * (nx + 2 * halo) + x + halo;
  if (margin[here] >= lowest && x <= end.x && y <= end.y) {
    for (int dy = -1; dy <= 0; ++dy)
      for (int dx = -1; dx <= 0; ++dx) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= end.x || y + dy >= end.y) continue;
        const size_t at = (column + dy * nx + dx) * stride + z;
        a = fmax(a, fmax(READ(cells_above + at), READ(cells_above + at + 1)));
        b = fmax(b, fmax(READ(cells_below + at), READ(cells_below + at + 1)));
      }
    const INT k = z + INDEX;
    const INT out = (k < z_first) | (k > z_last) | (k > nz - 1);
    a = select(a, (VEC)(VDVR_UNTESTED), out);
    b = select(b, (VEC)(VDVR_UNTESTED), out);
  }
  WRITE(a, above + column * stride + z);
  WRITE(b, below + column * stride + z);
}
