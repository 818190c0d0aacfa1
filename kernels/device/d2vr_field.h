// The field of D2VR at the points of a packet, and its gradient: the sum over the views of the filtered
// projections (weights included), bilinear between detector samples (Rautek, Csebfalvi, Grimm, Bruckner and
// Groeller 2006). It is 0 where a view misses the point; above and below the detector the outermost row
// counts. Lane by lane the same operations in the same order. Included by d2vr.cl, in the place of
// packet_sampler.h.
//
// Layouts: field[view][u][v], because a bilinear footprint then takes two neighbours in two columns; what
// stands where brick records stand for stored volumes, `bricks`, is one float4 a view: column = x c.x + y c.y
// + z for c in cells.
#ifndef VDVR_D2VR_FIELD_H
#define VDVR_D2VR_FIELD_H

#define FIELD __global const float* restrict field, VdvrDetector detector
#define THE_FIELD field, detector
#define BRICKS __global const float4* restrict bricks

#define GRADIENT_REACH 0.5f

// Bricks of the grid of the occupancy pass; they only say what can be leapt over.
typedef struct {
  I3 at;
  V3 low, high;
  __global const float4* views;
} OpenBrick;

#include "device/packet_bricks.h"

RAY_INLINE OpenBrick open_brick(BRICKS, VdvrGrid grid, I3 at) {
  OpenBrick b = boxed_brick(grid, at);
  b.views = bricks;
  return b;
}

// Between which two of `count` samples a position lies; the nearest two where it lies beyond them.
typedef struct {
  I index;
  V fraction;
} Between;
RAY_INLINE Between between(V position, int count) {
  const V last = (V)((float)(count - 1));
  V p = LEAST(position, last);
  p = MOST(p, (V)(0.0f));
  Between b;
  b.index = TO_I(p);
  b.index = b.index > count - 2 ? (I)(count - 2) : b.index;
  b.fraction = p - TO_V(b.index);
  return b;
}

// The footprint `at` of a view: s10 is one column further than s00, s01 one row.
#define FOUR(n)                                                       \
  {                                                                   \
    const float2 near = vload2(0, view + LANE(at, n));                \
    const float2 far = vload2(0, view + LANE(at, n) + detector.rows); \
    LANE(s00, n) = near.x;                                            \
    LANE(s01, n) = near.y;                                            \
    LANE(s10, n) = far.x;                                             \
    LANE(s11, n) = far.y;                                             \
  }
#define FETCH_FOUR EACH(FOUR)

RAY_INLINE V back_projected(FIELD, __global const float4* views, V3 c) {
  const V row = detector.first_row + detector.rows_per_cell * c.z;
  const Between v = between(row, detector.rows);
  const V above = v.fraction, below = 1.0f - v.fraction;
  V sum = (V)(0.0f);
  I outside = (I)(0);
  for (int k = 0; k < detector.views; ++k) {
    const float4 step = views[k];
    const V column = step.x * c.x + (step.y * c.y + step.z);
    outside |= (column < detector.lowest_column) | (column > detector.highest_column);
    const Between u = between(column, detector.columns);
    // 32 bits address one view.
    const I at = u.index * detector.rows + v.index;
    __global const float* view = field + (ulong)k * (ulong)detector.columns * (ulong)detector.rows;
    V s00, s01, s10, s11;
    FETCH_FOUR
    sum += (1.0f - u.fraction) * (below * s00 + above * s01) + u.fraction * (below * s10 + above * s11);
  }
  return PICK(outside, (V)(0.0f), sum);
}

typedef struct {
  V value;
} Sampled;

RAY_INLINE Sampled sample_open(FIELD, const OpenBrick* b, VdvrGrid grid, V3 c) {
  Sampled s;
  s.value = back_projected(THE_FIELD, b->views, c);
  return s;
}

#if VDVR_D2VR_DERIVATIVE
// Density per length along the world axes: the derivative of the sum itself, view by view that of its
// bilinear footprint. One pass over the views instead of six; it jumps where a column or row is passed. 0
// where a view misses the point.
RAY_INLINE V3 gradient_at(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, const Sampled* k, V3 c,
                          float3 cells_per_length, I needed) {
  const V row = detector.first_row + detector.rows_per_cell * c.z;
  const Between v = between(row, detector.rows);
  const V above = v.fraction, below = 1.0f - v.fraction;
  V3 d = v3((V)(0.0f), (V)(0.0f), (V)(0.0f));
  I outside = (row < 0.0f) | (row > (float)(detector.rows - 1));
  // Above and below the detector its outermost row counts: no change along z.
  const V within = PICK(outside, (V)(0.0f), (V)(1.0f));
  outside = (I)(0);
  for (int i = 0; i < detector.views; ++i) {
    const float4 step = bricks[i];
    const V column = step.x * c.x + (step.y * c.y + step.z);
    outside |= (column < detector.lowest_column) | (column > detector.highest_column);
    const Between u = between(column, detector.columns);
    const I at = u.index * detector.rows + v.index;
    __global const float* view = field + (ulong)i * (ulong)detector.columns * (ulong)detector.rows;
    V s00, s01, s10, s11;
    FETCH_FOUR
    const V across = below * (s10 - s00) + above * (s11 - s01);
    d.x += step.x * across;
    d.y += step.y * across;
    d.z += (1.0f - u.fraction) * (s01 - s00) + u.fraction * (s11 - s10);
  }
  d.z = within * (detector.rows_per_cell * d.z);
  return v3(PICK(outside, (V)(0.0f), d.x * cells_per_length.x),
            PICK(outside, (V)(0.0f), d.y * cells_per_length.y),
            PICK(outside, (V)(0.0f), d.z * cells_per_length.z));
}
#else
// Density per length along the world axes: the central differences over one base cell that stored volumes
// have, one-sided at the grid's faces.
RAY_INLINE V3 gradient_at(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, const Sampled* k, V3 c,
                          float3 cells_per_length, I needed) {
  const V3 lo = clamp_to_grid(v3(c.x - GRADIENT_REACH, c.y - GRADIENT_REACH, c.z - GRADIENT_REACH), grid);
  const V3 hi = clamp_to_grid(v3(c.x + GRADIENT_REACH, c.y + GRADIENT_REACH, c.z + GRADIENT_REACH), grid);
  V3 d;
  // One copy of the sum over views serves all six points: inlined six times it would fill the caches.
  for (int axis = 0; axis < 3; ++axis) {
    V difference = (V)(0.0f);
    for (int side = 0; side < 2; ++side) {
      const V3 to = side == 0 ? lo : hi;
      const V3 point = v3(axis == 0 ? to.x : c.x, axis == 1 ? to.y : c.y, axis == 2 ? to.z : c.z);
      difference = back_projected(THE_FIELD, bricks, point) - difference;
    }
    if (axis == 0) d.x = difference;
    else if (axis == 1) d.y = difference;
    else d.z = difference;
  }
  return v3(d.x / (hi.x - lo.x) * cells_per_length.x, d.y / (hi.y - lo.y) * cells_per_length.y,
            d.z / (hi.z - lo.z) * cells_per_length.z);
}
#endif

#undef FETCH_FOUR
#undef FOUR
#endif
