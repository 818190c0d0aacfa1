// What one part of a ray does to the interval of the colour behind it, and what fp32 makes of that
// (docs/pixel-bounds.md, theorems 3, 4 and 6). Included by certify_ray.h, and by a test that holds it to
// double precision.
//
// Both ends are followed by one text: the lower end of c is minus the upper one of -c.
// VDVR_CHORD: steps are those of theorem 4.
#ifndef VDVR_CERTIFY_STEP_H
#define VDVR_CERTIFY_STEP_H

#ifndef VDVR_CHORD
#define VDVR_CHORD 0
#endif

// 1 - 2^-x of an x >= 0, within 3.2 u of itself however small it is: what a short part moves a colour by is
// as well known as that is small. The polynomial is (1 - 2^-f) / f on [0, 1], within 0.4 u.
RAY_INLINE V absorbed(V x) {
  const V most = (V)(64.0f), within = LEAST(x, most);
  const I k = TO_I(within);
  const V f = within - TO_V(k);
  const V p = 0.693147182f +
              f * (-0.24022606f +
                   f * (0.0554989539f + f * (-0.0095962761f + f * (0.00129078003f + f * -0.000114580565f))));
  const V a = f * p, scale = PACKET(as_float)((127 - k) << 23);
  return PICK(k > 0, 1.0f - scale * (1.0f - a), a);
}

// Of the values of a part, or of a half of them: extinctions and visible colours. Of the least the negative,
// as the table has them.
typedef struct {
  V t1, minus_t0;
  V3 c1, minus_c0;
} Shown;

RAY_INLINE Shown shown_of_both(const Shown* a, const Shown* b) {
  Shown s;
  s.t1 = MOST(a->t1, b->t1);
  s.minus_t0 = MOST(a->minus_t0, b->minus_t0);
  s.c1 = most3(a->c1, b->c1);
  s.minus_c0 = most3(a->minus_c0, b->minus_c0);
  return s;
}

// `dense` and `thin` are the shares of what lies behind that the part takes at its largest and its least
// extinction.
typedef struct {
  Shown all;
  V length, dense, thin;
  I shows;
#if VDVR_CHORD
  Shown halves[2];  // of the lower and the upper half of the values
#endif
} Part;

RAY_INLINE Part new_part(V length, I active) {
  Part part;
  part.length = length;
  part.shows = active;
  return part;
}
RAY_INLINE void find_shares(Part* part) {
  part->shows &= part->all.t1 > 0.0f;
  part->dense = absorbed(part->length * part->all.t1);
  part->thin = absorbed(part->length * -part->all.minus_t0);
}

#if VDVR_CHORD
// The most that a half shows for a length before the colour behind.
RAY_INLINE V most_of_half(const Shown* h, V c, V behind) {
  const V shows = (c - behind) * PICK(c > behind, h->t1, -h->minus_t0);
  return PICK(h->t1 > 0.0f, shows, (V)(0.0f));  // what is clear shows 0
}
// The share of theorem 4: k = H0 / (c - behind), never beyond what the box step takes.
RAY_INLINE V share_of(const Part* part, V c, V a, V b, V behind) {
  const V t1 = part->all.t1, t0 = -part->all.minus_t0;
  const V first = most_of_half(&part->halves[0], a, behind),
          second = most_of_half(&part->halves[1], b, behind), h0 = MOST(first, second);
  const V k = h0 / PICK(c == behind, (V)(1.0f), c - behind);
  return absorbed(part->length * PICK(c > behind, LEAST(k, t1), MOST(k, t0)));
}
#define SHARE_OF(COLOUR, axis, behind) \
  share_of(part, part->all.COLOUR.axis, part->halves[0].COLOUR.axis, part->halves[1].COLOUR.axis, behind)
#else
// The box step of theorem 3.
RAY_INLINE V share_of(const Part* part, V c, V behind) { return PICK(c > behind, part->dense, part->thin); }
#define SHARE_OF(COLOUR, axis, behind) share_of(part, part->all.COLOUR.axis, behind)
#endif

// The colour in front of the part, at most.
#define STEPPED(COLOUR, axis) \
  (behind.axis + (part->all.COLOUR.axis - behind.axis) * SHARE_OF(COLOUR, axis, behind.axis))
RAY_INLINE V3 above_part(const Part* part, V3 behind) {
  return pick3(part->shows, v3(STEPPED(c1, x), STEPPED(c1, y), STEPPED(c1, z)), behind);
}
// The same of minus the colour.
RAY_INLINE V3 minus_below_part(const Part* part, V3 behind) {
  return pick3(part->shows, v3(STEPPED(minus_c0, x), STEPPED(minus_c0, y), STEPPED(minus_c0, z)), behind);
}
#undef STEPPED
#undef SHARE_OF

// How far the ends may be off in front of a part, if they were off by `error` behind it. What was off is seen
// through the part, whose share is known to 10 u; the sum rounds by half a unit of its last place; all else
// that rounds is a part of what the step moves by.
RAY_INLINE V error_in_front(const VdvrCertify* q, const Part* part, V error) {
  const V passes = (1.0f + 10 * VDVR_UNIT) - part->thin;
  return PICK(part->shows, error * passes + (q->sum_error + q->share_error * part->dense), error);
}
// All that a ray of so many parts is widened by: errors were summed in fp32 as well, and the last sum rounds.
RAY_INLINE V error_of_ray(const VdvrCertify* q, V error, I parts) {
  return error * (1.0f + 4 * VDVR_UNIT * TO_V(parts)) + 2.0f * q->sum_error;
}

#endif
