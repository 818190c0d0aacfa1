// Tests the stored field V against F on the cells of gold of a block, through the sampler that renders it
// (kernels/shared/mixed_sampler.h). In a cell |V - F| is at most the larger of V - gold + below and above -
// (V - gold) over its corners: below is an eighth of the largest second differences of gold at them, by axis,
// plus what its brick adds (interpolation, rounding, remainder); above alike with the other sign
// (docs/error-bounds.md, section 5). Layouts: gold float[block][y + halo][x + halo][gold stride], node z at z
// + halo, with a halo of at least one node; margin float[block][y + halo][x + halo]; addend float and results
// [block][brick z][brick y][brick x]. A brick's results are those of its own cells, in whatever block they
// are computed. Boxes of cells are int[6], the first ones along x, y, z and those after the last. Called by
// host/certify/gold/cell_test.cpp.
#include "device/lanes.h"
#include "device/powers.h"
#include "shared/cell_test.h"
#include "shared/gold_shape.h"
#include "shared/mixed_sampler.h"

#ifndef VDVR_BRICK_NODES
#error "VDVR_BRICK_NODES must be granularity * gold rate"
#endif

// Positive floats order as their bits do. Most do not raise the maximum: a plain read spares them the atomic.
static inline void raise(volatile __global int* target, float v) {
  if (as_int(v) > *target) atomic_max(target, as_int(v));
}

// --- a brick among the blocks ---

typedef struct {
  int block, x, y, z;            // in its block
  int bx, by, bz;                // in the grid
  int last_x, last_y, last_z;    // its nodes' last indices
  size_t slot;                   // of results
  __global const float* gold;    // its first node
  __global const float* margin;  // alike
  int row;                       // columns of a row
  VdvrBrick brick;
} Place;

// False where there is no such brick, or nobody wants it.
static inline bool find_place(Place* p, int x, int y, int layer, __global const float* gold,
                              __global const float* margin, __global const uint* bricks, VdvrGrid grid,
                              __global const int4* first_brick, __global const uchar* selected,
                              VdvrGoldShape s) {
  p->block = layer / s.bricks_z;
  p->x = x;
  p->y = y;
  p->z = layer - p->block * s.bricks_z;
  if (x >= s.bricks_x || y >= s.bricks_y || p->block >= s.blocks) return false;
  const int4 first = first_brick[p->block];
  p->bx = first.x + x;
  p->by = first.y + y;
  p->bz = first.z + p->z;
  if (p->bx >= grid.bricks_x || p->by >= grid.bricks_y || p->bz >= grid.bricks_z) return false;
  const size_t brick = ((size_t)p->bz * grid.bricks_y + p->by) * grid.bricks_x + p->bx;
  if (!selected[brick]) return false;
  const int g = grid.granularity;
  p->last_x = min(g, grid.cells_x - p->bx * g) * s.rate;
  p->last_y = min(g, grid.cells_y - p->by * g) * s.rate;
  p->last_z = min(g, grid.cells_z - p->bz * g) * s.rate;
  p->slot = (((size_t)p->block * s.bricks_z + p->z) * s.bricks_y + y) * s.bricks_x + x;
  p->row = s.nx + 2 * s.halo;
  const size_t column = ((size_t)p->block * (s.ny + 2 * s.halo) + y * VDVR_BRICK_NODES + s.halo) * p->row +
                        x * VDVR_BRICK_NODES + s.halo;
  p->gold = gold + column * s.gold_stride + p->z * VDVR_BRICK_NODES + s.halo;
  p->margin = margin + column;
  p->brick = vdvr_brick(bricks, grid, brick);
  return true;
}

