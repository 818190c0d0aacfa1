// Emission-absorption with steps adapted to the picture: a step along which the transfer function changes
// much is cut into 2^l equal parts, each sampled at its middle with its own opacity, and one along which it
// is clear is not looked into. What it changes is the total variation, from the value at the step's one end
// to that at the other, of what a step adds to a pixel (VDVR_VARIATION); midpoints of n parts err by 1/(2n)
// of that at most where the field is monotone along the step. All depends on the ray alone. Included by
// raycast.cl.
#ifndef VDVR_RAYCAST_ADAPTIVE_H
#define VDVR_RAYCAST_ADAPTIVE_H

// The total variation of the transfer function from its first entry to r, behind the opacities of all levels.
RAY_INLINE V variation_to(__global const float4* restrict table, const VdvrRaycast* p, Row r) {
  __global const float* sums =
      (__global const float*)(table + p->table_size) + VDVR_ADAPTED_LEVELS * p->table_size;
#define TWO(n) TWO_FLOATS(sums + LANE(r.entry, n))
  const V2 q = PAIRS(TWO);
#undef TWO
  // Exact where the two are equal: between two values of one clear stretch nothing varies.
  return q.first + r.fraction * (q.second - q.first);
}

// Opacities of a part at level l stand behind those of a step, one table a level.
RAY_INLINE V opacity_of_level(__global const float4* restrict table, const VdvrRaycast* p, Row r, I level) {
  r.entry += level * p->table_size;
  return opacity_of(table, p, r);
}

// log2 of how many parts a step needs that changes a pixel by `change`.
RAY_INLINE I level_for(V change) {
  I level = 0;
  float most = VDVR_PART_CHANGE;
  for (int l = 1; l < VDVR_ADAPTED_LEVELS; ++l, most *= 2.0f) level += PICK(change > most, (I)(1), (I)(0));
  return level;
}

// Composites the parts of step k in the lanes `shown`; `around` is the brick of the last part.
RAY_INLINE void take_parts(FIELD, BRICKS, VdvrGrid grid, __global const float4* restrict table,
                           const VdvrRaycast* p, const Ray* ray, int k, I shown, I level, OpenBrick* around,
                           I* samples, Seen* seen BOUNDS) {
  const I parts = (I)(1) << level;
  const V part = p->step / TO_V(parts), inverse_part = p->inverse_step * TO_V(parts), none = (V)(0.0f);
  const int most = most_lane(PICK(shown, parts, (I)(0)));
  for (int i = 0; i < most; ++i) {
    const V from = (float)k * p->step + (float)i * part, t = middle_of_step(ray, from, part);
    const I active = shown & (i < parts) & (from < ray->length) & (seen->alpha < p->termination);
    if (!ANY(active)) continue;
    const V3 c = position_at(ray, grid, t);
    if (ANY(active & NOT(is_inside(around, c)))) *around = open_brick(bricks, grid, brick_at(grid, c));
    const Sampled sampled = sample_open(THE_FIELD, around, grid, c);
    const Row row = row_of(p, sampled.value);
    *samples += PICK(active, (I)(1), (I)(0));
    const V opacity = PICK(active, opacity_of_level(table, p, row, level), none);
    if (!ANY(opacity > 0.0f)) continue;
    const V share = share_of_step(ray, from, inverse_part);
    const V weight = (1.0f - seen->alpha) * opacity_of_share(opacity, share);
    absorb(THE_FIELD, bricks, grid, p, ray, around, &sampled, c, t, colour_of(table, row), weight,
           SHADED_WEIGHT * part * share, seen THE_BOUNDS);
  }
}

// Steps end at t_j = j step, the last where the ray leaves the grid; j counts these ends. Bricks whose values
// lie in one clear stretch of the transfer function are leapt over together (raycast_preintegrated.h).
__kernel VDVR_HINT void raycast_adaptive(FIELD, BRICKS, VdvrGrid grid,
                                         __global const uchar* restrict distance,
                                         __global const float4* restrict table, VdvrRaycast p,
                                         __global float4* restrict picture,
                                         __global uint* restrict row_samples BOUNDS) {
  THE_PIXELS;
  Seen seen = nothing_seen((V)(VDVR_BOUNDS ? -1.0f : NAN));
  I samples = 0, away = 0;
  const Ray ray = cast_rays(&p, grid, px, py);
  const I ends = ends_of(&p, &ray, px, py, ray.length * p.inverse_step);
  const int end = most_lane(ends);
  OpenBrick brick = no_brick(), around = no_brick();
  V before = (V)(0.0f);
  int j = 0;
  while (j <= end) {
    const I active = (ends > 0) & (j <= ends) & (seen.alpha < p.termination);
    if (!ANY(active)) break;
    const V3 c = position_at(&ray, grid, LEAST((V)((float)j * p.step), ray.length));
    if (ANY(active & NOT(is_inside(&brick, c)))) {
      brick = open_brick(bricks, grid, brick_at(grid, c));
      if (p.skip) away = TO_I(GATHER(U8, distance, brick_index(grid, brick.at)));
    }
    const Row row = row_of(&p, sample_open(THE_FIELD, &brick, grid, c).value);
    samples += PICK(active, (I)(1), (I)(0));
    const V now = variation_to(table, &p, row), change = fabs(now - before);
    const V most = change + opacity_of(table, &p, row);
    const I shown = active & (most > 0.0f);
    if (j > 0 && ANY(shown))
      take_parts(THE_FIELD, bricks, grid, table, &p, &ray, j - 1, shown,
                 level_for((1.0f - seen.alpha) * most), &around, &samples, &seen THE_BOUNDS);
    before = now;
    ++j;
    if (p.skip && !ANY(active & (away == 0))) {
      const int next =
          leap_to(leave_bricks(&ray, brick.at, away - 1), active, p.inverse_step, 0.0f, j - 1, end + 1);
      if (next > j) {
        const V3 last = position_at(&ray, grid, LEAST((V)((float)(next - 1) * p.step), ray.length));
        const V value = sample_anywhere(THE_FIELD, bricks, grid, last).value;
        before = variation_to(table, &p, row_of(&p, value));
        j = next;
      }
    }
  }
  put_seen(&p, picture, row_samples, px, py, &seen, seen.alpha, samples);
}

#endif
