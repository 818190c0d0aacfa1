// What every ray-caster shares, whatever the field: rays of the camera, leaps over bricks, the table of
// colours, light, and raycast_dvr itself. The includer has defined RAY_INLINE and the field before: FIELD,
// THE_FIELD and BRICKS (kernel arguments), OpenBrick, open_brick, Sampled, sample_open, gradient_at. Included
// by raycast.cl (stored volumes) and d2vr.cl (projections).
#ifndef VDVR_RAYCAST_DVR_H
#define VDVR_RAYCAST_DVR_H

#define VDVR_HINT \
  PACKET_HINT __attribute__((work_group_size_hint(VDVR_GROUP_X / PACKET_X, VDVR_GROUP_Y / PACKET_Y, 1)))

// How far inside a brick's faces a leap ends, in cells. Larger than any rounding of a position (2^-10 in a
// grid of 8192 cells), so that no sample of the brick behind is leapt over; smaller than costs an iteration
// often.
#define LEAP_MARGIN 0.00390625f
// A sample that adds less than this per length to the picture, half a step of 8 bits, is not worth six more
// for shading, and its bound does not count as seen.
#define SHADED_WEIGHT 0.001953125f

// Rays clipped to what is drawn of the grid. Positions in cells, parameter t in lengths from `entry`.
typedef struct {
  V3 world;  // unit direction, world axes
  V3 entry, direction, inverse;
  V length, first;  // inside the box; from the eye to `entry`
} Ray;

