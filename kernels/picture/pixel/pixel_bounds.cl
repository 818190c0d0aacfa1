// Intervals of pixels: what the ideal picture, emission and absorption over F, can show there
// (docs/pixel-bounds.md). certify_picture walks each ray once, front to back, keeps its pieces, and recurs
// over them back to front. certify_fast does with one pass and nothing kept, for wider intervals. Both
// samplers, packets of 1 to 16 rays.
//
// Layouts: bounds[bz][by][bx] and distance[bz][by][bx] (bricks to the nearest that may show something),
// ranges (rows of two float4, one for each bin and run of 2^k bins), next_shown[bin], least and most [y][x],
// pieces (a list for each packet), fullest[1] (pieces of the longest list). Called by
// host/picture/pixel/pixel_bounds.cpp.
#ifndef VDVR_UNIFORM
#define VDVR_UNIFORM 0
#endif
#ifndef VDVR_GRADIENT_ANALYTIC
#define VDVR_GRADIENT_ANALYTIC 0
#endif
#include "device/raycast_settings.h"
#include "shared/mixed_sampler.h"
#include "device/mixed_image.h"
#include "shared/raycast_params.h"
#include "shared/certify_params.h"
#include "device/packet.h"
#include "device/packet_sampler.h"

#include "device/raycast_dvr.h"
#include "device/certify_ray.h"

#define CERTIFY_ARGUMENTS                                                          \
  FIELD, BRICKS, VdvrGrid grid, __global const uchar *restrict distance,           \
      __global const float *restrict bounds, RANGES, VdvrRaycast p, VdvrCertify q, \
      __global float4 *restrict least, __global float4 *restrict most

// Of a packet, whose rays outside of the launch are walked for nothing.
#define PIXELS_OF_THE_LAUNCH                                                \
  const I px = q.first_column + (int)get_global_id(0) * PACKET_X + COLUMNS; \
  const I py = q.first_row + (int)get_global_id(1) * PACKET_Y + ROWS;       \
  if (!in_launch(&p, &q, LANE(px, 0), LANE(py, 0))) return

// The extremes of all that can show in a pixel of row py.
#define COLOURS_OF_THE_PIXEL                                                                            \
  const V3 behind = background(&p, py);                                                                 \
  const V3 c_least = least3(v3((V)(q.colour_lo[0]), (V)(q.colour_lo[1]), (V)(q.colour_lo[2])), behind); \
  const V3 c_most = most3(v3((V)(q.colour_hi[0]), (V)(q.colour_hi[1]), (V)(q.colour_hi[2])), behind)

#if VDVR_KERNEL == VDVR_KERNEL_CERTIFY

#if VDVR_LIGHT
#define NUMBERS VDVR_LIT_PIECE_NUMBERS
#else
#define NUMBERS VDVR_PIECE_NUMBERS
#endif
// Number n of piece k. Work-items that are lanes find theirs side by side, those that are threads together.
#if VDVR_LANES == 1
#define KEPT(k, n) list[((ulong)(k)*NUMBERS + (n)) * items + item]
#else
#define KEPT(k, n) list[(item * (ulong)q.capacity + (ulong)(k)) * NUMBERS + (n)]
#endif

