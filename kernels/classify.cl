// The node test of every level on a block of gold samples (the paper's Eq. 10, per node), and the samples of
// chosen tiles. Layouts as in gold_bounds.cl. A brick is VDVR_GRANULARITY^3 base cells; level l samples every
// (rate >> l)-th gold node. Called by host/gold_batch.cpp.
#include "shared/largest.h"

#ifndef VDVR_BRICK_NODES
#error "VDVR_BRICK_NODES must be granularity * gold rate"
#endif
// The level's interpolant less gold at 16 nodes of one column, or gold itself at 1x spacing.
#define ERROR_AT(z)                                                                             \
  ((1.0f - fy) * ((1.0f - fx) * vload16(0, a + (z)) + fx * vload16(0, a + gold_stride + (z))) + \
   fy * ((1.0f - fx) * vload16(0, b + (z)) + fx * vload16(0, b + gold_stride + (z))) -          \
   vload16(0, gold_column + (z)))

// Raises error[block][brick z][brick y][brick x] to the largest that |interpolant - F| may be at the brick's
// closed nodes. It starts negative and stays so where no node of a brick is tested. Bricks that `before` (the
// errors of the level below) found within `tolerance` are left out. Positive floats order as their bits do.
// One work-item does one column of one brick layer; its last node is also the next layer's first.
__kernel void level_error(volatile __global int* error, __global const int* before,
                          __global const float* along, __global const float* gold,
                          __global const float* above, __global const float* below,
                          __global const float* margin, float lowest, int nx, int ny, int nz, int halo,
                          int gold_stride, int stride, int spacing, int reach, int cx, int cy, int bricks_x,
                          int bricks_y, int bricks_z, int blocks, float tolerance) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1);
  const int block = (int)get_global_id(2) / bricks_z, bz = (int)get_global_id(2) - block * bricks_z;
  if (x >= nx || y >= ny || block >= blocks) return;
  const size_t column = ((size_t)block * ny + y) * nx + x;
  const size_t gold_at = ((size_t)block * (ny + 2 * halo) + y + halo) * (nx + 2 * halo) + x + halo;
  if (margin[gold_at] < lowest) return;
  // A column on a border belongs to the closed boxes of the bricks on both sides.
  const int bx0 = max((x - 1) / VDVR_BRICK_NODES, 0), bx1 = min(x / VDVR_BRICK_NODES, bricks_x - 1);
  const int by0 = max((y - 1) / VDVR_BRICK_NODES, 0), by1 = min(y / VDVR_BRICK_NODES, bricks_y - 1);
  const size_t layer = ((size_t)block * bricks_z + bz) * bricks_y;
  bool wanted = false;
  for (int by = by0; by <= by1; ++by)
    for (int bx = bx0; bx <= bx1; ++bx) {
      const int bits = before[(layer + by) * bricks_x + bx];
      wanted = wanted || (bits >= 0 && !(as_float(bits) <= tolerance));
    }
  if (!wanted) return;
  const int ix = min(x / spacing, (nx - 1) / spacing - 1), iy = min(y / spacing, (ny - 1) / spacing - 1);
  const float fx = (float)(x - ix * spacing) / (float)spacing,
              fy = (float)(y - iy * spacing) / (float)spacing;
  const int first = bz * VDVR_BRICK_NODES, last = min(first + VDVR_BRICK_NODES, nz - 1);
  __global const float* a =
      along + (((size_t)block * cy + iy + reach) * cx + ix + reach) * gold_stride + halo + first;
  __global const float* b = a + (size_t)cx * gold_stride;
  __global const float* gold_column = gold + gold_at * gold_stride + halo + first;
  __global const float *above_column = above + column * stride + first,
                       *below_column = below + column * stride + first;

  // Whole runs of 16, then the rest lane by lane (UNTESTED lanes beyond the block are negative).
  float largest = -1.0f;
  int z = 0;
  for (; z + 16 <= last - first + 1; z += 16) {
    const float16 e = ERROR_AT(z);
    largest = fmax(largest,
                   largest_of_16(fmax(e + vload16(0, below_column + z), vload16(0, above_column + z) - e)));
  }
  for (; z <= last - first; ++z) {
    const float v = (1.0f - fy) * ((1.0f - fx) * a[z] + fx * a[gold_stride + z]) +
                    fy * ((1.0f - fx) * b[z] + fx * b[gold_stride + z]);
    const float e = v - gold_column[z];
    largest = fmax(largest, fmax(e + below_column[z], above_column[z] - e));
  }
  if (largest < 0.0f) return;
  for (int by = by0; by <= by1; ++by)
    for (int bx = bx0; bx <= bx1; ++bx) atomic_max(error + (layer + by) * bricks_x + bx, as_int(largest));
}

// Copies the samples of tiles out of a lattice: request i writes tile samples float[sz][sy][sx] at `offset`.
typedef struct {
  int block, node_x, node_y, node_z;    // of the brick's first node in its block
  int spacing_x, spacing_y, spacing_z;  // in gold nodes
  int side_x, side_y, side_z;           // samples
  int last_x, last_y, last_z;           // last node of the grid inside the block: beyond it planes repeat
  int pad;
  ulong offset;
} TileRequest;

// From the lattice of their spacing (fit_coefficients.cl): node n at n / spacing + reach.
__kernel void extract_tiles(__global float* out, __global const float* lattice, __global const float* margin,
                            __global const TileRequest* requests, int count, int nx, int ny, int halo,
                            int spacing, int reach, int cx, int cy, int lattice_stride, float kept) {
  const int i = (int)get_global_id(0), request = (int)get_global_id(1);
  if (request >= count) return;
  const TileRequest r = requests[request];
  if (i >= r.side_x * r.side_y * r.side_z) return;
  const int ix = i % r.side_x, iy = i / r.side_x % r.side_y, iz = i / r.side_x / r.side_y;
  const int x = min(r.node_x + ix * r.spacing_x, r.last_x), y = min(r.node_y + iy * r.spacing_y, r.last_y);
  const int z = min(r.node_z + iz * r.spacing_z, r.last_z);
  const bool keep =
      margin[((size_t)r.block * (ny + 2 * halo) + y + halo) * (nx + 2 * halo) + x + halo] >= kept;
  const size_t column = ((size_t)r.block * cy + y / spacing + reach) * cx + x / spacing + reach;
  out[r.offset + i] = keep ? lattice[column * lattice_stride + z / spacing + reach] : 0.0f;
}
