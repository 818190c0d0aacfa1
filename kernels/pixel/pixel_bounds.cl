// Intervals of pixels: what the ideal picture, emission and absorption over F, can show there
// (docs/pixel-bounds.md). certify_picture walks each ray once, front to back, keeps its pieces, and recurs
// over them back to front. certify_fast does with one pass and nothing kept, for wider intervals. Both
// samplers, packets of 1 to 16 rays.
//
// Layouts: bounds[bz][by][bx] and distance[bz][by][bx] (bricks to the nearest that may show something),
// ranges (rows of two float4, one for each bin and run of 2^k bins), next_shown[bin], least and most [y][x],
// pieces (a list for each packet), fullest[1] (pieces of the longest list). Called by
// host/pixel/pixel_bounds.cpp.
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

// The extremes of all that can show in a pixel of row py.
#define COLOURS_OF_THE_PIXEL                                                                            \
  const V3 behind = background(&p, py);                                                                 \
  const V3 c_least = least3(v3((V)(q.colour_lo[0]), (V)(q.colour_lo[1]), (V)(q.colour_lo[2])), behind); \
  const V3 c_most = most3(v3((V)(q.colour_hi[0]), (V)(q.colour_hi[1]), (V)(q.colour_hi[2])), behind)

RAY_INLINE V3 widened(V3 a, V by) { return v3(a.x + by, a.y + by, a.z + by); }

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
  const I px = (int)get_global_id(0) * PACKET_X + COLUMNS;
  const I py = q.first_row + (int)get_global_id(1) * PACKET_Y + ROWS;
  if (LANE(px, 0) >= p.width || LANE(py, 0) >= p.height || LANE(py, 0) >= q.first_row + q.rows) return;
  const ulong item = get_global_id(1) * get_global_size(0) + get_global_id(0);
#if VDVR_LANES == 1
  const ulong items = get_global_size(0) * get_global_size(1);
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
  V3 hi = pick3(ended, c_most, behind), lo = pick3(ended, c_least, behind);
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
    s.e += q.part_slack * TO_V(n);
    const V length = s.length / MOST(TO_V(n), (V)(1.0f));
    parts += n;
    for (int j = most_lane(n); j > 0; --j) {
      // The last of the j parts that are left.
      const I active = j <= n;
      Piece rest, last;
      cut_piece(&s, (float)(j - 1) / (float)j, &rest, &last);
      const Part part = part_of(THE_RANGES, &q, &last, &s, length, active);
      hi = above3(&part, hi);
      lo = below3(&part, lo);
      pick_coefficients(active, &rest, &s);
    }
  }
  // One more for the background, which is interpolated in fp32; the extremes hold it.
  const V error = q.part_error * TO_V(parts + 1), once = (V)(q.part_error);
  hi = least3(widened(hi, error), widened(c_most, once));
  lo = most3(widened(lo, -error), widened(c_least, -once));
  put_interval(&p, &q, least, most, px, py, lo, hi, parts, flags);
}

#else

// The colour in front of what was passed, as a function of the colour behind it: its bounds at the extremes
// of all colours, and chords between (docs/pixel-bounds.md, section 6).
typedef struct {
  V3 at_least, at_most;
} Knots;
RAY_INLINE V between_knots(V a, V b, V share) { return a + (b - a) * share; }
// The same with a part behind: `least` and `most` are the part's colours in front of the extremes.
RAY_INLINE void pass_part(Knots* f, V3 least, V3 most, V3 lowest, V3 inverse) {
  const V3 a = f->at_least, b = f->at_most;
#define SHARE(axis, c) ((c.axis - lowest.axis) * inverse.axis)
  f->at_least = v3(between_knots(a.x, b.x, SHARE(x, least)), between_knots(a.y, b.y, SHARE(y, least)),
                   between_knots(a.z, b.z, SHARE(z, least)));
  f->at_most = v3(between_knots(a.x, b.x, SHARE(x, most)), between_knots(a.y, b.y, SHARE(y, most)),
                  between_knots(a.z, b.z, SHARE(z, most)));
#undef SHARE
}
RAY_INLINE V widest(const Knots* f) {
  const V x = f->at_most.x - f->at_least.x, y = f->at_most.y - f->at_least.y,
          z = f->at_most.z - f->at_least.z, xy = MOST(x, y);
  return MOST(xy, z);
}

__kernel VDVR_HINT void certify_fast(CERTIFY_ARGUMENTS) {
  const I px = (int)get_global_id(0) * PACKET_X + COLUMNS;
  const I py = q.first_row + (int)get_global_id(1) * PACKET_Y + ROWS;
  if (LANE(px, 0) >= p.width || LANE(py, 0) >= p.height || LANE(py, 0) >= q.first_row + q.rows) return;
  const Ray ray = cast_rays(&p, grid, px, py);
  Walk walk = start_walk(&p, &ray, px, py);
  I flags = (I)(0), parts = (I)(0);
  COLOURS_OF_THE_PIXEL;
  const V3 width = v3(c_most.x - c_least.x, c_most.y - c_least.y, c_most.z - c_least.z);
  const V one = (V)(1.0f), none = (V)(0.0f);
  const V3 inverse = v3(PICK(width.x > 0.0f, one / PICK(width.x > 0.0f, width.x, one), none),
                        PICK(width.y > 0.0f, one / PICK(width.y > 0.0f, width.y, one), none),
                        PICK(width.z > 0.0f, one / PICK(width.z > 0.0f, width.z, one), none));
  Knots above = {c_least, c_most}, below = {c_least, c_most};
  while (ANY(walk.active)) {
    Piece s;
    const I shows =
        next_piece(THE_FIELD, bricks, grid, distance, bounds, THE_RANGES, &p, &q, &ray, &walk, &s);
    if (!ANY(shows)) continue;
    flags |= PICK(shows & (s.e == INFINITY), (I)(VDVR_PIXEL_UNTESTED), (I)(0));
    s.length = PICK(shows, s.length, none);
    const I n = parts_of(&q, &s);
    s.e += q.part_slack * TO_V(n);
    const V length = s.length / MOST(TO_V(n), one);
    parts += n;
    for (int j = most_lane(n); j > 0; --j) {
      const I active = j <= n;
      Piece first, rest;
      cut_piece(&s, 1.0f / (float)j, &first, &rest);
      const Part part = part_of(THE_RANGES, &q, &first, &s, length, active);
      pass_part(&above, above3(&part, c_least), above3(&part, c_most), c_least, inverse);
      pass_part(&below, below3(&part, c_least), below3(&part, c_most), c_least, inverse);
      pick_coefficients(active, &rest, &s);
    }
    const V a = widest(&above), b = widest(&below);
    const I ended = MOST(a, b) <= q.theta;
    flags |= PICK(ended & walk.active, (I)(VDVR_PIXEL_ENDED), (I)(0));
    walk.active &= NOT(ended);
  }
  const I ended = (flags & VDVR_PIXEL_ENDED) != 0;
  Knots end_above = above, end_below = below;
  pass_part(&end_above, behind, behind, c_least, inverse);
  pass_part(&end_below, behind, behind, c_least, inverse);
  V3 hi = pick3(ended, above.at_most, end_above.at_least),
     lo = pick3(ended, below.at_least, end_below.at_least);
  // A part costs two steps of each bound here, and a sum of three roundings more.
  const V error = 2.0f * q.part_error * TO_V(parts + 1), once = (V)(q.part_error);
  hi = least3(widened(hi, error), widened(c_most, once));
  lo = most3(widened(lo, -error), widened(c_least, -once));
  put_interval(&p, &q, least, most, px, py, lo, hi, parts, flags);
}

#endif