__kernel VDVR_HINT void certify_picture(CERTIFY_ARGUMENTS, __global V* restrict list,
                                        __global uint* restrict fullest) {
  PIXELS_OF_THE_LAUNCH;
  const ulong item = get_global_id(1) * (ulong)q.items_x + get_global_id(0);
#if VDVR_LANES == 1
  const ulong items = (ulong)q.items;
#endif
  const V none = (V)(0.0f);
  const Ray ray = cast_rays(&p, grid, px, py);
  Walk walk = start_walk(&p, &ray, px, py);
  V depth = none;
  I flags = (I)(0), parts = (I)(0);
  int count = 0;
  while (ANY(walk.active)) {
    Piece s;
    const I shows =
        next_piece(THE_FIELD, bricks, grid, distance, bounds, THE_RANGES, &p, &q, &ray, &walk, &s);
    if (!ANY(shows)) continue;
    if (count < q.capacity) {
      KEPT(count, 0) = s.b0;
      KEPT(count, 1) = s.b1;
      KEPT(count, 2) = s.b2;
      KEPT(count, 3) = s.b3;
      KEPT(count, 4) = s.length;
      KEPT(count, 5) = s.e;
#if VDVR_LIGHT
      KEPT(count, 6) = s.lit;
      KEPT(count, 7) = s.highlight;
#endif
    }
    ++count;
    flags |= PICK(shows & (s.e == INFINITY), (I)(VDVR_PIXEL_UNTESTED), (I)(0));
    const V e = PICK(shows, s.e, none);
    const V thinnest = least_extinction(THE_RANGES, &q, PICK(shows, least_of(&s), none) - e,
                                        PICK(shows, most_of(&s), none) + e);
    depth += PICK(shows, thinnest * s.length * 0.99999f, none);
    const I ended = depth >= q.deep;
    flags |= PICK(ended, (I)(VDVR_PIXEL_ENDED), (I)(0));
    walk.active &= NOT(ended);
  }
  if (count > q.capacity) {
    atomic_max(fullest, (uint)count);
    return;
  }
  COLOURS_OF_THE_PIXEL;
  const I ended = (flags & VDVR_PIXEL_ENDED) != 0;
  V3 hi = pick3(ended, c_most, behind), minus_lo = negative3(pick3(ended, c_least, behind));
  V error = (V)(q.first_error);
  for (int k = count - 1; k >= 0; --k) {
    Piece s;
    s.b0 = KEPT(k, 0);
    s.b1 = KEPT(k, 1);
    s.b2 = KEPT(k, 2);
    s.b3 = KEPT(k, 3);
    s.length = KEPT(k, 4);
    s.e = KEPT(k, 5);
#if VDVR_LIGHT
    s.lit = KEPT(k, 6);
    s.highlight = KEPT(k, 7);
#endif
    const I n = parts_of(&q, &s);
    const Cut cut = cut_of(&s, n);
    parts += n;
    Joint joint = last_joint(&s, &cut);
    for (int j = most_lane(n); j > 0; --j) {
      const I active = j <= n;
      const Joint front = joint_at(&cut, j - 1);
      const Part part = part_between(THE_RANGES, &q, &s, &cut, front, joint, active, hi, minus_lo);
      hi = above_part(&part, hi);
      minus_lo = minus_below_part(&part, minus_lo);
      error = error_in_front(&q, &part, error);
      joint = pick_joint(active, front, joint);
    }
  }
  error = error_of_ray(&q, error, parts);
  put_interval(&p, &q, least, most, px, py, hi, minus_lo, error, c_least, c_most, parts, flags);
}

#else

// The colour in front of what was passed, as a function of the colour behind it: its upper bounds at the
// extremes of all colours, and chords between (docs/pixel-bounds.md, section 6).
typedef struct {
  V3 at_least, at_most;
} Knots;
// The extremes, and 1 over their distance.
typedef struct {
  V3 least, most, inverse;
} Extremes;
RAY_INLINE V inverse_or_0(V width) {
  const V none = (V)(0.0f), one = (V)(1.0f);
  return PICK(width > none, one / PICK(width > none, width, one), none);
}
RAY_INLINE Extremes extremes_of(V3 least, V3 most) {
  const Extremes e = {
      least, most,
      v3(inverse_or_0(most.x - least.x), inverse_or_0(most.y - least.y), inverse_or_0(most.z - least.z))};
  return e;
}
// Where between the extremes a colour stands.
RAY_INLINE V place_of(V c, V least, V inverse) {
  const V place = (c - least) * inverse, within = LEAST(place, (V)(1.0f));
  return MOST(within, (V)(0.0f));
}
// The same with a part behind that shows c at most. Before the least colour it takes its largest share of the
// way to c, before the most colourful its least.
#define PASSED(axis)                                                                   \
  {                                                                                    \
    const V width = f->at_most.axis - f->at_least.axis;                                \
    const V place = place_of(c.axis, e->least.axis, e->inverse.axis);                  \
    f->at_least.axis += PICK(part->shows, width * (place * part->dense), none);        \
    f->at_most.axis -= PICK(part->shows, width * ((1.0f - place) * part->thin), none); \
  }
