// Errors along single axes on a block of gold samples, and the samples of chosen tiles. Layouts as in
// node_slack.cl. A brick is VDVR_GRANULARITY^3 base cells; level l of an axis
// samples every (rate * 2^coarsening >> l)-th gold node. Called by host/certify/gold/gold_batch.cpp.
#include "device/lanes.h"
#include "device/shared_column.h"
#include "shared/gold_shape.h"

#ifndef VDVR_BRICK_NODES
#error "VDVR_BRICK_NODES must be granularity * gold rate"
#endif
// A brick bricks[i] is its block, and its place x, y, z in it. One work-item does `each` nodes of a column of
// a brick; nodes, or runs of them, follow one another along z, then x, then y.
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
// Positive floats order as their bits do. levels_z: six at most.
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

// Copies the samples of tiles out of lattices, or of gold: request i writes tile samples float[sz][sy][sx] at
// `offset`.
typedef struct {
  int block, node_x, node_y;   // of the brick's first node in its block
  int spacing_x, spacing_y;    // in gold nodes
  int side_x, side_y, side_z;  // samples
  int last_x, last_y, last_z;  // last sample of the grid inside the block: beyond it planes repeat
  int step_x, step_y, step_z;  // from sample to sample, in floats
  ulong from, offset;          // of the first sample
} TileRequest;

__kernel SHARED_COLUMN void extract_tiles(__global float* out, __global const float* samples,
                                          __global const float* margin, __global const TileRequest* requests,
                                          int count, VdvrGoldShape s, float kept) {
  const int request = (int)get_global_id(0) / VDVR_ALONG;
  if (request >= count) return;
  const TileRequest r = requests[request];
  for (int i = OWN_PART; i < r.side_y * r.side_z; i += VDVR_ALONG) {
    const int z = i / r.side_y, y = min(i - z * r.side_y, r.last_y);
    __global const float* from =
        samples + r.from + (size_t)min(z, r.last_z) * r.step_z + (size_t)y * r.step_y;
    __global const float* m =
        margin +
        ((size_t)r.block * (s.ny + 2 * s.halo) + r.node_y + y * r.spacing_y + s.halo) * (s.nx + 2 * s.halo) +
        r.node_x + s.halo;
    __global float* to = out + r.offset + (size_t)i * r.side_x;
    for (int k = 0; k < r.side_x; ++k) {
      const int x = min(k, r.last_x);
      to[k] = m[x * r.spacing_x] >= kept ? from[(size_t)x * r.step_x] : 0.0f;
    }
  }
}
