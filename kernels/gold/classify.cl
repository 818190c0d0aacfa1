// The node test of every level on a block of gold samples (the paper's Eq. 10, per node), and the samples of
// chosen tiles. Layouts as in node_slack.cl. A brick is VDVR_GRANULARITY^3 base cells; level l of an axis
// samples every (rate * 2^coarsening >> l)-th gold node. Called by host/gold/gold_batch.cpp.
#include "device/largest.h"
#include "device/powers.h"
#include "shared/gold_shape.h"
#include "shared/lattice_shape.h"

#ifndef VDVR_BRICK_NODES
#error "VDVR_BRICK_NODES must be granularity * gold rate"
#endif
// The level's interpolant less gold at 16 nodes of one column, or gold itself at 1x spacing.
#define ERROR_AT(z)                                                                                     \
  (fma((float16)(1.0f - fy),                                                                            \
       fma((float16)(1.0f - fx), vload16(0, a + (z)), fx * vload16(0, a + s.gold_stride + (z))),        \
       fy * fma((float16)(1.0f - fx), vload16(0, b + (z)), fx * vload16(0, b + s.gold_stride + (z)))) - \
   vload16(0, gold_column + (z)))

// Raises error[i] to the largest that |interpolant - F| may be at the closed nodes of the brick bricks[i]:
// its block, and its place x, y, z in it. It starts negative and stays so where no node of a brick is tested.
// Positive floats order as their bits do. One work-item does one column of one brick.
__kernel void level_error(volatile __global int* error, __global const int4* bricks, int count,
                          __global const float* along, __global const float* gold,
                          __global const float* above, __global const float* below,
                          __global const float* margin, VdvrGoldShape s, VdvrLattice l) {
  const int i = (int)get_global_id(2);
  if (get_global_id(0) > VDVR_BRICK_NODES || get_global_id(1) > VDVR_BRICK_NODES || i >= count) return;
  const int block = bricks[i].s0, x = bricks[i].s1 * VDVR_BRICK_NODES + (int)get_global_id(0),
            y = bricks[i].s2 * VDVR_BRICK_NODES + (int)get_global_id(1), bz = bricks[i].s3;
  if (x >= s.nx || y >= s.ny) return;
  const size_t column = ((size_t)block * s.ny + y) * s.nx + x;
  const size_t gold_at =
      ((size_t)block * (s.ny + 2 * s.halo) + y + s.halo) * (s.nx + 2 * s.halo) + x + s.halo;
  if (margin[gold_at] < s.lowest) return;
  const int ix = min(x / l.spacing_x, (s.nx - 1) / l.spacing_x - 1),
            iy = min(y / l.spacing_y, (s.ny - 1) / l.spacing_y - 1);
  const float fx = (float)(x - ix * l.spacing_x) * inverse_of_power(l.spacing_x),
              fy = (float)(y - iy * l.spacing_y) * inverse_of_power(l.spacing_y);
  const int first = bz * VDVR_BRICK_NODES, last = min(first + VDVR_BRICK_NODES, s.nz - 1);
  __global const float* a =
      along + (((size_t)block * l.cy + iy + l.reach_y) * l.cx + ix + l.reach_x) * s.gold_stride + s.halo +
      first;
  __global const float* b = a + (size_t)l.cx * s.gold_stride;
  __global const float* gold_column = gold + gold_at * s.gold_stride + s.halo + first;
  __global const float *above_column = above + column * s.stride + first,
                       *below_column = below + column * s.stride + first;

  // Whole runs of 16, then the rest lane by lane (UNTESTED lanes beyond the block are negative).
  float largest = -1.0f;
  int z = 0;
  for (; z + 16 <= last - first + 1; z += 16) {
    const float16 e = ERROR_AT(z);
    largest = fmax(largest,
                   largest_of_16(fmax(e + vload16(0, below_column + z), vload16(0, above_column + z) - e)));
  }
  for (; z <= last - first; ++z) {
    const float v = fma(1.0f - fy, fma(1.0f - fx, a[z], fx * a[s.gold_stride + z]),
                        fy * fma(1.0f - fx, b[z], fx * b[s.gold_stride + z]));
    const float e = v - gold_column[z];
    largest = fmax(largest, fmax(e + below_column[z], above_column[z] - e));
  }
  if (largest >= 0.0f && as_int(largest) > error[i]) atomic_max(error + i, as_int(largest));
}