// V on a column of nodes: between the samples of a level, whose first lies at node 0. Gold nodes are dyadic
// fractions of a cell: these cell coordinates are exact.
typedef struct {
  VdvrLocal x, y;
  int per_interval;
  float interval;
} Column;
static inline Column column_of(const Place* p, int ix, int iy, VdvrGrid grid, int rate) {
  const int g = grid.granularity;
  const float to_cells = inverse_of_power(rate), cx = (float)(p->bx * g) + (float)ix * to_cells,
              cy = (float)(p->by * g) + (float)iy * to_cells;
  Column c;
  c.x = vdvr_local(cx, p->bx, p->brick.level_x, g, grid.cells_x, grid.coarse_x);
  c.y = vdvr_local(cy, p->by, p->brick.level_y, g, grid.cells_y, grid.coarse_y);
  c.per_interval = (rate << grid.coarse_z) >> p->brick.level_z;
  c.interval = inverse_of_power(c.per_interval);
  return c;
}
static inline float field_at(const Place* p, const Column* c, __global const uchar* samples, int k) {
  // The last node belongs to the interval below it.
  const int index = k < p->last_z ? k / c->per_interval : (p->last_z - 1) / c->per_interval;
  return vdvr_lerp(vdvr_sample_in_plane(samples, p->brick, c->x, c->y, index),
                   vdvr_sample_in_plane(samples, p->brick, c->x, c->y, index + 1),
                   (float)(k - index * c->per_interval) * c->interval);
}

#if VDVR_LANES > 1
// V at VDVR_LANES + 1 nodes from `begin` on, interval by interval: two planes serve all nodes between them.
// Beyond the last node anything finite. `out` has room for eight more.
static inline ALWAYS_INLINE void field_along(const Place* p, const Column* c, __global const uchar* samples,
                                             int begin, float* out) {
  const int end = min(begin + VDVR_LANES, p->last_z), per = c->per_interval;
  int index = min(begin, p->last_z - 1) / per;
  float low = vdvr_sample_in_plane(samples, p->brick, c->x, c->y, index);
  for (; index * per < end || index * per == begin; ++index) {
    const float high = vdvr_sample_in_plane(samples, p->brick, c->x, c->y, index + 1);
    const int from = max(index * per, begin);
    if (per >= 8)
      for (int k = from; k <= end && k <= (index + 1) * per; k += 8) {
        const float8 t = (float8)((float)(k - index * per)) + (float8)(0, 1, 2, 3, 4, 5, 6, 7);
        vstore8((1.0f - t * c->interval) * low + t * c->interval * high, 0, out + k - begin);
      }
    else
      for (int k = from; k <= end && k <= (index + 1) * per; ++k)
        out[k - begin] = vdvr_lerp(low, high, (float)(k - index * per) * c->interval);
    low = high;
    if ((index + 1) * per >= end) break;
  }
  for (int k = end + 1; k <= begin + VDVR_LANES; ++k) out[k - begin] = 0.0f;
}
#endif

#if VDVR_LANES == 8
// V on a row of columns at nodes begin .. begin + 8, where planes of samples lie four nodes apart or more:
// three planes serve them all. The sampler's text in vectors, operation by operation: planes in the lanes of
// a float4, then heights; a weight of 0 adds nothing.
typedef struct {
  int per_x, per_y;               // nodes to an interval of samples
  float of_x, of_y;               // 1 / those
  size_t first;                   // the brick's first sample of the lowest plane
  size_t to_1, to_2;              // the next planes
  float8 low_0, low_1, low_2;     // weights of planes at nodes begin + 0 .. 7
  float8 high_0, high_1, high_2;  // and begin + 1 .. 8
} Planes;

static inline ALWAYS_INLINE void weights_of(float8* w0, float8* w1, float8* w2, int8 from_plane, int per) {
  const int8 second = from_plane >= per;
  const float8 t = convert_float8(from_plane - (second ? (int8)per : (int8)0)) * inverse_of_power(per);
  const float8 none = (float8)(0.0f);
  *w0 = second ? none : 1.0f - t;
  *w1 = second ? 1.0f - t : t;
  *w2 = second ? t : none;
}

