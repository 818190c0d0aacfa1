// Ray-casting of the mixed-resolution field: emission-absorption (dvr), first iso-surface (iso), maximum
// (mip), slice. One source for both samplers: VDVR_SAMPLER_BUFFER reads the field by mixed_sampler.h,
// VDVR_SAMPLER_IMAGE3D by mixed_image.h.
//
// Sample positions are global along a ray, t_k = t_entry + (k + 1/2) step, and each belongs to the brick that
// vdvr_brick_of names; bricks decide what is skipped and which record is open, never where a sample lies. So
// the picture does not depend on skipping, to the bit.
//
// Layouts: bricks[bz][by][bx], distance[bz][by][bx] (bricks to the nearest one worth sampling, at most 255),
// ranges[bz][by][bx], table[table_size] (rgb, opacity of one step), picture[y][x] (r, g, b, alpha | depth |
// maximum). Called by: raycast() in host/raycast.cpp. Calls: mixed_sampler.h, mixed_image.h.
#ifndef VDVR_GRANULARITY
#error "VDVR_GRANULARITY (cells per brick and axis) must be defined"
#endif
#if defined(VDVR_SAMPLER_BUFFER) == defined(VDVR_SAMPLER_IMAGE3D)
#error "define one of VDVR_SAMPLER_BUFFER and VDVR_SAMPLER_IMAGE3D"
#endif
// Tuning: pixels of one work-group. 8 x 8 keeps the rays of a group in the same bricks.
#ifndef VDVR_GROUP_X
#define VDVR_GROUP_X 8
#endif
#ifndef VDVR_GROUP_Y
#define VDVR_GROUP_Y 8
#endif
// Tuning: the six samples of a gradient as one vector of eight lanes. Pays where a work-item is a scalar
// thread (CPUs); same operations in the same order, so the same bits. Needs the buffer sampler.
#ifndef VDVR_WIDE_GRADIENT
#define VDVR_WIDE_GRADIENT 0
#endif
#define VDVR_HINT __attribute__((work_group_size_hint(VDVR_GROUP_X, VDVR_GROUP_Y, 1)))

// Calls in the sampling loop cost as much as a sample; compilers without the attribute inline anyway.
#if defined(__clang__) || defined(__GNUC__)
#define RAY_INLINE inline __attribute__((always_inline))
#else
#define RAY_INLINE inline
#endif

#include "shared/mixed_sampler.h"
#include "shared/mixed_image.h"
#include "shared/raycast_params.h"

// One image per sample type; the launcher binds any to those that do not occur. THE_FIELD hands it on.
#ifdef VDVR_SAMPLER_IMAGE3D
#define FIELD __read_only image3d_t field_f32, __read_only image3d_t field_u16, __read_only image3d_t field_u8
#define THE_FIELD field_f32, field_u16, field_u8
#else
#define FIELD __global const uchar* restrict field
#define THE_FIELD field
#endif
#define BRICKS __global const uint* restrict bricks

// Without the NaN rules of fmin, fmax and clamp, which cost branches; no operand is NaN.
#define LEAST(a, b) ((a) < (b) ? (a) : (b))
#define MOST(a, b) ((a) > (b) ? (a) : (b))

// How far inside a brick's faces a leap ends, in cells. Larger than any rounding of a position (2^-10 in a
// grid of 8192 cells), so that no sample of the brick behind is leapt over; smaller than costs an iteration
// often.
#define LEAP_MARGIN 0.00390625f
// Central differences reach half a base cell to each side, at every level: one gradient operator for the
// whole volume, so that shading has no seam where levels meet.
#define GRADIENT_REACH 0.5f
// Bisections of an iso interval: the hit is known to 2^-13 of a step.
#define BISECTIONS 12

// A sample that adds less than this per length to the picture, half a step of 8 bits, is not worth six more
// for shading.
#define SHADED_WEIGHT 0.001953125f

// A ray clipped to the grid's box. Positions in cells, parameter t in lengths from `entry`.
typedef struct {
  float3 world;  // unit direction, world axes
  float3 entry, direction, inverse;
  float length, first;  // inside the box; from the eye to `entry`
} Ray;

// The brick that is being sampled; a cell coordinate c belongs to it iff low <= c < high.
typedef struct {
  int x, y, z;
  VdvrBrick record;
  float3 low, high;
} OpenBrick;