RAY_INLINE void pass_part(Knots* f, const Part* part, V3 c, const Extremes* e) {
  const V none = (V)(0.0f);
  PASSED(x)
  PASSED(y)
  PASSED(z)
}
#undef PASSED
RAY_INLINE V between_knots(V a, V b, V place) { return a + (b - a) * place; }
RAY_INLINE V3 value_at(const Knots* f, V3 c, const Extremes* e) {
#define VALUE(axis) \
  between_knots(f->at_least.axis, f->at_most.axis, place_of(c.axis, e->least.axis, e->inverse.axis))
  return v3(VALUE(x), VALUE(y), VALUE(z));
#undef VALUE
}
RAY_INLINE V widest(const Knots* f) {
  const V x = f->at_most.x - f->at_least.x, y = f->at_most.y - f->at_least.y,
          z = f->at_most.z - f->at_least.z, xy = MOST(x, y);
  return MOST(xy, z);
}

__kernel VDVR_HINT void certify_fast(CERTIFY_ARGUMENTS) {
  PIXELS_OF_THE_LAUNCH;
  const Ray ray = cast_rays(&p, grid, px, py);
  Walk walk = start_walk(&p, &ray, px, py);
  I flags = (I)(0), parts = (I)(0);
  COLOURS_OF_THE_PIXEL;
  const V3 minus_behind = negative3(behind);
  const Extremes up = extremes_of(c_least, c_most), down = extremes_of(negative3(c_most), negative3(c_least));
  Knots above = {up.least, up.most}, minus_below = {down.least, down.most};
  V error = (V)(q.first_error);
  while (ANY(walk.active)) {
    Piece s;
    const I shows =
        next_piece(THE_FIELD, bricks, grid, distance, bounds, THE_RANGES, &p, &q, &ray, &walk, &s);
    if (!ANY(shows)) continue;
    flags |= PICK(shows & (s.e == INFINITY), (I)(VDVR_PIXEL_UNTESTED), (I)(0));
    s.length = PICK(shows, s.length, (V)(0.0f));
    const I n = parts_of(&q, &s);
    const Cut cut = cut_of(&s, n);
    parts += n;
    Joint joint = first_joint(&s, &cut);
    const int count = most_lane(n);
    for (int j = 1; j <= count; ++j) {
      const Joint behind_part = joint_at(&cut, j);
      const Part part =
          part_between(THE_RANGES, &q, &s, &cut, joint, behind_part, j <= n, behind, minus_behind);
      pass_part(&above, &part, part.all.c1, &up);
      pass_part(&minus_below, &part, part.all.minus_c0, &down);
      // Both knots of a bound are as far off as the further one, and no part makes that less.
      error += PICK(part.shows, q.sum_error + q.share_error * part.dense, (V)(0.0f));
      joint = behind_part;
    }
    const V a = widest(&above), b = widest(&minus_below);
    const I ended = MOST(a, b) <= q.theta;
    flags |= PICK(ended & walk.active, (I)(VDVR_PIXEL_ENDED), (I)(0));
    walk.active &= NOT(ended);
  }
  const I ended = (flags & VDVR_PIXEL_ENDED) != 0;
  const V3 hi = pick3(ended, above.at_most, value_at(&above, behind, &up)),
           minus_lo = pick3(ended, minus_below.at_most, value_at(&minus_below, minus_behind, &down));
  error = error_of_ray(&q, error, parts);
  put_interval(&p, &q, least, most, px, py, hi, minus_lo, error, c_least, c_most, parts, flags);
}

#endif
