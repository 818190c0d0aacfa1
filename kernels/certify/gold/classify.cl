// The node test of every level on a block of gold samples (the paper's Eq. 10, per node), and the samples of
// chosen tiles. Layouts as in node_slack.cl. A brick is VDVR_GRANULARITY^3 base cells; level l of an axis
// samples every (rate * 2^coarsening >> l)-th gold node. Called by host/certify/gold/gold_batch.cpp.
#include "device/lanes.h"
#include "device/powers.h"
#include "shared/gold_shape.h"
#include "shared/lattice_shape.h"

#ifndef VDVR_BRICK_NODES
#error "VDVR_BRICK_NODES must be granularity * gold rate"
#endif
// The level's interpolant less gold at VDVR_LANES nodes of one column, or gold itself at 1x spacing.
#define ERROR_AT(z)                                                                                \
  (fma((VEC)(1.0f - fy), fma((VEC)(1.0f - fx), READ(a + (z)), fx * READ(a + s.gold_stride + (z))), \
       fy * fma((VEC)(1.0f - fx), READ(b + (z)), fx * READ(b + s.gold_stride + (z)))) -            \
   READ(gold_column + (z)))

// Raises error[i] to the largest that |interpolant - F| may be at the closed nodes of the brick bricks[i]:
// its block, and its place x, y, z in it. It starts negative and stays so where no node of a brick is tested.
// Positive floats order as their bits do. One work-item does `each` nodes of a column of a
// brick; nodes, or runs of them, follow one another along z, then x, then y.
typedef struct {
  int i, block, x, y, bz;  // of the bricks; in them all; nodes of the block
  int from;                // node of the brick
} Column;
static inline bool find_column(Column* c, __global const int4* bricks, int count, int each, VdvrGoldShape s) {
  const int side = VDVR_BRICK_NODES + 1, parts = (side + each - 1) / each, n = (int)get_global_id(0);
  c->i = (int)get_global_id(1);
  if (n >= parts * side * side || c->i >= count) return false;
  const int column = n / parts, row = column / side;
  c->from = (n - column * parts) * each;
  c->block = bricks[c->i].s0;
  c->x = bricks[c->i].s1 * VDVR_BRICK_NODES + column - row * side;
  c->y = bricks[c->i].s2 * VDVR_BRICK_NODES + row;
  c->bz = bricks[c->i].s3;
  return c->x < s.nx && c->y < s.ny;
}
__kernel void level_error(volatile __global int* error, __global const int4* bricks, int count, int each,
                          __global const float* along, __global const float* gold,
                          __global const float* above, __global const float* below,
                          __global const float* margin, VdvrGoldShape s, VdvrLattice l) {
  Column c;
  if (!find_column(&c, bricks, count, each, s)) return;
  const int i = c.i, block = c.block, x = c.x, y = c.y;
  const size_t column = ((size_t)block * s.ny + y) * s.nx + x;
  const size_t gold_at =
      ((size_t)block * (s.ny + 2 * s.halo) + y + s.halo) * (s.nx + 2 * s.halo) + x + s.halo;
  if (margin[gold_at] < s.lowest) return;
  const int ix = min(x / l.spacing_x, (s.nx - 1) / l.spacing_x - 1),
            iy = min(y / l.spacing_y, (s.ny - 1) / l.spacing_y - 1);
  const float fx = (float)(x - ix * l.spacing_x) * inverse_of_power(l.spacing_x),
              fy = (float)(y - iy * l.spacing_y) * inverse_of_power(l.spacing_y);
  const int first = c.bz * VDVR_BRICK_NODES, last = min(first + VDVR_BRICK_NODES, s.nz - 1);
  __global const float* a =
      along + (((size_t)block * l.cy + iy + l.reach_y) * l.cx + ix + l.reach_x) * s.gold_stride + s.halo +
      first;
  __global const float* b = a + (size_t)l.cx * s.gold_stride;
  __global const float* gold_column = gold + gold_at * s.gold_stride + s.halo + first;
  __global const float *above_column = above + column * s.stride + first,
                       *below_column = below + column * s.stride + first;

  // Whole runs of lanes, then the rest one by one: beyond the block lies what no lane may count.
  float largest = -1.0f;
  int z = c.from;
  const int end = min(z + each, last - first + 1);
  for (; z + VDVR_LANES <= end; z += VDVR_LANES) {
    const VEC e = ERROR_AT(z);
    largest = fmax(largest, LARGEST(fmax(e + READ(below_column + z), READ(above_column + z) - e)));
  }
#if VDVR_LANES > 1
  for (; z < end; ++z) {
    const float v = fma(1.0f - fy, fma(1.0f - fx, a[z], fx * a[s.gold_stride + z]),
                        fy * fma(1.0f - fx, b[z], fx * b[s.gold_stride + z]));
    const float e = v - gold_column[z];
    largest = fmax(largest, fmax(e + below_column[z], above_column[z] - e));
  }
#endif
  if (largest >= 0.0f && as_int(largest) > error[i]) atomic_max(error + i, as_int(largest));
}