RAY_INLINE float3 grid_cells(VdvrGrid grid) {
  return (float3)((float)grid.cells_x, (float)grid.cells_y, (float)grid.cells_z);
}

RAY_INLINE float3 clamp_to_grid(float3 c, VdvrGrid grid) {
  const float3 cells = grid_cells(grid);
  c = LEAST(c, cells);
  return MOST(c, (float3)(0.0f));
}

RAY_INLINE ulong brick_index(VdvrGrid grid, int x, int y, int z) {
  return ((ulong)z * (ulong)grid.bricks_y + (ulong)y) * (ulong)grid.bricks_x + (ulong)x;
}

RAY_INLINE float sample_open(FIELD, const OpenBrick* b, VdvrGrid grid, float3 c) {
#ifdef VDVR_SAMPLER_IMAGE3D
  return vdvr_image_sample_in_brick(THE_FIELD, &b->record, grid, b->x, b->y, b->z, c.x, c.y, c.z);
#else
  return vdvr_sample_in_brick(field, b->record,
                              vdvr_local(c.x, b->x, b->record.level_x, grid.granularity, grid.cells_x),
                              vdvr_local(c.y, b->y, b->record.level_y, grid.granularity, grid.cells_y),
                              vdvr_local(c.z, b->z, b->record.level_z, grid.granularity, grid.cells_z));
#endif
}

RAY_INLINE int3 brick_at(VdvrGrid grid, float3 c) {
  return (int3)(vdvr_brick_of(c.x, grid.granularity, grid.bricks_x),
                vdvr_brick_of(c.y, grid.granularity, grid.bricks_y),
                vdvr_brick_of(c.z, grid.granularity, grid.bricks_z));
}

RAY_INLINE OpenBrick open_brick(BRICKS, VdvrGrid grid, int3 b) {
  OpenBrick o;
  o.x = b.x;
  o.y = b.y;
  o.z = b.z;
  o.record = vdvr_brick(bricks, grid, brick_index(grid, b.x, b.y, b.z));
  o.low = convert_float3(b * grid.granularity);
  o.high = o.low + (float)grid.granularity;
  // The last brick of an axis is closed, and wider than the grid where the cells do not divide by the
  // granularity.
  if (b.x == grid.bricks_x - 1) o.high.x = INFINITY;
  if (b.y == grid.bricks_y - 1) o.high.y = INFINITY;
  if (b.z == grid.bricks_z - 1) o.high.z = INFINITY;
  return o;
}

RAY_INLINE int is_inside(const OpenBrick* b, float3 c) {
  return c.x >= b->low.x && c.x < b->high.x && c.y >= b->low.y && c.y < b->high.y && c.z >= b->low.z &&
         c.z < b->high.z;
}

// The field anywhere: vdvr_sample, or its image form.
RAY_INLINE float sample_anywhere(FIELD, BRICKS, VdvrGrid grid, float3 c) {
#ifdef VDVR_SAMPLER_IMAGE3D
  const OpenBrick b = open_brick(bricks, grid, brick_at(grid, c));
  return sample_open(THE_FIELD, &b, grid, c);
#else
  return vdvr_sample(field, bricks, grid, c.x, c.y, c.z);
#endif
}

RAY_INLINE float sample_near(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, float3 c) {
  return is_inside(b, c) ? sample_open(THE_FIELD, b, grid, c) : sample_anywhere(THE_FIELD, bricks, grid, c);
}

#if VDVR_WIDE_GRADIENT && defined(VDVR_SAMPLER_BUFFER)
#define GRADIENT_IS_WIDE 1

// Local coordinates of six points along one axis, as vdvr_local; the points lie in the region.
RAY_INLINE int8 local8(float8 c, float first, float scale, int last, float8* fraction) {
  const float8 r = (c - first) * scale;
  int8 i = convert_int8(r);
  const int8 top = (int8)(last - 1);
  i = i > top ? top : i;
  *fraction = r - convert_float8(i);
  return i;
}

