// Emission-absorption with steps adapted to the level: step k of a ray is cut into 2^l equal parts where the
// brick at its middle has 2^l samples a cell (along the axis that has most; 1 at least), each sampled at its
// middle with its own opacity. The parts depend on the ray's own parameter and that level alone. Included by
// raycast.cl.
#ifndef VDVR_RAYCAST_LEVEL_H
#define VDVR_RAYCAST_LEVEL_H

// The largest l of each lane's brick.
RAY_INLINE I level_at(BRICKS, VdvrGrid grid, V3 c) {
  const I3 at = brick_at(grid, c);
  const Offset place = brick_index(grid, at) * (Offset)(VDVR_BRICK_WORDS);
  __global const int* bits = (__global const int*)bricks + 1;
  const I b = GATHER(I, bits, place), x = (b & 7) - VDVR_COARSE_X, y = (b >> 3 & 7) - VDVR_COARSE_Y,
          z = (b >> 6 & 7) - VDVR_COARSE_Z, xy = MOST(x, y), xyz = MOST(xy, z);
  return MOST(xyz, (I)(0));
}

// Opacities of a part at level l stand behind those of a step, one table a level.
RAY_INLINE V opacity_of_level(__global const float4* restrict table, const VdvrRaycast* p, Row r, I level) {
  r.entry += level * p->table_size;
  return opacity_of(table, p, r);
}

__kernel VDVR_HINT void raycast_level(FIELD, BRICKS, VdvrGrid grid, __global const uchar* restrict distance,
                                      __global const float4* restrict table, VdvrRaycast p,
                                      __global float4* restrict picture,
                                      __global uint* restrict row_samples BOUNDS) {
  THE_PIXELS;
  const V none = (V)(0.0f);
  Seen seen = nothing_seen((V)(VDVR_BOUNDS ? -1.0f : NAN));
  I samples = 0;
  const Ray ray = cast_rays(&p, grid, px, py);
  const I ends = ends_of(&p, &ray, px, py, ray.length * p.inverse_step);
  const int end = most_lane(ends);
  OpenBrick brick = no_brick();
  int k = 0;
  while (k < end) {
    const I wanted = (k < ends) & (seen.alpha < p.termination);
    if (!ANY(wanted)) break;
    if (p.skip) {
      // Only steps that lie wholly within what is leapt over are left out.
      const I3 at = brick_at(grid, position_at(&ray, grid, LEAST((V)((float)k * p.step), ray.length)));
      const I away = TO_I(GATHER(U8, distance, brick_index(grid, at)));
      if (!ANY(wanted & (away == 0))) {
        const V left = PICK(wanted, leave_bricks(&ray, at, away - 1), (V)(INFINITY));
        const int next = (int)LEAST(floor(least_lane(left) * p.inverse_step), (float)end);
        if (next > k) {
          k = next;
          continue;
        }
      }
    }
    const V middle = middle_of_step(&ray, (V)((float)k * p.step), (V)(p.step));
    const I level = level_at(bricks, grid, position_at(&ray, grid, middle)), parts = (I)(1) << level;
    const V part = p.step / TO_V(parts);
    const int most = most_lane(PICK(wanted, parts, (I)(0)));
    for (int i = 0; i < most; ++i) {
      const V from = (float)k * p.step + (float)i * part, t = middle_of_step(&ray, from, part);
      const I active = wanted & (i < parts) & (from < ray.length) & (seen.alpha < p.termination);
      if (!ANY(active)) continue;
      const V3 c = position_at(&ray, grid, t);
      if (ANY(active & NOT(is_inside(&brick, c)))) brick = open_brick(bricks, grid, brick_at(grid, c));
      const Sampled sampled = sample_open(THE_FIELD, &brick, grid, c);
      const Row row = row_of(&p, sampled.value);
      samples += PICK(active, (I)(1), (I)(0));
      const V opacity = PICK(active, opacity_of_level(table, &p, row, level), none);
      if (!ANY(opacity > 0.0f)) continue;
      const V share = share_of_step(&ray, from, p.inverse_step * TO_V(parts));
      const V weight = (1.0f - seen.alpha) * opacity_of_share(opacity, share);
      absorb(THE_FIELD, bricks, grid, &p, &ray, &brick, &sampled, c, t, colour_of(table, row), weight,
             SHADED_WEIGHT * part * share, &seen THE_BOUNDS);
    }
    ++k;
  }
  put_seen(&p, picture, row_samples, px, py, &seen, seen.alpha, samples);
}

#endif
