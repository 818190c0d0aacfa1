// Tiles fitted to the trilinear filter, and tested (docs/error-bounds.md, sections 13 and 15): a work-group
// does a brick, from gold at the nodes of its level to the largest that |interpolant - F| may be at its
// nodes, in arrays of its own that caches hold. Targets lie half a sample apart: there the interpolant errs
// most. Layouts: gold float[block][y + halo][x + halo][gold_stride], node z at z + halo; margin
// float[block][y + halo][x + halo]; above, below float[block][y][x][stride] (node_slack.cl). Arrays of a
// brick, one behind the other: samples before and after a step, float[cy][cx][stride] each; targets
// float[ty][tx][planes][stride], where an axis with a spacing of 1 has as many as samples, the others one
// less than twice as many; of planes the first is of samples' heights, the second of those half a sample
// below them; all have sample k at k + 1. Then the brick's own columns, interpolated along z at every node:
// float[side_y][side_x][VDVR_TILE_COLUMN], and room for a column of nodes. Called by
// host/certify/gold/fit_tiles.cpp.
#include "device/lanes.h"
#include "device/fit_sample.h"
#include "device/powers.h"
#include "device/shared_column.h"
#include "shared/gold_shape.h"
#include "shared/lattice_shape.h"

#ifndef VDVR_BRICK_NODES
#error "VDVR_BRICK_NODES must be granularity * gold rate"
#endif
#if VDVR_ALONG > 1 && VDVR_LANES > 1
#error "work-items that share a brick have a height each"
#endif
#define VDVR_TILE_COLUMN ((VDVR_BRICK_NODES + 16) / 16 * 16)

// What one work-item has written the others of its group read.
#if VDVR_ALONG == 1
#define WRITTEN
#else
#define WRITTEN barrier(CLK_GLOBAL_MEM_FENCE);
#endif

// Targets along an axis with `samples` samples, and how many nodes apart.
static inline int targets_along(int samples, int spacing) { return spacing > 1 ? 2 * samples - 1 : samples; }
static inline int half_of(int spacing) { return max(spacing / 2, 1); }

// Gold at the lattice's samples.
static inline void take_samples(__global float* samples, __global const float* gold, VdvrTileFit t,
                                VdvrGoldShape s) {
  const int row = s.nx + 2 * s.halo, each = VDVR_ALONG > 1 ? 1 : t.cz, parts = t.cz / each;
  for (int i = OWN_PART; i < t.cy * t.cx * parts; i += VDVR_ALONG) {
    const int column = i / parts, k0 = (i - column * parts) * each, y = column / t.cx, x = column - y * t.cx;
    const int gx = t.node_x + (x - t.before_x) * t.spacing_x + s.halo,
              gy = t.node_y + (y - t.before_y) * t.spacing_y + s.halo;
    __global const float* from = gold +
                                 (((size_t)t.block * (s.ny + 2 * s.halo) + gy) * row + gx) * s.gold_stride +
                                 t.node_z - t.before_z * t.spacing_z + s.halo;
    __global float* to = samples + (size_t)column * t.stride + 1;
    for (int k = k0; k < k0 + each; ++k) to[k] = from[k * t.spacing_z];
  }
}

// Gold less `curvature` of its second differences, at targets; NaN where the field is not tested. At the rims
// of the halo, which has no differences, it is gold. `line`: room for the nodes of a column, which vectors
// take one after the other, and of which few are targets.
static inline void take_targets(__global float* targets, __global float* line, __global const float* gold,
                                __global const float* margin, VdvrTileFit t, VdvrGoldShape s, int z_first,
                                int z_last, float curvature) {
  const int row = s.nx + 2 * s.halo, deep = s.ny + 2 * s.halo, top = s.nz + 2 * s.halo - 1;
  const int tx = targets_along(t.cx, t.spacing_x), ty = targets_along(t.cy, t.spacing_y),
            planes = t.spacing_z > 1 ? 2 : 1, half_z = t.spacing_z / 2;
  const int each = VDVR_ALONG > 1 ? 1 : t.cz, parts = t.cz / each;
  const long to_y = (long)row * s.gold_stride;
  for (int i = OWN_PART; i < ty * tx * parts; i += VDVR_ALONG) {
    const int column = i / parts, k0 = (i - column * parts) * each, y = column / tx, x = column - y * tx;
    const int gx = t.node_x - t.before_x * t.spacing_x + x * half_of(t.spacing_x) + s.halo,
              gy = t.node_y - t.before_y * t.spacing_y + y * half_of(t.spacing_y) + s.halo;
    const size_t of_gold = ((size_t)t.block * deep + gy) * row + gx;
    const int counts = margin[of_gold] >= s.lowest,
              rim = gx == 0 || gy == 0 || gx + 1 == row || gy + 1 == deep;
    // From the node of sample k0 to that of the last one.
    const int first = t.node_z + (k0 - t.before_z) * t.spacing_z + s.halo;
    __global const float* from = gold + of_gold * s.gold_stride + first;
    __global float* to = targets + (size_t)column * planes * t.stride + k0 + 1;
#define TARGETS_AT(n, out)                                                                              \
  {                                                                                                     \
    VEC v = (VEC)(NAN);                                                                                 \
    if (counts) {                                                                                       \
      const INT z = first + (n) + INDEX;                                                                \
      const VEC f = READ(from + (n));                                                                   \
      v = f;                                                                                            \
      if (!rim) {                                                                                       \
        const VEC around = READ(from + (n)-1) + READ(from + (n) + 1) + READ(from + (n)-s.gold_stride) + \
                           READ(from + (n) + s.gold_stride) + READ(from + (n)-to_y) +                   \
                           READ(from + (n) + to_y);                                                     \
        v = select(fma((VEC)(-curvature), fma((VEC)(-6.0f), f, around), f), f, (z <= 0) | (z >= top));  \
      }                                                                                                 \
      v = select((VEC)(NAN), v, (z - s.halo >= z_first) & (z - s.halo <= z_last));                      \
    }                                                                                                   \
    WRITE(v, out);                                                                                      \
  }
#if VDVR_ALONG > 1
    TARGETS_AT(0, to)
    if (planes > 1 && k0 > 0) TARGETS_AT(-half_z, to + t.stride)
#else
    __global float* of_line = t.spacing_z > 1 ? line : to;
    for (int n = 0; n <= (t.cz - 1) * t.spacing_z; n += VDVR_LANES) TARGETS_AT(n, of_line + n)
    if (planes > 1)
      for (int k = 0; k < t.cz; ++k) {
        to[k] = line[k * t.spacing_z];
        to[t.stride + k] = line[max(k * t.spacing_z - half_z, 0)];
      }
#endif
    // Below the first sample and above the last one there is no cell.
    if (planes > 1 && k0 == 0) to[t.stride] = NAN;
    if (planes > 1 && k0 + each == t.cz) to[t.stride + each] = NAN;
  }
}