#define LOAD6(TYPE, s, i) (TYPE)((s)[i.s0], (s)[i.s1], (s)[i.s2], (s)[i.s3], (s)[i.s4], (s)[i.s5], 0, 0)
// Samples number first + i of the buffer, decoded as in mixed_sampler.h.
RAY_INLINE float8 load6(FIELD, const VdvrBrick* b, ulong first, int8 i) {
  if (VDVR_HOLDS(*b, VDVR_F32)) {
    __global const float* s = (__global const float*)field + first;
    return LOAD6(float8, s, i);
  }
  if (VDVR_HOLDS(*b, VDVR_U16)) {
    __global const ushort* s = (__global const ushort*)field + first;
    return convert_float8(LOAD6(ushort8, s, i)) * b->scale + b->bias;
  }
  __global const uchar* s = field + first;
  return convert_float8(LOAD6(uchar8, s, i)) * b->scale + b->bias;
}

RAY_INLINE float8 lerp8(float8 a, float8 b, float8 t) { return (1.0f - t) * a + t * b; }

// vdvr_trilinear at six points (lanes 0 to 5) of one region: an open brick, or, where the bricks around read
// the base too, the whole base, whose cells give the same bits in global coordinates as in the brick's.
RAY_INLINE float8 sample6(FIELD, VdvrGrid grid, const OpenBrick* b, float8 x, float8 y, float8 z) {
  const int base = (int)b->record.base_around;
  const int fx = base ? 0 : b->x * grid.granularity, fy = base ? 0 : b->y * grid.granularity;
  const int fz = base ? 0 : b->z * grid.granularity;
  const int wide = base ? INT_MAX : grid.granularity;
  const uint lx = b->record.level_x, ly = b->record.level_y, lz = b->record.level_z;
  float8 tx, ty, tz;
  const int8 ix = local8(x, (float)fx, (float)(1 << lx), min(grid.cells_x - fx, wide) << lx, &tx);
  const int8 iy = local8(y, (float)fy, (float)(1 << ly), min(grid.cells_y - fy, wide) << ly, &ty);
  const int8 iz = local8(z, (float)fz, (float)(1 << lz), min(grid.cells_z - fz, wide) << lz, &tz);
  const int sy = (int)b->record.stride_y, sz = (int)b->record.stride_z;
  const int8 i = iz * sz + iy * sy + ix;
  const VdvrBrick* r = &b->record;
  const ulong s = base ? 0 : r->place, t = s + (ulong)sz;
  const float8 p = lerp8(lerp8(load6(field, r, s, i), load6(field, r, s + 1, i), tx),
                         lerp8(load6(field, r, s + sy, i), load6(field, r, s + sy + 1, i), tx), ty);
  const float8 q = lerp8(lerp8(load6(field, r, t, i), load6(field, r, t + 1, i), tx),
                         lerp8(load6(field, r, t + sy, i), load6(field, r, t + sy + 1, i), tx), ty);
  return lerp8(p, q, tz);
}
#else
#define GRADIENT_IS_WIDE 0
#endif

// Density per length along the world axes; one-sided at the box's faces, where the reach is cut.
RAY_INLINE float3 gradient_at(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, float3 c,
                              float3 cells_per_length) {
  const float3 lo = MOST(c - GRADIENT_REACH, (float3)(0.0f));
  const float3 hi = LEAST(c + GRADIENT_REACH, grid_cells(grid));
#if GRADIENT_IS_WIDE
  if (b->record.base_around || (all(lo >= b->low) && all(hi < b->high))) {
    const float8 v = sample6(field, grid, b, (float8)(lo.x, hi.x, c.x, c.x, c.x, c.x, c.x, c.x),
                             (float8)(c.y, c.y, lo.y, hi.y, c.y, c.y, c.y, c.y),
                             (float8)(c.z, c.z, c.z, c.z, lo.z, hi.z, c.z, c.z));
    return ((float3)(v.s1, v.s3, v.s5) - (float3)(v.s0, v.s2, v.s4)) / (hi - lo) * cells_per_length;
  }
#endif
  const float3 before = (float3)(sample_near(THE_FIELD, bricks, grid, b, (float3)(lo.x, c.y, c.z)),
                                 sample_near(THE_FIELD, bricks, grid, b, (float3)(c.x, lo.y, c.z)),
                                 sample_near(THE_FIELD, bricks, grid, b, (float3)(c.x, c.y, lo.z)));
  const float3 after = (float3)(sample_near(THE_FIELD, bricks, grid, b, (float3)(hi.x, c.y, c.z)),
                                sample_near(THE_FIELD, bricks, grid, b, (float3)(c.x, hi.y, c.z)),
                                sample_near(THE_FIELD, bricks, grid, b, (float3)(c.x, c.y, hi.z)));
  return (after - before) / (hi - lo) * cells_per_length;
}

