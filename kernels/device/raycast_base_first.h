// raycast_dvr of lit samples in packets (VDVR_BASE_FIRST): what a packet has found out about its bricks holds
// for a stretch of samples, so that the loop over these neither looks where it is nor carries records along.
// Included by raycast_dvr.h.
#ifndef VDVR_RAYCAST_BASE_FIRST_H
#define VDVR_RAYCAST_BASE_FIRST_H

// Samples [*k, stop) of the bricks that are open, in the lanes `drawn`; BASE: all of them read the base.
#define TAKE_STRETCH(BASE)                                                                 \
  for (; k < stop; ++k) {                                                                  \
    const I active = drawn & (k < ends) & (seen.alpha < p.termination);                    \
    if (!ANY(active)) break;                                                               \
    const V t = middle_of_step(&ray, (V)((float)k * p.step), (V)(p.step));                 \
    const V3 c = position_at(&ray, grid, t);                                               \
    const Sampled sampled = sample_base_first(THE_FIELD, &brick, BASE, grid, c);           \
    samples += PICK(active, (I)(1), (I)(0));                                               \
    composite(THE_FIELD, bricks, grid, table, &p, &ray, &brick, &sampled, c, k, t, active, \
              &seen THE_BOUNDS);                                                           \
  }

// As the other raycast_dvr. `distance` is the guide: which bricks read the base, and which show nothing.
__kernel VDVR_HINT void raycast_dvr(DVR_ARGUMENTS) {
  THE_PIXELS;
  Seen seen = nothing_seen((V)(VDVR_BOUNDS ? -1.0f : NAN));
  I samples = 0;
  const Ray ray = cast_rays(&p, grid, px, py);
  const I ends = ends_of(&p, &ray, px, py, ray.length * p.inverse_step);
  const int end = most_lane(ends);
  int k = 0;
  while (k < end) {
    const I wanted = (k < ends) & (seen.alpha < p.termination);
    if (!ANY(wanted)) break;
    const V middle = middle_of_step(&ray, (V)((float)k * p.step), (V)(p.step));
    const I3 at = brick_at(grid, position_at(&ray, grid, middle));
    const I guide = TO_I(GATHER(U8, distance, brick_index(grid, at)));
    // A tile is a brick of its own.
    const I radius = MOST((guide & (VDVR_GUIDE_EMPTY - 1)) - 1, (I)(0));
    const int stop = leap_to(leave_bricks(&ray, at, radius), wanted, p.inverse_step, 0.5f, k, end);
    // What stands in the base in the place of an empty brick's tile is not the field.
    const I drawn = wanted & NOT((guide & VDVR_GUIDE_EMPTY) != 0);
    if (!ANY(drawn)) {
      k = stop;
      continue;
    }
#if !VDVR_UNIFORM
    if (ANY(wanted & (guide == 0))) {
      const OpenBrick brick = open_whole_base(bricks, grid, at);
      TAKE_STRETCH(0)
      continue;
    }
#endif
    const OpenBrick brick = no_brick();
    TAKE_STRETCH(1)
  }
  put_seen(&p, picture, row_samples, px, py, &seen, seen.alpha, samples);
}

#undef TAKE_STRETCH
#endif
