// What one part of a ray does to the interval of the colour behind it, and what fp32 makes of that
// (docs/pixel-bounds.md, theorems 3, 4 and 6). Included by certify_ray.h, and by a test that holds it to
// double precision.
//
// Both ends are followed by one text: the lower end of c is minus the upper one of -c.
// VDVR_JOINT: steps are those of theorem 4.
#ifndef VDVR_CERTIFY_STEP_H
#define VDVR_CERTIFY_STEP_H

#ifndef VDVR_JOINT
#define VDVR_JOINT 0
#endif

#define LN2 0.693147182f

// 1 - 2^-x of an x >= 0, within 3.2 u of itself however small it is: what a short part moves a colour by is
// as well known as that is small. The polynomial is (1 - 2^-f) / f on [0, 1], within 0.4 u.
RAY_INLINE V absorbed(V x) {
  const V most = (V)(64.0f), within = LEAST(x, most);
  const I k = TO_I(within);
  const V f = within - TO_V(k);
  const V p =
      LN2 + f * (-0.24022606f +
                 f * (0.0554989539f + f * (-0.0095962761f + f * (0.00129078003f + f * -0.000114580565f))));
  const V a = f * p, scale = PACKET(as_float)((127 - k) << 23);
  return PICK(k > 0, 1.0f - scale * (1.0f - a), a);
}

// Of some values: extinctions and visible colours. Of the least the negative, as the table has them.
typedef struct {
  V t1, minus_t0;
  V3 c1, minus_c0;
} Shown;

// `dense` and `thin` are the shares of what lies behind that the part takes at its largest and its least
// extinction.
typedef struct {
  Shown all;
  V length, dense, thin;
  I shows;
#if VDVR_JOINT
  V3 most, most_minus;          // H0 of the colour and of minus the colour
  V dense_length, thin_length;  // shares over extinctions
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
#if VDVR_JOINT
  // A share that is next to nothing is worth the length at most, and nothing at least.
  const V none = (V)(0.0f), one = (V)(1.0f), least = (V)(1e-30f);
  part->dense_length =
      PICK(part->dense > least, part->dense / PICK(part->dense > least, part->all.t1, one), none);
  part->thin_length =
      PICK(part->thin > least, part->thin / PICK(part->thin > least, -part->all.minus_t0, one),
           part->length * LN2);
#endif
}

#if VDVR_JOINT
// The transfer function at one value.
typedef struct {
  V t;
  V3 c;
} ValueShown;
RAY_INLINE ValueShown pick_value(I m, ValueShown a, ValueShown b) {
  const ValueShown s = {PICK(m, a.t, b.t), pick3(m, a.c, b.c)};
  return s;
}

// A part of no values yet, or of one that is clear.
RAY_INLINE void clear_part(Part* part, I or_clear) {
  const V none = (V)(-INFINITY), least = PICK(or_clear, (V)(0.0f), none);
  const V3 no_colour = {none, none, none}, shows = {least, least, least};
  part->all.t1 = (V)(0.0f);
  part->all.minus_t0 = least;
  part->all.c1 = part->all.minus_c0 = no_colour;
  part->most = part->most_minus = shows;
}