// Phong with a light at the eye, two-sided. Where the gradient is weak its direction is noise: shading fades
// out there.
RAY_INLINE float3 shade(float3 rgb, float3 gradient, float3 view, float gradient_full) {
  const float magnitude = sqrt(dot(gradient, gradient));
  const float strength =
      gradient_full > 0.0f ? LEAST(magnitude / gradient_full, 1.0f) : (magnitude > 0.0f ? 1.0f : 0.0f);
  const float facing = magnitude > 0.0f ? LEAST(fabs(dot(gradient, view)) / magnitude, 1.0f) : 1.0f;
  const float f2 = facing * facing, f4 = f2 * f2, f8 = f4 * f4;
  const float lit = 0.25f + 0.75f * facing;
  return rgb * (1.0f + strength * (lit - 1.0f)) + 0.2f * strength * f8 * f8 * f8;
}

// The camera's ray through the centre of pixel (px, py), clipped. Returns 0 where it misses the box.
RAY_INLINE int cast_ray(const VdvrRaycast* p, VdvrGrid grid, int px, int py, Ray* ray) {
  const float across = (2.0f * ((float)px + 0.5f)) / (float)p->width - 1.0f;
  const float above = 1.0f - (2.0f * ((float)py + 0.5f)) / (float)p->height;
  const float3 world = (float3)(p->forward_x, p->forward_y, p->forward_z) +
                       across * (float3)(p->right_x, p->right_y, p->right_z) +
                       above * (float3)(p->up_x, p->up_y, p->up_z);
  ray->world = world / sqrt(dot(world, world));
  const float3 eye = (float3)(p->eye_x, p->eye_y, p->eye_z);
  float3 d = ray->world * (float3)(p->cells_per_length_x, p->cells_per_length_y, p->cells_per_length_z);
  ray->direction = d;
  // A component of 1e-12 stands for 0 in the divisions: the slab test then decides by the sign alone, without
  // 0/0.
  const float3 tiny = (float3)(1e-12f);
  d = select(d, copysign(tiny, d), fabs(d) < tiny);
  ray->inverse = 1.0f / d;
  const float3 a = -eye * ray->inverse, b = (grid_cells(grid) - eye) * ray->inverse;
  const float3 near = LEAST(a, b), far = MOST(a, b);
  ray->first = MOST(MOST(MOST(near.x, near.y), near.z), 0.0f);
  ray->length = LEAST(LEAST(far.x, far.y), far.z) - ray->first;
  ray->entry = clamp_to_grid(eye + ray->first * ray->direction, grid);
  return ray->length > 0.0f;
}

RAY_INLINE float3 position_at(const Ray* ray, VdvrGrid grid, float t) {
  return clamp_to_grid(ray->entry + t * ray->direction, grid);
}

// Where the ray leaves the cube of bricks [b - radius, b + radius], a margin before its faces.
RAY_INLINE float leave_bricks(const Ray* ray, VdvrGrid grid, int3 b, int radius) {
  const float3 low = convert_float3((b - radius) * grid.granularity) + LEAP_MARGIN;
  const float3 high = convert_float3((b + radius + 1) * grid.granularity) - LEAP_MARGIN;
  const float3 t = MOST((low - ray->entry) * ray->inverse, (high - ray->entry) * ray->inverse);
  return LEAST(LEAST(t.x, t.y), t.z);
}

// The first sample index whose position at offset (index + shift) * step is not before t, and at least k + 1.
RAY_INLINE int leap_to(float t, float inverse_step, float shift, int k, int end) {
  const float next = ceil(t * inverse_step - shift);
  return next >= (float)end ? end : max(k + 1, (int)next);
}

RAY_INLINE float4 look_up(__global const float4* restrict table, const VdvrRaycast* p, float value) {
  const float at = (value - p->table_lo) * p->table_scale, last = (float)(p->table_size - 1);
  const float x = at > 0.0f ? LEAST(at, last) : 0.0f;
  const int i = min((int)x, p->table_size - 2);
  const float f = x - (float)i;
  return (1.0f - f) * table[i] + f * table[i + 1];
}

RAY_INLINE float3 background(const VdvrRaycast* p, int py) {
  const float f = ((float)py + 0.5f) / (float)p->height;
  return (1.0f - f) * (float3)(p->background_top[0], p->background_top[1], p->background_top[2]) +
         f * (float3)(p->background_bottom[0], p->background_bottom[1], p->background_bottom[2]);
}

