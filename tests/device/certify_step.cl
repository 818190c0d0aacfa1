// The steps of certified pictures alone: certify_step_test.cpp puts this text behind that of
// pixel/pixel_bounds.cl, built as that is built.
//
// Layouts: parts[step][number][chain], the numbers of a part in the order of Number; x, share[i];
// ends[number][chain].

#define NUMBERS_OF_PART 17
#define NUMBERS_OF_STRETCHES 13
#define NUMBERS_OF_ENDS 7

RAY_INLINE V number_at(__global const float* numbers, int at) {
  V v;
#define READ(n) LANE(v, n) = numbers[at + 0x##n];
  EACH(READ)
#undef READ
  return v;
}
RAY_INLINE void put_number(__global float* numbers, int at, V v) {
#define PUT(n) numbers[at + 0x##n] = LANE(v, n);
  EACH(PUT)
#undef PUT
}

__kernel VDVR_HINT void find_absorbed(__global const float* restrict x, __global float* restrict share) {
  const int first = (int)get_global_id(0) * VDVR_LANES;
  put_number(share, first, absorbed(number_at(x, first)));
}

// Pieces b[number][piece] cut into n parts: coefficients[part][number][piece].
__kernel VDVR_HINT void cut_pieces(__global const float* restrict b, int pieces, int n,
                                   __global float* restrict coefficients) {
  const int first = (int)get_global_id(0) * VDVR_LANES;
  Piece s;
  s.b0 = number_at(b, first);
  s.b1 = number_at(b, pieces + first);
  s.b2 = number_at(b, 2 * pieces + first);
  s.b3 = number_at(b, 3 * pieces + first);
  s.length = s.e = (V)(1.0f);
  const Cut cut = cut_of(&s, (I)(n));
  Joint behind = last_joint(&s, &cut);
  for (int part = n; part > 0; --part) {
    const Joint front = joint_at(&cut, part - 1);
    const Piece c = piece_between(front, behind);
    const int at = (part - 1) * 4 * pieces + first;
    put_number(coefficients, at, c.b0);
    put_number(coefficients, at + pieces, c.b1);
    put_number(coefficients, at + 2 * pieces, c.b2);
    put_number(coefficients, at + 3 * pieces, c.b3);
    behind = front;
  }
}

RAY_INLINE void put_ends(const VdvrCertify* q, __global float* ends, int first, int chains, int steps, V3 hi,
                         V3 minus_lo, V error) {
  put_number(ends, first, hi.x);
  put_number(ends, chains + first, hi.y);
  put_number(ends, 2 * chains + first, hi.z);
  put_number(ends, 3 * chains + first, minus_lo.x);
  put_number(ends, 4 * chains + first, minus_lo.y);
  put_number(ends, 5 * chains + first, minus_lo.z);
  put_number(ends, 6 * chains + first, error_of_ray(q, error, (I)(steps)));
}

// A chain's ends, carried from the back to the front.
typedef struct {
  V3 hi, minus_lo;
  V error;
} ChainEnds;
RAY_INLINE ChainEnds ends_before(float behind) {
  const V3 hi = v3((V)(behind), (V)(behind), (V)(behind));
  const ChainEnds ends = {hi, negative3(hi), (V)(0.0f)};
  return ends;
}
RAY_INLINE void pass_part(const VdvrCertify* q, Part* part, ChainEnds* ends) {
  find_shares(part);
  ends->hi = above_part(part, ends->hi);
  ends->minus_lo = minus_below_part(part, ends->minus_lo);
  ends->error = error_in_front(q, part, ends->error);
}

// Back to front from colours of all chains that are `behind`. A part's values are two halves of which the
// extremes are known.
__kernel VDVR_HINT void step_chains(VdvrCertify q, __global const float* restrict parts, int chains,
                                    int steps, float behind, __global float* restrict ends) {
  const int first = (int)get_global_id(0) * VDVR_LANES;
  if (first >= chains) return;
  ChainEnds at_front = ends_before(behind);
#define NUMBER(n) number_at(parts, (step * NUMBERS_OF_PART + (n)) * chains + first)
  for (int step = steps - 1; step >= 0; --step) {
    Part part = new_part(NUMBER(0), (I)(1) == (I)(1));
    Shown halves[2];
    for (int k = 0; k < 2; ++k) {
      const int at = 1 + 8 * k;
      halves[k].t1 = NUMBER(at);
      halves[k].minus_t0 = NUMBER(at + 1);
      halves[k].c1 = v3(NUMBER(at + 2), NUMBER(at + 3), NUMBER(at + 4));
      halves[k].minus_c0 = v3(NUMBER(at + 5), NUMBER(at + 6), NUMBER(at + 7));
    }
#if VDVR_JOINT
    clear_part(&part, (I)(0));
    add_box(&q, &part, &halves[0], at_front.hi, at_front.minus_lo);
    add_box(&q, &part, &halves[1], at_front.hi, at_front.minus_lo);
#else
    part.all.t1 = MOST(halves[0].t1, halves[1].t1);
    part.all.minus_t0 = MOST(halves[0].minus_t0, halves[1].minus_t0);
    part.all.c1 = most3(halves[0].c1, halves[1].c1);
    part.all.minus_c0 = most3(halves[0].minus_c0, halves[1].minus_c0);
#endif
    pass_part(&q, &part, &at_front);
  }
#undef NUMBER
  put_ends(&q, ends, first, chains, steps, at_front.hi, at_front.minus_lo, at_front.error);
}

#if VDVR_JOINT
// The same of parts whose values are two straight stretches: extinctions and colours at three values.
__kernel VDVR_HINT void step_stretches(VdvrCertify q, __global const float* restrict parts, int chains,
                                       int steps, float behind, __global float* restrict ends) {
  const int first = (int)get_global_id(0) * VDVR_LANES;
  if (first >= chains) return;
  ChainEnds at_front = ends_before(behind);
#define NUMBER(n) number_at(parts, (step * NUMBERS_OF_STRETCHES + (n)) * chains + first)
  for (int step = steps - 1; step >= 0; --step) {
    Part part = new_part(NUMBER(0), (I)(1) == (I)(1));
    ValueShown at[3];
    for (int k = 0; k < 3; ++k) {
      at[k].t = NUMBER(1 + 4 * k);
      at[k].c = v3(NUMBER(2 + 4 * k), NUMBER(3 + 4 * k), NUMBER(4 + 4 * k));
    }
    clear_part(&part, (I)(0));
    add_stretch(&q, &part, at[0], at[1], at_front.hi, at_front.minus_lo);
    add_stretch(&q, &part, at[1], at[2], at_front.hi, at_front.minus_lo);
    pass_part(&q, &part, &at_front);
  }
#undef NUMBER
  put_ends(&q, ends, first, chains, steps, at_front.hi, at_front.minus_lo, at_front.error);
}
#endif