RAY_INLINE V dot3(V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
RAY_INLINE V3 scaled(V3 a, V s) { return v3(a.x * s, a.y * s, a.z * s); }
RAY_INLINE V3 plus(V3 a, V3 b) { return v3(a.x + b.x, a.y + b.y, a.z + b.z); }
RAY_INLINE V3 pick3(I m, V3 a, V3 b) { return v3(PICK(m, a.x, b.x), PICK(m, a.y, b.y), PICK(m, a.z, b.z)); }

#include "device/shade.h"

// One axis of a ray and the two faces across it of the box that is drawn.
RAY_INLINE V clip(V direction, float eye, float low, float high, V* inverse, V* far) {
  // A component of 1e-12 stands for 0 in the divisions: the slab test then decides by the sign alone, without
  // 0/0.
  const V tiny = (V)(1e-12f);
  const V d = PICK(fabs(direction) < tiny, copysign(tiny, direction), direction);
  *inverse = 1.0f / d;
  const V a = (low - eye) * *inverse, b = (high - eye) * *inverse;
  *far = MOST(a, b);
  return LEAST(a, b);
}

// Cuts [near, far] to the part inside the upright cylinder. With the radius as unit, a ray comes nearest to
// the axis at `middle`. It passes the axis at a distance of which `beside` is the square. The radius is taken
// as smaller by more than all rounding, here and of positions on the ray: 2^-18 of the distances that are
// added.
RAY_INLINE void clip_to_cylinder(const VdvrRaycast* p, const Ray* ray, V* near, V* far) {
  const float ex = (p->eye_x - p->cylinder_x) * p->cylinder_per_x,
              ey = (p->eye_y - p->cylinder_y) * p->cylinder_per_y;
  const float around = 1.0f + fabs(ex) + fabs(ey) + fabs(p->cylinder_x * p->cylinder_per_x) +
                       fabs(p->cylinder_y * p->cylinder_per_y);
  const V dx = ray->direction.x * p->cylinder_per_x, dy = ray->direction.y * p->cylinder_per_y;
  const V across = dx * dx + dy * dy;
  // Below this a ray does not leave its place in xy, as far as fp32 can tell.
  const I upright = across < 1e-20f;
  const V divisor = PICK(upright, (V)(1.0f), across), cross = ex * dy - ey * dx;
  const V beside = PICK(upright, (V)(ex * ex + ey * ey), cross * cross / divisor);
  const V under = 1.0f - 0x1p-18f * around - beside;
  const I meets = under > 0.0f;
  const V half_way = sqrt(PICK(meets, under, (V)(0.0f)) / divisor), middle = -(ex * dx + ey * dy) / divisor;
  const V from = PICK(meets & upright, *near, middle - half_way),
          to = PICK(meets & upright, *far, middle + half_way);
  *near = MOST(*near, from);
  *far = LEAST(*far, to);
  *far = PICK(meets, *far, *near);
}

// The camera's rays through the centres of pixels (px, py), clipped. Where length is not above 0 they miss
// the box.
RAY_INLINE Ray cast_rays(const VdvrRaycast* p, VdvrGrid grid, I px, I py) {
  Ray ray;
  const V across = (2.0f * (TO_V(px) + 0.5f)) / (float)p->width - 1.0f;
  const V above = 1.0f - (2.0f * (TO_V(py) + 0.5f)) / (float)p->height;
  const V3 world = v3(p->forward_x + across * p->right_x + above * p->up_x,
                      p->forward_y + across * p->right_y + above * p->up_y,
                      p->forward_z + across * p->right_z + above * p->up_z);
  const V norm = sqrt(dot3(world, world));
  ray.world = v3(world.x / norm, world.y / norm, world.z / norm);
  ray.direction = v3(ray.world.x * p->cells_per_length_x, ray.world.y * p->cells_per_length_y,
                     ray.world.z * p->cells_per_length_z);
  V3 far;
  const V near_x = clip(ray.direction.x, p->eye_x, p->clip_low[0], p->clip_high[0], &ray.inverse.x, &far.x);
  const V near_y = clip(ray.direction.y, p->eye_y, p->clip_low[1], p->clip_high[1], &ray.inverse.y, &far.y);
  const V near_z = clip(ray.direction.z, p->eye_z, p->clip_low[2], p->clip_high[2], &ray.inverse.z, &far.z);
  const V near_xy = MOST(near_x, near_y), far_xy = LEAST(far.x, far.y);
  V near = MOST(near_xy, near_z), end = LEAST(far_xy, far.z);
  if (p->cylinder_per_x > 0.0f) clip_to_cylinder(p, &ray, &near, &end);
  ray.first = MOST(near, (V)(0.0f));
  ray.length = end - ray.first;
  ray.entry = clamp_to_grid(v3(p->eye_x + ray.first * ray.direction.x, p->eye_y + ray.first * ray.direction.y,
                               p->eye_z + ray.first * ray.direction.z),
                            grid);
  return ray;
}

RAY_INLINE V3 position_at(const Ray* ray, VdvrGrid grid, V t) {
  return clamp_to_grid(v3(ray->entry.x + t * ray->direction.x, ray->entry.y + t * ray->direction.y,
                          ray->entry.z + t * ray->direction.z),
                       grid);
}

RAY_INLINE V leave_axis(V entry, V inverse, I b, I radius) {
  // The face that lies ahead.
  const I ahead = inverse > 0.0f;
  const V face = TO_V((b + PICK(ahead, radius + 1, -radius)) * VDVR_GRANULARITY);
  return (face + PICK(ahead, (V)(-LEAP_MARGIN), (V)(LEAP_MARGIN)) - entry) * inverse;
}
// Where rays leave the cubes of bricks [b - radius, b + radius], a margin before their faces.
RAY_INLINE V leave_bricks(const Ray* ray, I3 b, I radius) {
  const V x = leave_axis(ray->entry.x, ray->inverse.x, b.x, radius);
  const V y = leave_axis(ray->entry.y, ray->inverse.y, b.y, radius);
  const V z = leave_axis(ray->entry.z, ray->inverse.z, b.z, radius);
  const V xy = LEAST(x, y);
  return LEAST(xy, z);
}

#if VDVR_LANES == 1
RAY_INLINE float least_lane(V v) { return v; }
#else
RAY_INLINE float least_lane4(float4 v) {
  const float2 two = LEAST(v.lo, v.hi);
  return LEAST(two.x, two.y);
}
#if VDVR_LANES == 4
RAY_INLINE float least_lane(V v) { return least_lane4(v); }
#elif VDVR_LANES == 8
RAY_INLINE float least_lane(V v) { return least_lane4(LEAST(v.lo, v.hi)); }
#else
RAY_INLINE float least_lane(V v) {
  const float8 eight = LEAST(v.lo, v.hi);
  return least_lane4(LEAST(eight.lo, eight.hi));
}
#endif
#endif
RAY_INLINE int most_lane(I v) {
  int most = LANE(v, 0);
#define RAISE(n) most = max(LANE(v, n), most);
  EACH(RAISE)
#undef RAISE
  return most;
}

// The first sample index whose position at offset (index + shift) * step is not before t in any active lane,
// and at least k + 1.
RAY_INLINE int leap_to(V t, I active, float inverse_step, float shift, int k, int end) {
  const float next = least_lane(PICK(active, t, (V)(INFINITY))) * inverse_step - shift;
  if (next > (float)(end - 1)) return end;
  // ceil, which runtimes make of twenty instructions.
  const int whole = (int)next;
  return max(k + 1, whole + ((float)whole < next ? 1 : 0));
}

// Where values lie in the table: the entry below and the fraction above it.
typedef struct {
  I entry;
  V fraction;
} Row;
RAY_INLINE V place_in_table(const VdvrRaycast* p, V value) { return (value - p->table_lo) * p->table_scale; }
RAY_INLINE Row row_at(const VdvrRaycast* p, V at) {
  const V last = (V)((float)(p->table_size - 1));
  const V x = at > 0.0f ? LEAST(at, last) : (V)(0.0f);
  Row r;
  r.entry = TO_I(x);
  r.entry = r.entry > p->table_size - 2 ? (I)(p->table_size - 2) : r.entry;
  r.fraction = x - TO_V(r.entry);
  return r;
}
RAY_INLINE Row row_of(const VdvrRaycast* p, V value) { return row_at(p, place_in_table(p, value)); }

// Opacities stand behind the table once more, alone: most samples need no colour.
RAY_INLINE V opacity_of(__global const float4* restrict table, const VdvrRaycast* p, Row r) {
  __global const float* opacity = (__global const float*)(table + p->table_size);
#define TWO(n) TWO_FLOATS(opacity + LANE(r.entry, n))
  const V2 q = PAIRS(TWO);
#undef TWO
  return (1.0f - r.fraction) * q.first + r.fraction * q.second;
}

RAY_INLINE V3 colour_of(__global const float4* restrict table, Row r) {
#define LOWER(n) table[LANE(r.entry, n)]
#define UPPER(n) table[LANE(r.entry, n) + 1]
  const V4 a = TURN(LOWER), b = TURN(UPPER);
#undef LOWER
#undef UPPER
  const V f = r.fraction, e = 1.0f - f;
  return v3(e * a.x + f * b.x, e * a.y + f * b.y, e * a.z + f * b.z);
}

RAY_INLINE V3 background(const VdvrRaycast* p, I py) {
  const V f = (TO_V(py) + 0.5f) / (float)p->height;
  return v3((1.0f - f) * p->background_top[0] + f * p->background_bottom[0],
            (1.0f - f) * p->background_top[1] + f * p->background_bottom[1],
            (1.0f - f) * p->background_top[2] + f * p->background_bottom[2]);
}

// Of a gradient: where density falls, unit length; NaN where there is no gradient.
RAY_INLINE V3 normal_of(V3 gradient) {
  const V magnitude = -sqrt(dot3(gradient, gradient));
  return v3(gradient.x / magnitude, gradient.y / magnitude, gradient.z / magnitude);
}

// Every lane's pixel, and how many samples its row took.
RAY_INLINE void put(int width, int height, __global float4* restrict picture,
                    __global uint* restrict row_samples, I px, I py, V3 rgb, V fourth, I samples) {
#define PUT(n)                                                                           \
  if (LANE(px, n) < width && LANE(py, n) < height) {                                     \
    picture[(ulong)LANE(py, n) * (ulong)width + (ulong)LANE(px, n)] =                    \
        (float4)(LANE(rgb.x, n), LANE(rgb.y, n), LANE(rgb.z, n), LANE(fourth, n));       \
    if (LANE(samples, n)) atomic_add(&row_samples[LANE(py, n)], (uint)LANE(samples, n)); \
  }
  EACH(PUT)
#undef PUT
}

// Samples per ray, one a step of which any part lies in the box, and 0 for rays that miss the box or the
// picture.
RAY_INLINE I ends_of(const VdvrRaycast* p, const Ray* ray, I px, I py, V samples) {
  const I hits = (ray->length > 0.0f) & (px < p->width) & (py < p->height);
  return PICK(hits, TO_I(ceil(samples)), (I)(0));
}

// A ray's last step ends where the ray leaves the box. Of the step that begins at `from`: the middle of what
// the ray has of it, and what share of a whole step that is.
RAY_INLINE V middle_of_step(const Ray* ray, V from, V step) {
  const V whole = from + 0.5f * step, cut = 0.5f * (from + ray->length);
  return LEAST(whole, cut);
}
RAY_INLINE V share_of_step(const Ray* ray, V from, V inverse_step) {
  V share = (ray->length - from) * inverse_step;
  share = LEAST(share, (V)(1.0f));
  return MOST(share, (V)(0.0f));
}
// The opacity of a share of a step. Lane by lane, so that the number of lanes changes no bit.
RAY_INLINE V opacity_of_share(V opacity, V share) {
  if (!ANY(share < 1.0f)) return opacity;
#define ONE(n) \
  if (LANE(share, n) < 1.0f) LANE(opacity, n) = 1.0f - pow(1.0f - LANE(opacity, n), LANE(share, n));
  EACH(ONE)
#undef ONE
  return opacity;
}

#define THE_PIXELS                                                     \
  const I px = p.pixel_x + (int)get_global_id(0) * PACKET_X + COLUMNS; \
  const I py = p.pixel_y + (int)get_global_id(1) * PACKET_Y + ROWS;    \
  if (LANE(px, 0) >= p.width || LANE(py, 0) >= p.height) return

// What has been seen along the rays.
typedef struct {
  V3 colour, normal;
  V alpha, depth;
} Seen;

RAY_INLINE Seen nothing_seen(V depth) {
  const V none = (V)(0.0f), nothing = (V)(NAN);
  const Seen seen = {v3(none, none, none), v3(nothing, nothing, nothing), none, depth};
  return seen;
}

#if VDVR_BOUNDS
// Takes note of the bounds of bricks `at` in the lanes `seeing`.
RAY_INLINE void raise_bound(VdvrGrid grid, I3 at, I seeing, Seen* seen BOUNDS) {
  const V bound = GATHER(V, bounds, brick_index(grid, at));
  seen->depth = PICK(seeing & (bound > seen->depth), bound, seen->depth);
}
#endif

// Composites lanes of positive weight: `sampled` was taken at c, parameter t. Geometry: where the opacity
// passes a half.
RAY_INLINE void absorb(FIELD, BRICKS, VdvrGrid grid, const VdvrRaycast* p, const Ray* ray,
                       const OpenBrick* brick, const Sampled* sampled, V3 c, V t, V3 rgb, V weight,
                       V shaded_weight, Seen* seen BOUNDS) {
  const float3 cells_per_length =
      (float3)(p->cells_per_length_x, p->cells_per_length_y, p->cells_per_length_z);
#if VDVR_BOUNDS
  raise_bound(grid, brick_at(grid, c), weight > shaded_weight, seen THE_BOUNDS);
#elif VDVR_GEOMETRY
  const I half_way = (seen->alpha < 0.5f) & (seen->alpha + weight >= 0.5f);
  if (ANY(half_way)) {
    const V3 g = gradient_at(THE_FIELD, bricks, grid, brick, sampled, c, cells_per_length, half_way);
    seen->normal = pick3(half_way, normal_of(g), seen->normal);
    seen->depth = PICK(half_way, (ray->first + t) * p->length_unit, seen->depth);
  }
#else
  const I lit = weight > shaded_weight;
  if (p->shading && ANY(lit))
    rgb = pick3(lit,
                shade(p, rgb, gradient_at(THE_FIELD, bricks, grid, brick, sampled, c, cells_per_length, lit),
                      ray->world, p->gradient_full),
                rgb);
  seen->colour = plus(seen->colour, scaled(rgb, weight));
#endif
  seen->alpha += weight;
}

// Normal and depth, or the colour before the background and `fourth`.
RAY_INLINE void put_seen(const VdvrRaycast* p, __global float4* restrict picture,
                         __global uint* restrict row_samples, I px, I py, const Seen* seen, V fourth,
                         I samples) {
#if VDVR_GEOMETRY
  put(p->width, p->height, picture, row_samples, px, py, seen->normal, seen->depth, samples);
#else
  put(p->width, p->height, picture, row_samples, px, py,
      plus(seen->colour, scaled(background(p, py), 1.0f - seen->alpha)), fourth, samples);
#endif
}

#if VDVR_KERNEL == VDVR_KERNEL_DVR
// Composites step k, which was sampled at c, parameter t, in the lanes `active`.
RAY_INLINE void composite(FIELD, BRICKS, VdvrGrid grid, __global const float4* restrict table,
                          const VdvrRaycast* p, const Ray* ray, const OpenBrick* brick,
                          const Sampled* sampled, V3 c, int k, V t, I active, Seen* seen BOUNDS) {
  const V at = place_in_table(p, sampled->value);
  // Most samples that show nothing lie where the transfer function's first or last entries are 0.
  if (!ANY(active & (at >= p->shown_from) & (at < p->shown_to))) return;
  const Row row = row_at(p, at);
  const V none = (V)(0.0f), opacity = PICK(active, opacity_of(table, p, row), none);
  if (!ANY(opacity > 0.0f)) return;
  const V share = share_of_step(ray, (V)((float)k * p->step), (V)(p->inverse_step));
  const V weight = (1.0f - seen->alpha) * opacity_of_share(opacity, share);
  absorb(THE_FIELD, bricks, grid, p, ray, brick, sampled, c, t, colour_of(table, row), weight,
         SHADED_WEIGHT * p->step * share, seen THE_BOUNDS);
}

#define DVR_ARGUMENTS                                                                          \
  FIELD, BRICKS, VdvrGrid grid, __global const uchar *restrict distance,                       \
      __global const float4 *restrict table, VdvrRaycast p, __global float4 *restrict picture, \
      __global uint *restrict row_samples BOUNDS

#if VDVR_BASE_FIRST
#include "device/raycast_base_first.h"
#else
// Emission and absorption, front to back; opacity in `table` is that of one step. Geometry: of the sample
// that brings the opacity to a half.
__kernel VDVR_HINT void raycast_dvr(DVR_ARGUMENTS) {
  THE_PIXELS;
  Seen seen = nothing_seen((V)(VDVR_BOUNDS ? -1.0f : NAN));
  I samples = 0;
  const Ray ray = cast_rays(&p, grid, px, py);
  const I ends = ends_of(&p, &ray, px, py, ray.length * p.inverse_step);
  const int end = most_lane(ends);
  OpenBrick brick = no_brick();
  int k = 0;
  while (k < end) {
    const I active = (k < ends) & (seen.alpha < p.termination);
    if (!ANY(active)) break;
    const V t = middle_of_step(&ray, (V)((float)k * p.step), (V)(p.step));
    const V3 c = position_at(&ray, grid, t);
    if (ANY(active & NOT(is_inside(&brick, c)))) {
      const I3 at = brick_at(grid, c);
      if (p.skip) {
        const I away = TO_I(GATHER(U8, distance, brick_index(grid, at)));
        if (!ANY(active & (away == 0))) {
          k = leap_to(leave_bricks(&ray, at, away - 1), active, p.inverse_step, 0.5f, k, end);
          continue;
        }
      }
      brick = open_brick(bricks, grid, at);
    }
    const Sampled sampled = sample_open(THE_FIELD, &brick, grid, c);
    samples += PICK(active, (I)(1), (I)(0));
    composite(THE_FIELD, bricks, grid, table, &p, &ray, &brick, &sampled, c, k, t, active, &seen THE_BOUNDS);
    ++k;
  }
  put_seen(&p, picture, row_samples, px, py, &seen, seen.alpha, samples);
}
#endif
#endif

#endif