// Emission and absorption, front to back; opacity in `table` is that of one step.
__kernel VDVR_HINT void raycast_dvr(FIELD, BRICKS, VdvrGrid grid, __global const uchar* restrict distance,
                                    __global const float4* restrict table, VdvrRaycast p,
                                    __global float4* restrict picture, __global uint* restrict row_samples) {
  const int px = (int)get_global_id(0), py = (int)get_global_id(1);
  if (px >= p.width || py >= p.height) return;
  grid.granularity = VDVR_GRANULARITY;
  const float3 cells_per_length = (float3)(p.cells_per_length_x, p.cells_per_length_y, p.cells_per_length_z);
  float3 colour = (float3)(0.0f);
  float alpha = 0.0f;
  uint samples = 0;
  Ray ray;
  if (cast_ray(&p, grid, px, py, &ray)) {
    const int end = (int)ceil(ray.length * p.inverse_step - 0.5f);
    int k = 0;
    while (k < end && alpha < p.termination) {
      float3 c = position_at(&ray, grid, ((float)k + 0.5f) * p.step);
      const int3 b = brick_at(grid, c);
      const int away = p.skip ? distance[brick_index(grid, b.x, b.y, b.z)] : 0;
      if (away > 0) {
        k = leap_to(leave_bricks(&ray, grid, b, away - 1), p.inverse_step, 0.5f, k, end);
        continue;
      }
      const OpenBrick brick = open_brick(bricks, grid, b);
      do {
        const float4 e = look_up(table, &p, sample_open(THE_FIELD, &brick, grid, c));
        ++samples;
        if (e.w > 0.0f) {
          float3 rgb = e.xyz;
          const float weight = (1.0f - alpha) * e.w;
          if (p.shading && weight > SHADED_WEIGHT * p.step)
            rgb = shade(rgb, gradient_at(THE_FIELD, bricks, grid, &brick, c, cells_per_length), ray.world,
                        p.gradient_full);
          colour += weight * rgb;
          alpha += weight;
        }
        ++k;
        c = position_at(&ray, grid, ((float)k + 0.5f) * p.step);
      } while (k < end && alpha < p.termination && is_inside(&brick, c));
    }
  }
  picture[(ulong)py * (ulong)p.width + (ulong)px] =
      (float4)(colour + (1.0f - alpha) * background(&p, py), alpha);
  if (samples) atomic_add(&row_samples[py], samples);
}

// The first crossing of `iso`: an interval test between successive samples t_k = k step (the last at the
// box's exit), then bisection. Only bricks wholly below iso are leapt over, so the side of a sample that was
// not taken is known.
__kernel VDVR_HINT void raycast_iso(FIELD, BRICKS, VdvrGrid grid, __global const uchar* restrict distance,
                                    __global const float4* restrict table, VdvrRaycast p,
                                    __global float4* restrict picture, __global uint* restrict row_samples) {
  const int px = (int)get_global_id(0), py = (int)get_global_id(1);
  if (px >= p.width || py >= p.height) return;
  grid.granularity = VDVR_GRANULARITY;
  uint samples = 0;
  Ray ray;
  int hit = 0;
  float before = 0.0f, behind = 0.0f;
  int was_inside = 0;
  if (cast_ray(&p, grid, px, py, &ray)) {
    const int end = (int)ceil(ray.length * p.inverse_step) + 1;
    int k = 0;
    while (k < end && !hit) {
      float t = LEAST((float)k * p.step, ray.length);
      float3 c = position_at(&ray, grid, t);
      const int3 b = brick_at(grid, c);
      const int away = p.skip && !was_inside ? distance[brick_index(grid, b.x, b.y, b.z)] : 0;
      if (away > 0) {
        k = leap_to(leave_bricks(&ray, grid, b, away - 1), p.inverse_step, 0.0f, k, end);
        continue;
      }
      const OpenBrick brick = open_brick(bricks, grid, b);
      do {
        const int inside = sample_open(THE_FIELD, &brick, grid, c) >= p.iso;
        ++samples;
        if (k > 0 && inside != was_inside) {
          hit = 1;
          before = (float)(k - 1) * p.step;
          behind = t;
          break;
        }
        was_inside = inside;
        ++k;
        t = LEAST((float)k * p.step, ray.length);
        c = position_at(&ray, grid, t);
      } while (k < end && is_inside(&brick, c));
    }
  }
  float3 rgb = background(&p, py);
  float depth = -1.0f;
  if (hit) {
    for (int i = 0; i < BISECTIONS; ++i) {
      const float middle = 0.5f * (before + behind);
      const int inside = sample_anywhere(THE_FIELD, bricks, grid, position_at(&ray, grid, middle)) >= p.iso;
      if (inside == was_inside) before = middle;
      else behind = middle;
    }
    const float t = 0.5f * (before + behind);
    const float3 c = position_at(&ray, grid, t);
    rgb = look_up(table, &p, p.iso).xyz;
    if (p.shading) {
      const OpenBrick brick = open_brick(bricks, grid, brick_at(grid, c));
      const float3 cells_per_length =
          (float3)(p.cells_per_length_x, p.cells_per_length_y, p.cells_per_length_z);
      rgb = shade(rgb, gradient_at(THE_FIELD, bricks, grid, &brick, c, cells_per_length), ray.world, 0.0f);
    }
    depth = (ray.first + t) * p.length_unit;
  }
  picture[(ulong)py * (ulong)p.width + (ulong)px] = (float4)(rgb, depth);
  if (samples) atomic_add(&row_samples[py], samples);
}