// The most that a straight stretch of the transfer function shows for a length before the colour behind:
// colours less that one at its thin and its dense end, the least extinction that a thin value beside the
// dense end may be taken for (theorem 4), and by how much the product with both of them may rise between.
RAY_INLINE V most_of_stretch(V thin, V dense, V tangent, V at_thin, V at_dense, V rises) {
  const V a = thin * at_thin, b = PICK(at_dense < 0.0f, tangent, dense) * at_dense;
  const V more = rises - fabs(a - b);
  return MOST(a, b) + 0.25f * MOST(more, (V)(0.0f));
}
// Takes in the values between two, of which the transfer function is straight.
RAY_INLINE void add_stretch(const VdvrCertify* q, Part* part, ValueShown a, ValueShown b, V3 behind,
                            V3 minus_behind) {
  const I rises = b.t > a.t;
  const ValueShown thin = pick_value(rises, a, b), dense = pick_value(rises, b, a);
  const I shows = dense.t > 0.0f;
  const V none = (V)(-INFINITY), by = dense.t - thin.t;
  // The tangent at the thin end.
  const V tangent = thin.t + LEAST(by, absorbed(by) * (1 / LN2));
  const V error = q->joint_error + q->joint_rounding * dense.t;
  part->all.t1 = MOST(part->all.t1, PICK(shows, dense.t + q->extinction_error, dense.t));
  const V least = q->extinction_error - thin.t;
  part->all.minus_t0 = MOST(part->all.minus_t0, LEAST(least, (V)(0.0f)));
#define ADD(axis)                                                                                            \
  {                                                                                                          \
    const V c1 = PICK(shows, MOST(a.c.axis, b.c.axis), none),                                                \
            minus_c0 = PICK(shows, -LEAST(a.c.axis, b.c.axis), none),                                        \
            bulge = by * (thin.c.axis - dense.c.axis);                                                       \
    const V most = error + most_of_stretch(thin.t, dense.t, tangent, thin.c.axis - behind.axis,              \
                                           dense.c.axis - behind.axis, bulge),                               \
            most_minus = error + most_of_stretch(thin.t, dense.t, tangent, -thin.c.axis - minus_behind.axis, \
                                                 -dense.c.axis - minus_behind.axis, -bulge);                 \
    part->all.c1.axis = MOST(part->all.c1.axis, c1);                                                         \
    part->all.minus_c0.axis = MOST(part->all.minus_c0.axis, minus_c0);                                       \
    part->most.axis = MOST(part->most.axis, most);                                                           \
    part->most_minus.axis = MOST(part->most_minus.axis, most_minus);                                         \
  }
  ADD(x)
  ADD(y)
  ADD(z)
#undef ADD
}
// Takes in values of which only the extremes are known.
RAY_INLINE V most_of_box(const Shown* s, V c, V behind) {
  const V shows = (c - behind) * PICK(c > behind, s->t1, -s->minus_t0);
  return PICK(s->t1 > 0.0f, shows, (V)(0.0f));  // what is clear shows 0
}
RAY_INLINE void add_box(const VdvrCertify* q, Part* part, const Shown* s, V3 behind, V3 minus_behind) {
  const V error = q->joint_error + q->joint_rounding * s->t1;
  part->all.t1 = MOST(part->all.t1, s->t1);
  part->all.minus_t0 = MOST(part->all.minus_t0, s->minus_t0);
#define ADD(axis)                                                                     \
  {                                                                                   \
    const V most = error + most_of_box(s, s->c1.axis, behind.axis),                   \
            most_minus = error + most_of_box(s, s->minus_c0.axis, minus_behind.axis); \
    part->all.c1.axis = MOST(part->all.c1.axis, s->c1.axis);                          \
    part->all.minus_c0.axis = MOST(part->all.minus_c0.axis, s->minus_c0.axis);        \
    part->most.axis = MOST(part->most.axis, most);                                    \
    part->most_minus.axis = MOST(part->most_minus.axis, most_minus);                  \
  }
  ADD(x)
  ADD(y)
  ADD(z)
#undef ADD
}
#endif

// The box step of theorem 3.
RAY_INLINE V box_step(const Part* part, V c, V behind) {
  return behind + (c - behind) * PICK(c > behind, part->dense, part->thin);
}
#if VDVR_JOINT
// The joint step of theorem 4, where it is the narrower.
RAY_INLINE V joint_step(const Part* part, V c, V most, V behind) {
  const V joint = behind + most * PICK(most > 0.0f, part->thin_length, part->dense_length),
          box = box_step(part, c, behind);
  return LEAST(joint, box);
}
#define STEPPED(COLOUR, MOST_OF, axis) \
  joint_step(part, part->all.COLOUR.axis, part->MOST_OF.axis, behind.axis)
#else
#define STEPPED(COLOUR, MOST_OF, axis) box_step(part, part->all.COLOUR.axis, behind.axis)
#endif
// The colour in front of the part, at most.
RAY_INLINE V3 above_part(const Part* part, V3 behind) {
  return pick3(part->shows, v3(STEPPED(c1, most, x), STEPPED(c1, most, y), STEPPED(c1, most, z)), behind);
}
// The same of minus the colour.
RAY_INLINE V3 minus_below_part(const Part* part, V3 behind) {
  return pick3(part->shows,
               v3(STEPPED(minus_c0, most_minus, x), STEPPED(minus_c0, most_minus, y),
                  STEPPED(minus_c0, most_minus, z)),
               behind);
}
#undef STEPPED

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