static inline ALWAYS_INLINE Planes planes_of(const Place* p, VdvrGrid grid, int rate, int begin) {
  Planes f;
  f.per_x = (rate << grid.coarse_x) >> p->brick.level_x;
  f.per_y = (rate << grid.coarse_y) >> p->brick.level_y;
  f.of_x = inverse_of_power(f.per_x);
  f.of_y = inverse_of_power(f.per_y);
  const int per = (rate << grid.coarse_z) >> p->brick.level_z, lowest = begin / per;
  const size_t stride = p->brick.stride_z;
  f.first = p->brick.place + lowest * stride;
  f.to_1 = stride;
  f.to_2 = min(2, p->last_z / per - lowest) * stride;
  const int8 from_plane = begin - lowest * per + INDEX;
  weights_of(&f.low_0, &f.low_1, &f.low_2, from_plane, per);
  weights_of(&f.high_0, &f.high_1, &f.high_2, from_plane + 1, per);
  return f;
}

static inline ALWAYS_INLINE float stored(__global const uchar* samples, const VdvrBrick* b, size_t i) {
  if (VDVR_HOLDS(*b, VDVR_F32)) return ((__global const float*)samples)[i];
  const float code =
      VDVR_HOLDS(*b, VDVR_U16) ? (float)((__global const ushort*)samples)[i] : (float)samples[i];
  return code * b->scale + b->bias;
}
static inline ALWAYS_INLINE float4 planes_at(const Planes* f, __global const uchar* samples,
                                             const VdvrBrick* b, size_t i) {
  return (float4)(stored(samples, b, i), stored(samples, b, i + f->to_1), stored(samples, b, i + f->to_2),
                  0.0f);
}
#define LERP(a, b, t) ((1.0f - (t)) * (a) + (t) * (b))
#endif

// --- the test ---

// NaN comes through where it is the second.
#define MORE(a, b) ((a) > (b) ? (a) : (b))
#define LESS(a, b) ((a) < (b) ? (a) : (b))

// What corners give: the largest of V - gold and of its negative, of second differences along x, y, z and of
// their negatives, and of gold and its negative for the window.
#if VDVR_WINDOWED
#define FOR_PARTS(M) M(ep) M(em) M(xp) M(xm) M(yp) M(ym) M(zp) M(zm) M(gp) M(gm)
#else
#define FOR_PARTS(M) M(ep) M(em) M(xp) M(xm) M(yp) M(ym) M(zp) M(zm)
#endif
#define DECLARE(part) VEC part;
typedef struct {
  FOR_PARTS(DECLARE)
} Corners;
#define LARGER(part) out.part = MORE(a.part, b.part);
static inline ALWAYS_INLINE Corners larger(Corners a, Corners b) {
  Corners out;
  FOR_PARTS(LARGER)
  return out;
}

// Gold at both ends of edges along z.
typedef struct {
  VEC low, high;
} Ends;
static inline ALWAYS_INLINE Ends gold_at(__global const float* c) {
  Ends e;
  e.low = READ(c);
  e.high = READ(c + 1);
  return e;
}

// Of both ends of edges along z from node z of a column on, between the columns before and after it in x.
static inline ALWAYS_INLINE Corners ends_of(__global const float* c, Ends before, Ends here, Ends after,
                                            int to_y) {
  const VEC low2 = 2.0f * here.low, high2 = 2.0f * here.high;
  const VEC x0 = before.low + after.low - low2, x1 = before.high + after.high - high2,
            y0 = READ(c - to_y) + READ(c + to_y) - low2, y1 = READ(c + 1 - to_y) + READ(c + 1 + to_y) - high2,
            z0 = READ(c - 1) + here.high - low2, z1 = here.low + READ(c + 2) - high2;
  Corners out;
  out.xp = MORE(x0, x1);
  out.xm = -LESS(x0, x1);
  out.yp = MORE(y0, y1);
  out.ym = -LESS(y0, y1);
  out.zp = MORE(z0, z1);
  out.zm = -LESS(z0, z1);
#if VDVR_WINDOWED
  out.gp = MORE(here.low, here.high);
  out.gm = -LESS(here.low, here.high);
#endif
  return out;
}
// V - gold there.
static inline ALWAYS_INLINE void add_errors(Corners* out, VEC low_v, VEC high_v, Ends gold, INT low_tested,
                                            INT high_tested) {
  const VEC unlimited = (VEC)(INFINITY);
  VEC e0 = low_v - gold.low, e1 = high_v - gold.high;
  // NaN would drop out of a maximum.
  e0 = select(unlimited, e0, fabs(e0) <= FLT_MAX);
  e1 = select(unlimited, e1, fabs(e1) <= FLT_MAX);
  out->ep = MORE(select(-unlimited, e0, low_tested), select(-unlimited, e1, high_tested));
  out->em = MORE(select(-unlimited, -e0, low_tested), select(-unlimited, -e1, high_tested));
}