// The largest sample along the ray; a brick that cannot raise it is leapt over.
__kernel VDVR_HINT void raycast_mip(FIELD, BRICKS, VdvrGrid grid, __global const float2* restrict ranges,
                                    __global const float4* restrict table, VdvrRaycast p,
                                    __global float4* restrict picture, __global uint* restrict row_samples) {
  const int px = (int)get_global_id(0), py = (int)get_global_id(1);
  if (px >= p.width || py >= p.height) return;
  grid.granularity = VDVR_GRANULARITY;
  float largest = -INFINITY;
  uint samples = 0;
  Ray ray;
  if (cast_ray(&p, grid, px, py, &ray)) {
    // At least one sample, so that a ray that only grazes the box has a value.
    const int end = max((int)ceil(ray.length * p.inverse_step - 0.5f), 1);
    int k = 0;
    while (k < end) {
      float3 c = position_at(&ray, grid, ((float)k + 0.5f) * p.step);
      const int3 b = brick_at(grid, c);
      if (p.skip && ranges[brick_index(grid, b.x, b.y, b.z)].y + p.slack <= largest) {
        k = leap_to(leave_bricks(&ray, grid, b, 0), p.inverse_step, 0.5f, k, end);
        continue;
      }
      const OpenBrick brick = open_brick(bricks, grid, b);
      do {
        largest = MOST(largest, sample_open(THE_FIELD, &brick, grid, c));
        ++samples;
        ++k;
        c = position_at(&ray, grid, ((float)k + 0.5f) * p.step);
      } while (k < end && is_inside(&brick, c));
    }
  }
  const float3 rgb = samples ? look_up(table, &p, largest).xyz : background(&p, py);
  picture[(ulong)py * (ulong)p.width + (ulong)px] = (float4)(rgb, largest);
  if (samples) atomic_add(&row_samples[py], samples);
}

// One orthogonal slice, grey; .w is the field itself, 0 outside the grid.
__kernel VDVR_HINT void slice(FIELD, BRICKS, VdvrGrid grid, VdvrSlice s, __global float4* restrict picture) {
  const int px = (int)get_global_id(0), py = (int)get_global_id(1);
  if (px >= s.width || py >= s.height) return;
  grid.granularity = VDVR_GRANULARITY;
  float c[3] = {s.first[0], s.first[1], s.first[2]};
  c[s.across] += (float)px * s.step_across;
  c[s.down] += (float)py * s.step_down;
  float4 e = (float4)(0.02f, 0.02f, 0.02f, 0.0f);
  if (c[0] >= 0.0f && c[0] <= (float)grid.cells_x && c[1] >= 0.0f && c[1] <= (float)grid.cells_y &&
      c[2] >= 0.0f && c[2] <= (float)grid.cells_z) {
    const float value = sample_anywhere(THE_FIELD, bricks, grid, (float3)(c[0], c[1], c[2]));
    const float grey = clamp((value - s.window_lo) * s.window_scale, 0.0f, 1.0f);
    e = (float4)(grey, grey, grey, value);
  }
  picture[(ulong)py * (ulong)s.width + (ulong)px] = e;
}