// How far linear interpolation along one axis alone errs in the middles of its cells, for every level below
// the gold rate: the largest of interpolant - gold and of gold - interpolant. errors[brick i][axis x, y,
// z][level of most_levels][sign], starting at 0. A node that is no sample of the
// finest level is the middle of a cell of exactly one level.
static inline void raise_pair(volatile __global int* to, float plus, float minus) {
  if (plus > 0.0f && as_int(plus) > to[0]) atomic_max(to, as_int(plus));
  if (minus > 0.0f && as_int(minus) > to[1]) atomic_max(to + 1, as_int(minus));
}
// The level whose cells have their middles at node i; `levels` where i is a base sample.
static inline int level_of_middle(int i, int levels) {
  int level = levels;
  for (int bit = 0; bit < levels; ++bit)
    if (i & ((1 << (bit + 1)) - 1)) {
      level = levels - 1 - bit;
      break;
    }
  return level;
}
// Half the spacing of that level, in nodes; at a base sample that of the finest, which is read and not used.
static inline int half_of(int level, int levels) { return 1 << max(levels - 1 - level, 0); }
#define FOR_LEVELS(M) M(0) M(1) M(2) M(3) M(4) M(5)
#define NOTHING_Z(l) VEC plus_z##l = none, minus_z##l = none;
#define TAKE_Z(l)                                                                                 \
  if (l < levels_z) {                                                                             \
    const int half_z = 1 << (levels_z - 1 - l);                                                   \
    const VEC ez = select(fma((VEC)(0.5f), READ(at - half_z) + READ(at + half_z), -centre), none, \
                          outside | ((node & (2 * half_z - 1)) != half_z));                       \
    plus_z##l = fmax(plus_z##l, ez);                                                              \
    minus_z##l = fmax(minus_z##l, -ez);                                                           \
  }
#define RAISE_Z(l) \
  if (l < levels_z) raise_pair(out + 2 * (2 * most_levels + l), LARGEST(plus_z##l), LARGEST(minus_z##l));
// As level_error. levels_z: six at most.
__kernel void axis_errors(volatile __global int* errors, __global const int4* bricks, int count, int each,
                          __global const float* gold, __global const float* margin, VdvrGoldShape s,
                          int levels_x, int levels_y, int levels_z, int most_levels) {
  Column c;
  if (!find_column(&c, bricks, count, each, s)) return;
  const int i = c.i, block = c.block, x = c.x, y = c.y;
  const int row = s.nx + 2 * s.halo;
  const size_t gold_at = ((size_t)block * (s.ny + 2 * s.halo) + y + s.halo) * row + x + s.halo;
  if (margin[gold_at] < s.lowest) return;
  const int first = c.bz * VDVR_BRICK_NODES, last = min(first + VDVR_BRICK_NODES, s.nz - 1);
  __global const float* column = gold + gold_at * s.gold_stride + s.halo;
  const int level_x = level_of_middle(x, levels_x), level_y = level_of_middle(y, levels_y);
  const int half_x = half_of(level_x, levels_x), half_y = half_of(level_y, levels_y);
  const long step_x = (long)half_x * s.gold_stride, step_y = (long)half_y * row * s.gold_stride;
  const VEC none = (VEC)(0.0f);
  VEC plus_x = none, minus_x = none, plus_y = none, minus_y = none;
  FOR_LEVELS(NOTHING_Z)
  const int end = min(first + c.from + each, last);
  for (int z = first + c.from; z < end; z += VDVR_LANES) {
    const INT node = z + INDEX, outside = node >= last;
    __global const float* at = column + z;
    const VEC centre = READ(at);
    const VEC ex = select(fma((VEC)(0.5f), READ(at - step_x) + READ(at + step_x), -centre), none, outside),
              ey = select(fma((VEC)(0.5f), READ(at - step_y) + READ(at + step_y), -centre), none, outside);
    plus_x = fmax(plus_x, ex);
    minus_x = fmax(minus_x, -ex);
    plus_y = fmax(plus_y, ey);
    minus_y = fmax(minus_y, -ey);
    FOR_LEVELS(TAKE_Z)
  }
  volatile __global int* out = errors + (size_t)i * 6 * most_levels;
  if (level_x < levels_x) raise_pair(out + 2 * level_x, LARGEST(plus_x), LARGEST(minus_x));
  if (level_y < levels_y) raise_pair(out + 2 * (most_levels + level_y), LARGEST(plus_y), LARGEST(minus_y));
  FOR_LEVELS(RAISE_Z)
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