// The part of a closed brick that a node lies on along one axis: 0 low border, 1 inside, 2 high border.
static inline int part_of(int i, int last) { return i == 0 ? 0 : (i == last ? 2 : 1); }

// One bit for each of a brick's 27 parts (corners, edges, faces, inside) that hold a corner of this cell at
// which its test fails.
int failing_parts(const Place* p, __global const uchar* samples, VdvrGrid grid, VdvrGoldShape s,
                  VdvrCellTest test, float tolerance, int x, int y, int z, float below, float above) {
  int parts = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int ix = x + (corner & 1), iy = y + (corner >> 1 & 1), iz = z + (corner >> 2);
    const int node = p->z * VDVR_BRICK_NODES + iz;
    const size_t column = (size_t)iy * p->row + ix;
    if (p->margin[column] < s.lowest || node < test.z_first || node > test.z_last) continue;
    const Column at = column_of(p, ix, iy, grid, s.rate);
    const float e = field_at(p, &at, samples, iz) - p->gold[column * s.gold_stride + iz];
    if (!(fmax(e + below, above - e) <= tolerance))
      parts |= 1 << (part_of(iz, p->last_z) * 9 + part_of(iy, p->last_y) * 3 + part_of(ix, p->last_x));
  }
  return parts;
}

// Cells along x of a work-item. Few, so that what it keeps of the row before stays in registers, or all of a
// brick: then no column is looked at twice.
#ifndef VDVR_CELLS_X
#define VDVR_CELLS_X VDVR_BRICK_NODES
#endif
#if VDVR_CELLS_X < VDVR_BRICK_NODES
#define UNROLL_X _Pragma("unroll")
#else
#define UNROLL_X
#endif