// One step of the brick's own samples and of so many around them as the lattice has.
static inline void fit_step(__global float* out, __global const float* in, __global const float* targets,
                            VdvrTileFit t, int around, float share) {
  const int x0 = max(t.before_x - around, 0), x1 = min(t.before_x + t.side_x + around, t.cx),
            y0 = max(t.before_y - around, 0), y1 = min(t.before_y + t.side_y + around, t.cy),
            z0 = max(t.before_z - around, 0), z1 = min(t.before_z + t.side_z + around, t.cz);
  const int tx = targets_along(t.cx, t.spacing_x), planes = t.spacing_z > 1 ? 2 : 1,
            of_x = t.spacing_x > 1 ? 2 : 1, of_y = t.spacing_y > 1 ? 2 : 1;
  const int wide = x1 - x0, runs = (z1 - z0 + VDVR_LANES - 1) / VDVR_LANES;
  const long target_x = (long)planes * t.stride, target_y = (long)tx * target_x;
  for (int i = OWN_PART; i < (y1 - y0) * wide * runs; i += VDVR_ALONG) {
    const int column = i / runs, k = z0 + (i - column * runs) * VDVR_LANES, row = column / wide;
    const int y = y0 + row, x = x0 + column - row * wide;
    const VdvrAround around_it = {of_x > 1 && x > 0,
                                  of_x > 1 && x + 1 < t.cx,
                                  of_y > 1 && y > 0,
                                  of_y > 1 && y + 1 < t.cy,
                                  t.stride,
                                  (long)t.cx * t.stride,
                                  target_x,
                                  target_y,
                                  planes > 1 ? t.stride : 0};
    const size_t sample = ((size_t)y * t.cx + x) * t.stride + k + 1;
    const VEC moved =
        fitted(in + sample, targets + of_y * y * target_y + of_x * x * target_x + k + 1, around_it, share);
    WRITE(moved, out + sample);
  }
}

// The brick's own columns at all of its nodes.
static inline void interpolate_along(__global float* along, __global const float* samples, VdvrTileFit t) {
  const float step = inverse_of_power(t.spacing_z);
  const int each = VDVR_ALONG > 1 ? 1 : t.side_z, parts = t.side_z / each;
  for (int i = OWN_PART; i < t.side_y * t.side_x * parts; i += VDVR_ALONG) {
    const int column = i / parts, k0 = (i - column * parts) * each, y = column / t.side_x,
              x = column - y * t.side_x;
    __global const float* from =
        samples + ((size_t)(y + t.before_y) * t.cx + x + t.before_x) * t.stride + t.before_z + 1;
    __global float* to = along + (size_t)column * VDVR_TILE_COLUMN;
    for (int k = k0; k < k0 + each; ++k) {
      const float low = from[k];
      if (k + 1 == t.side_z) {
        to[k * t.spacing_z] = low;
        break;
      }
      const float high = from[k + 1];
      for (int n = 0; n < t.spacing_z; ++n) {
        const float f = (float)n * step;
        to[k * t.spacing_z + n] = fma(1.0f - f, low, f * high);
      }
    }
  }
}

