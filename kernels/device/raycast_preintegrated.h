// Emission-absorption with a pre-integrated transfer function (Engel, Kraus and Ertl 2001): the field is
// taken as linear between two samples, and a table by front and back value holds what the path between them
// emits and absorbs. A transfer function however sharp is then met in full. Included by raycast.cl.
#ifndef VDVR_RAYCAST_PREINTEGRATED_H
#define VDVR_RAYCAST_PREINTEGRATED_H

// table[front][back]: colour times opacity, and opacity, of one step; then the opacities alone.
RAY_INLINE I place_in(const VdvrRaycast* p, Row front, I back) { return front.entry * p->table_size + back; }

RAY_INLINE V opacity_between(__global const float4* restrict table, const VdvrRaycast* p, Row front,
                             Row back) {
  __global const float* opacity = (__global const float*)(table + p->table_size * p->table_size);
  const I i = place_in(p, front, back.entry);
  V low, high;
#define FOUR(n)                                                       \
  {                                                                   \
    const float2 q = vload2(0, opacity + LANE(i, n));                 \
    const float2 r = vload2(0, opacity + LANE(i, n) + p->table_size); \
    const float f = LANE(back.fraction, n);                           \
    LANE(low, n) = (1.0f - f) * q.x + f * q.y;                        \
    LANE(high, n) = (1.0f - f) * r.x + f * r.y;                       \
  }
  EACH(FOUR)
#undef FOUR
  return (1.0f - front.fraction) * low + front.fraction * high;
}

// Divided by its opacity, as a colour of one sample is.
RAY_INLINE V3 colour_between(__global const float4* restrict table, const VdvrRaycast* p, Row front,
                             Row back) {
  const I i = place_in(p, front, back.entry);
  V3 rgb;
#define FOUR(n)                                                                      \
  {                                                                                  \
    __global const float4* q = table + LANE(i, n);                                   \
    const float f = LANE(back.fraction, n), g = LANE(front.fraction, n);             \
    const float4 e = (1.0f - g) * ((1.0f - f) * q[0] + f * q[1]) +                   \
                     g * ((1.0f - f) * q[p->table_size] + f * q[p->table_size + 1]); \
    const float share = e.w > 0.0f ? 1.0f / e.w : 0.0f;                              \
    LANE(rgb.x, n) = e.x * share;                                                    \
    LANE(rgb.y, n) = e.y * share;                                                    \
    LANE(rgb.z, n) = e.z * share;                                                    \
  }
  EACH(FOUR)
#undef FOUR
  return rgb;
}

// Steps lie between samples t_j = j step, the last ends where the ray leaves the grid. Bricks whose values
// lie in one stretch of the transfer function without opacity are leapt over together: between two of their
// samples nothing is absorbed. Geometry: of the middle of the step that brings the opacity to a half.
__kernel VDVR_HINT void raycast_preintegrated(FIELD, BRICKS, VdvrGrid grid,
                                              __global const uchar* restrict distance,
                                              __global const float4* restrict table, VdvrRaycast p,
                                              __global float4* restrict picture,
                                              __global uint* restrict row_samples BOUNDS) {
  THE_PIXELS;
  const V none = (V)(0.0f);
  Seen seen = nothing_seen((V)(VDVR_BOUNDS ? -1.0f : NAN));
  I samples = 0, away = 0;
  const Ray ray = cast_rays(&p, grid, px, py);
  const I ends = ends_of(&p, &ray, px, py, ray.length * p.inverse_step);
  const int end = most_lane(ends);
  OpenBrick brick = no_brick();
  Row front = row_of(&p, none);
  int j = 0;
  while (j <= end) {
    const I active = (ends > 0) & (j <= ends) & (seen.alpha < p.termination);
    if (!ANY(active)) break;
    const V t = LEAST((V)((float)j * p.step), ray.length);
    const V3 c = position_at(&ray, grid, t);
    if (ANY(active & NOT(is_inside(&brick, c)))) {
      brick = open_brick(bricks, grid, brick_at(grid, c));
      if (p.skip) away = TO_I(GATHER(U8, distance, brick_index(grid, brick.at)));
    }
    const Row back = row_of(&p, sample_open(THE_FIELD, &brick, grid, c).value);
    samples += PICK(active, (I)(1), (I)(0));
    if (j > 0) {
      const float before = (float)(j - 1) * p.step;
#if VDVR_BOUNDS
      const I3 before_at = brick_at(grid, position_at(&ray, grid, (V)(before)));
#endif
      const V whole = opacity_between(table, &p, front, back);
      const V opacity = opacity_of_share(whole, share_of_step(&ray, (V)(before), (V)(p.inverse_step)));
      const V weight = PICK(active, (1.0f - seen.alpha) * opacity, none);
      if (ANY(weight > 0.0f)) {
        const V middle = 0.5f * (before + t);
        const V3 at = position_at(&ray, grid, middle);
        const OpenBrick around = open_brick(bricks, grid, brick_at(grid, at));
        const Sampled sampled = sample_open(THE_FIELD, &around, grid, at);
        absorb(THE_FIELD, bricks, grid, &p, &ray, &around, &sampled, at, middle,
               colour_between(table, &p, front, back), weight, (V)(SHADED_WEIGHT * p.step), &seen THE_BOUNDS);
#if VDVR_BOUNDS
        const I counts = weight > SHADED_WEIGHT * p.step;
        raise_bound(grid, before_at, counts, &seen THE_BOUNDS);
        raise_bound(grid, brick_at(grid, c), counts, &seen THE_BOUNDS);
#endif
      }
    }
    front = back;
    ++j;
    if (p.skip && !ANY(active & (away == 0))) {
      const int next =
          leap_to(leave_bricks(&ray, brick.at, away - 1), active, p.inverse_step, 0.0f, j - 1, end + 1);
      if (next > j) {
        const V3 last = position_at(&ray, grid, LEAST((V)((float)(next - 1) * p.step), ray.length));
        front = row_of(&p, sample_anywhere(THE_FIELD, bricks, grid, last).value);
        j = next;
      }
    }
  }
  put_seen(&p, picture, row_samples, px, py, &seen, seen.alpha, samples);
}

#endif