// One work-item does VDVR_LANES heights of VDVR_CELLS_X cells along x of a brick, where these meet the box of
// cells that is asked for. passed: the largest total that the tolerance allows; open: a box that holds the
// cells of larger ones. violated: the failing parts, where test.parts asks for them.
__kernel void cell_test(volatile __global int* total, volatile __global int* error,
                        volatile __global int* slack_max, volatile __global int* passed,
                        volatile __global int* open, volatile __global int* violated,
                        __global const int* boxes, __global const uchar* samples, __global const uint* bricks,
                        VdvrGrid grid, __global const float* gold, __global const float* addend,
                        __global const float* tolerances, __global const float* margin,
                        __global const int4* first_brick, __global const uchar* selected, VdvrGoldShape s,
                        VdvrCellTest test) {
  const int begin = (int)get_global_id(0) * VDVR_LANES;
  const int runs_x = (VDVR_BRICK_NODES + VDVR_CELLS_X - 1) / VDVR_CELLS_X,
            bricks_across = (int)get_global_id(1) / runs_x, by = bricks_across / s.bricks_x,
            first_x = ((int)get_global_id(1) - bricks_across * runs_x) * VDVR_CELLS_X;
  Place p;
  if (!find_place(&p, bricks_across - by * s.bricks_x, by, (int)get_global_id(2), gold, margin, bricks, grid,
                  first_brick, selected, s) ||
      begin >= p.last_z || first_x >= p.last_x)
    return;
  __global const int* box = boxes + 6 * p.slot;
  const int begin_y = box[1], end_x = min(p.last_x, box[3]), end_y = min(p.last_y, box[4]);
#if VDVR_CELLS_X < VDVR_BRICK_NODES
  const int begin_x = first_x;  // so that the loop along x has one length
#else
  const int begin_x = box[0];
#endif
  if (first_x + VDVR_CELLS_X <= box[0] || first_x >= end_x || begin_y >= end_y ||
      begin + VDVR_LANES <= box[2] || begin >= box[5])
    return;
  const float tolerance = tolerances[p.slot];
  const VEC rest = (VEC)(addend[p.slot]), unlimited = (VEC)(INFINITY), none = (VEC)(0.0f);
  const int to_x = s.gold_stride, to_y = p.row * s.gold_stride;
  const INT node = begin + p.z * VDVR_BRICK_NODES + INDEX, cell = begin + INDEX;
  const INT low_tested = (node >= test.z_first) & (node <= test.z_last), inside = cell < p.last_z,
            end_tested = (node + 1 >= test.z_first) & (node + 1 <= test.z_last) & inside;
  VEC largest_total = -unlimited, largest_error = -unlimited, largest_slack = -unlimited,
      largest_passed = -unlimited;
  int parts = 0, low_x = INT_MAX, low_y = INT_MAX, low_z = INT_MAX, high_x = 0, high_y = 0, high_z = 0;
  Corners before[VDVR_CELLS_X];
#if VDVR_LANES == 8
  const bool by_planes = (s.rate << grid.coarse_z) >> p.brick.level_z >= 4;
  Planes f;
  if (by_planes) f = planes_of(&p, grid, s.rate, begin);
#endif
  for (int iy = begin_y; iy <= end_y; ++iy) {
    Corners left;
    __global const float* c = p.gold + ((size_t)iy * p.row + begin_x) * s.gold_stride + begin;
    Ends gold_before = gold_at(c - to_x), gold = gold_at(c);
#if VDVR_LANES == 8
    // Samples below and above this row, at the near and the far end of an interval of columns.
    float4 near_0 = (float4)(0.0f), near_1 = near_0, far_0 = near_0, far_1 = near_0;
    int interval = 0, in_interval = 0, jy = 0;
    float fy = 0;
    size_t row_first = 0;
    if (by_planes) {
      jy = min(iy, p.last_y - 1) / f.per_y;
      fy = (float)(iy - jy * f.per_y) * f.of_y;
      interval = min(begin_x, p.last_x - 1) / f.per_x;
      in_interval = begin_x - interval * f.per_x;
      row_first = f.first + (size_t)jy * p.brick.stride_y;
      near_0 = planes_at(&f, samples, &p.brick, row_first + interval);
      near_1 = planes_at(&f, samples, &p.brick, row_first + p.brick.stride_y + interval);
      far_0 = planes_at(&f, samples, &p.brick, row_first + interval + 1);
      far_1 = planes_at(&f, samples, &p.brick, row_first + p.brick.stride_y + interval + 1);
    }
#endif
    UNROLL_X
    for (int cell_x = 0; cell_x <= VDVR_CELLS_X; ++cell_x) {
      const int ix = begin_x + cell_x;
      if (ix > end_x) break;
      const size_t column = (size_t)iy * p.row + ix;
      const int tested = p.margin[column] >= s.lowest;
      const Ends gold_after = gold_at(c + to_x);
      Corners here = ends_of(c, gold_before, gold, gold_after, to_y);
      here.ep = here.em = -unlimited;
#if VDVR_LANES == 8
      if (by_planes) {
        // The last column belongs to the interval below it.
        if (in_interval == f.per_x && ix < p.last_x) {
          in_interval = 0;
          ++interval;
          near_0 = far_0;
          near_1 = far_1;
          far_0 = planes_at(&f, samples, &p.brick, row_first + interval + 1);
          far_1 = planes_at(&f, samples, &p.brick, row_first + p.brick.stride_y + interval + 1);
        }
        const float fx = (float)in_interval * f.of_x;
        ++in_interval;
        const float4 q = LERP(LERP(near_0, far_0, fx), LERP(near_1, far_1, fx), fy);
        if (tested)
          add_errors(&here, q.s0 * f.low_0 + q.s1 * f.low_1 + q.s2 * f.low_2,
                     q.s0 * f.high_0 + q.s1 * f.high_1 + q.s2 * f.high_2, gold, low_tested, end_tested);
      } else
#endif
          if (tested) {
        const Column at = column_of(&p, ix, iy, grid, s.rate);
#if VDVR_LANES == 1
        const float low_v = field_at(&p, &at, samples, begin), high_v = field_at(&p, &at, samples, begin + 1);
#else
        float v[VDVR_LANES + 12];
        field_along(&p, &at, samples, begin, v);
        const VEC low_v = READ_OWN(v), high_v = READ_OWN(v + 1);
#endif
        add_errors(&here, low_v, high_v, gold, low_tested, end_tested);
      }
      SOON(c + 2 * to_y);
      c += to_x;
      gold_before = gold;
      gold = gold_after;
      if (cell_x > 0) {
        const Corners face = larger(left, here);
        if (iy > begin_y) {
          const Corners all = larger(before[cell_x - 1], face);
          VEC below = (MORE(none, all.xp) + MORE(none, all.yp) + MORE(none, all.zp)) * test.curvature + rest,
              above = (MORE(none, all.xm) + MORE(none, all.ym) + MORE(none, all.zm)) * test.curvature + rest;
          // Whatever is no number here is no bound.
          below = select(unlimited, below, below <= FLT_MAX);
          above = select(unlimited, above, above <= FLT_MAX);
          if (!test.counted) below = above = (VEC)(0.0f);
          // No corner is tested: -e and e are both -infinity.
          INT counts = inside & (all.ep > -unlimited);
#if VDVR_WINDOWED
          // F may enter the window between corners that computed gold leaves out of it: by no more than the
          // slack.
          counts &= (-all.gm - below <= test.window_high) & (all.gp + above >= test.window_low);
#endif
          const VEC both = select(-unlimited, MORE(all.ep + below, all.em + above), counts);
          largest_total = MORE(largest_total, both);
          largest_error = MORE(largest_error, select(-unlimited, MORE(all.ep, all.em), counts));
          largest_passed = MORE(largest_passed, select(-unlimited, both, both <= tolerance));
          if (ANY(both > tolerance)) {
            float totals[VDVR_LANES], belows[VDVR_LANES], aboves[VDVR_LANES];
            WRITE_OWN(both, totals);
            WRITE_OWN(below, belows);
            WRITE_OWN(above, aboves);
            for (int i = 0; i < VDVR_LANES; ++i) {
              if (!(totals[i] > tolerance)) continue;
              low_z = min(low_z, begin + i);
              high_z = max(high_z, begin + i + 1);
              if (test.parts)
                parts |= failing_parts(&p, samples, grid, s, test, tolerance, ix - 1, iy - 1, begin + i,
                                       belows[i], aboves[i]);
            }
            low_x = min(low_x, ix - 1);
            high_x = max(high_x, ix);
            low_y = min(low_y, iy - 1);
            high_y = max(high_y, iy);
          }
          largest_slack = MORE(largest_slack, select(-unlimited, MORE(below, above), counts));
        }
        before[cell_x - 1] = face;
      }
      left = here;
    }
  }
  const float found = LARGEST(largest_slack);
  if (found < 0.0f) return;
  if (parts) atomic_or(violated + p.slot, parts);
  if (high_x > 0) {
    volatile __global int* failing = open + 6 * p.slot;
    atomic_min(failing, low_x);
    atomic_min(failing + 1, low_y);
    atomic_min(failing + 2, low_z);
    atomic_max(failing + 3, high_x);
    atomic_max(failing + 4, high_y);
    atomic_max(failing + 5, high_z);
  }
  const float within = LARGEST(largest_passed);
  if (within >= 0.0f) raise(passed + p.slot, within);
  raise(slack_max + p.slot, found);
  raise(total + p.slot, fmax(LARGEST(largest_total), 0.0f));
  raise(error + p.slot, fmax(LARGEST(largest_error), 0.0f));
}