// The level's interpolant less gold at VDVR_LANES nodes of one column, or gold itself at 1x spacing.
#define ERROR_AT(z)                                                                                   \
  (fma((VEC)(1.0f - fy), fma((VEC)(1.0f - fx), READ(a + (z)), fx * READ(a + VDVR_TILE_COLUMN + (z))), \
       fy * fma((VEC)(1.0f - fx), READ(b + (z)), fx * READ(b + VDVR_TILE_COLUMN + (z)))) -            \
   READ(gold_column + (z)))

// The largest that |interpolant - F| may be at a work-item's nodes of the closed brick; negative where it
// tests none.
static inline float test_nodes(__global const float* along, __global const float* gold,
                               __global const float* above, __global const float* below,
                               __global const float* margin, VdvrTileFit t, VdvrGoldShape s) {
  const int side = VDVR_BRICK_NODES + 1, nodes = min(side, s.nz - t.node_z),
            runs = (nodes + VDVR_LANES - 1) / VDVR_LANES, each = VDVR_ALONG > 1 ? 1 : runs,
            parts = runs / each;
  const int wide = min(side, s.nx - t.node_x), deep = min(side, s.ny - t.node_y);
  float largest = -1.0f;
  for (int i = OWN_PART; i < deep * wide * parts; i += VDVR_ALONG) {
    const int column = i / parts, run = (i - column * parts) * each, v = column / wide, u = column - v * wide;
    const int x = t.node_x + u, y = t.node_y + v;
    const size_t gold_at =
        ((size_t)t.block * (s.ny + 2 * s.halo) + y + s.halo) * (s.nx + 2 * s.halo) + x + s.halo;
    if (margin[gold_at] < s.lowest) continue;
    // The last column is no cell's lower end.
    const int ix = min(u / t.spacing_x, t.side_x - 2), iy = min(v / t.spacing_y, t.side_y - 2);
    const float fx = (float)(u - ix * t.spacing_x) * inverse_of_power(t.spacing_x),
                fy = (float)(v - iy * t.spacing_y) * inverse_of_power(t.spacing_y);
    __global const float* a = along + ((size_t)iy * t.side_x + ix) * VDVR_TILE_COLUMN;
    __global const float* b = a + (size_t)t.side_x * VDVR_TILE_COLUMN;
    __global const float* gold_column = gold + gold_at * s.gold_stride + s.halo + t.node_z;
    const size_t of_slack = (((size_t)t.block * s.ny + y) * s.nx + x) * s.stride + t.node_z;
    __global const float *above_column = above + of_slack, *below_column = below + of_slack;
    // Whole runs of lanes, then the rest one by one: beyond the block lies what no lane may count.
    const int end = min((run + each) * VDVR_LANES, nodes);
    int z = run * VDVR_LANES;
    for (; z + VDVR_LANES <= end; z += VDVR_LANES) {
      const VEC e = ERROR_AT(z);
      largest = fmax(largest, LARGEST(fmax(e + READ(below_column + z), READ(above_column + z) - e)));
    }
#if VDVR_LANES > 1
    for (; z < end; ++z) {
      const float value = fma(1.0f - fy, fma(1.0f - fx, a[z], fx * a[VDVR_TILE_COLUMN + z]),
                              fy * fma(1.0f - fx, b[z], fx * b[VDVR_TILE_COLUMN + z]));
      const float e = value - gold_column[z];
      largest = fmax(largest, fmax(e + below_column[z], above_column[z] - e));
    }
#endif
  }
  return largest;
}

// The fitted samples lie in the first array of a brick after an even number of steps, else in the second.
__kernel SHARED_COLUMN void fit_tiles(__global float* errors, __global float* room,
                                      __global const VdvrTileFit* tiles, int count,
                                      __global const float* gold, __global const float* above,
                                      __global const float* below, __global const float* margin,
                                      VdvrGoldShape s, int z_first, int z_last, int steps, int tested,
                                      float curvature, float share, SHARED_ROOM) {
  const int n = (int)get_global_id(0) / VDVR_ALONG;
  if (n >= count) return;
  const VdvrTileFit t = tiles[n];
  const size_t lattice = (size_t)t.cy * t.cx * t.stride,
               of_targets = (size_t)targets_along(t.cy, t.spacing_y) * targets_along(t.cx, t.spacing_x) *
                            (t.spacing_z > 1 ? 2 : 1) * t.stride;
  __global float* samples = room + t.room;
  __global float* others = samples + lattice;
  __global float* targets = others + lattice;
  __global float* along = targets + of_targets;
  __global float* line = along + (size_t)t.side_y * t.side_x * VDVR_TILE_COLUMN;
  take_samples(samples, gold, t, s);
  if (steps > 0) take_targets(targets, line, gold, margin, t, s, z_first, z_last, curvature);
  WRITTEN
  for (int step = 0; step < steps; ++step) {
    fit_step(others, samples, targets, t, steps - 1 - step, share);
    WRITTEN
    __global float* moved = others;
    others = samples;
    samples = moved;
  }
  if (!tested) return;
  interpolate_along(along, samples, t);
  WRITTEN
  const float largest = LARGEST_OF_GROUP(test_nodes(along, gold, above, below, margin, t, s));
  if (OWN_PART == 0) errors[n] = largest;
}