// How far linear interpolation along one axis alone errs in the middles of its cells, for every level below
// the gold rate: the largest of interpolant - gold and of gold - interpolant. errors[brick i][axis x, y,
// z][level of most_levels][sign], starting at 0. A node that is no sample of the
// finest level is the middle of a cell of exactly one level.
inline void raise_pair(volatile __global int* to, float plus, float minus) {
  if (plus > 0.0f && as_int(plus) > to[0]) atomic_max(to, as_int(plus));
  if (minus > 0.0f && as_int(minus) > to[1]) atomic_max(to + 1, as_int(minus));
}
// The level whose cells have their middles at node i; `levels` where i is a base sample.
inline int level_of_middle(int i, int levels) {
  int level = levels;
  for (int bit = 0; bit < levels; ++bit)
    if (i & ((1 << (bit + 1)) - 1)) {
      level = levels - 1 - bit;
      break;
    }
  return level;
}
// Half the spacing of that level, in nodes; at a base sample that of the finest, which is read and not used.
inline int half_of(int level, int levels) { return 1 << max(levels - 1 - level, 0); }
__kernel void axis_errors(volatile __global int* errors, __global const int4* bricks, int count,
                          __global const float* gold, __global const float* margin, VdvrGoldShape s,
                          int levels_x, int levels_y, int levels_z, int most_levels) {
  const int i = (int)get_global_id(2);
  if (get_global_id(0) > VDVR_BRICK_NODES || get_global_id(1) > VDVR_BRICK_NODES || i >= count) return;
  const int block = bricks[i].s0, x = bricks[i].s1 * VDVR_BRICK_NODES + (int)get_global_id(0),
            y = bricks[i].s2 * VDVR_BRICK_NODES + (int)get_global_id(1), bz = bricks[i].s3;
  if (x >= s.nx || y >= s.ny) return;
  const int row = s.nx + 2 * s.halo;
  const size_t gold_at = ((size_t)block * (s.ny + 2 * s.halo) + y + s.halo) * row + x + s.halo;
  if (margin[gold_at] < s.lowest) return;
  const int first = bz * VDVR_BRICK_NODES, last = min(first + VDVR_BRICK_NODES, s.nz - 1);
  __global const float* column = gold + gold_at * s.gold_stride + s.halo;
  const int level_x = level_of_middle(x, levels_x), level_y = level_of_middle(y, levels_y);
  const int half_x = half_of(level_x, levels_x), half_y = half_of(level_y, levels_y);
  const long step_x = (long)half_x * s.gold_stride, step_y = (long)half_y * row * s.gold_stride;
  const int16 lane = (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const float16 none = (float16)(0.0f);
  float16 plus_x = none, minus_x = none, plus_y = none, minus_y = none, plus_z[6], minus_z[6];
  for (int l = 0; l < levels_z; ++l) plus_z[l] = minus_z[l] = none;
  for (int z = first; z < last; z += 16) {
    const int16 node = z + lane, outside = node >= last;
    __global const float* c = column + z;
    const float16 centre = vload16(0, c);
    const float16 ex = select(fma((float16)(0.5f), vload16(0, c - step_x) + vload16(0, c + step_x), -centre),
                              none, outside),
                  ey = select(fma((float16)(0.5f), vload16(0, c - step_y) + vload16(0, c + step_y), -centre),
                              none, outside);
    plus_x = fmax(plus_x, ex);
    minus_x = fmax(minus_x, -ex);
    plus_y = fmax(plus_y, ey);
    minus_y = fmax(minus_y, -ey);
    for (int l = 0; l < levels_z; ++l) {
      const int half_z = 1 << (levels_z - 1 - l);
      const float16 ez =
          select(fma((float16)(0.5f), vload16(0, c - half_z) + vload16(0, c + half_z), -centre), none,
                 outside | ((node & (2 * half_z - 1)) != half_z));
      plus_z[l] = fmax(plus_z[l], ez);
      minus_z[l] = fmax(minus_z[l], -ez);
    }
  }
  volatile __global int* out = errors + (size_t)i * 6 * most_levels;
  if (level_x < levels_x) raise_pair(out + 2 * level_x, largest_of_16(plus_x), largest_of_16(minus_x));
  if (level_y < levels_y)
    raise_pair(out + 2 * (most_levels + level_y), largest_of_16(plus_y), largest_of_16(minus_y));
  for (int l = 0; l < levels_z; ++l)
    raise_pair(out + 2 * (2 * most_levels + l), largest_of_16(plus_z[l]), largest_of_16(minus_z[l]));
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

// From the lattice of their triple (fit_coefficients.cl).
__kernel void extract_tiles(__global float* out, __global const float* lattice, __global const float* margin,
                            __global const TileRequest* requests, int count, VdvrGoldShape s, VdvrLattice l,
                            float kept) {
  const int i = (int)get_global_id(0), request = (int)get_global_id(1);
  if (request >= count) return;
  const TileRequest r = requests[request];
  if (i >= r.side_x * r.side_y * r.side_z) return;
  const int ix = i % r.side_x, iy = i / r.side_x % r.side_y, iz = i / r.side_x / r.side_y;
  const int x = min(r.node_x + ix * r.spacing_x, r.last_x), y = min(r.node_y + iy * r.spacing_y, r.last_y);
  const int z = min(r.node_z + iz * r.spacing_z, r.last_z);
  const bool keep =
      margin[((size_t)r.block * (s.ny + 2 * s.halo) + y + s.halo) * (s.nx + 2 * s.halo) + x + s.halo] >= kept;
  const size_t column =
      ((size_t)r.block * l.cy + y / l.spacing_y + l.reach_y) * l.cx + x / l.spacing_x + l.reach_x;
  out[r.offset + i] = keep ? lattice[column * l.cz + z / l.spacing_z + l.reach_z] : 0.0f;
}
