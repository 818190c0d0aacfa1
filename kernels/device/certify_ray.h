// A ray in pieces, each within one cell of one brick: what the field can be on it, and what the transfer
// function then shows (docs/pixel-bounds.md). Included by kernels of kernels/picture/pixel, after
// raycast_dvr.h.
//
// VDVR_LIGHT: pieces also end where the drawn steps do, and each has the light that its step was drawn with.
#ifndef VDVR_CERTIFY_RAY_H
#define VDVR_CERTIFY_RAY_H
#include "device/ray_cells.h"

#ifndef VDVR_LIGHT
#define VDVR_LIGHT 0
#endif

RAY_INLINE V3 least3(V3 a, V3 b) { return v3(LEAST(a.x, b.x), LEAST(a.y, b.y), LEAST(a.z, b.z)); }
RAY_INLINE V3 most3(V3 a, V3 b) { return v3(MOST(a.x, b.x), MOST(a.y, b.y), MOST(a.z, b.z)); }

#include "device/certify_step.h"

// The field on a piece is the cubic of Bernstein coefficients b0 to b3, and F lies within e of it.
typedef struct {
  V b0, b1, b2, b3;
  V length, e;
  V lit, highlight;  // a colour c is seen as c * lit + highlight
} Piece;

// Where rays are: the next piece begins at t, in the cell at c.
typedef struct {
  OpenBrick brick;
  V3 c;
  V t, bound;  // of the brick's field
  I away, active;
#if VDVR_LIGHT
  I step, lit_step;  // that t lies in, and that the light was found for
  V lit, highlight;
#endif
} Walk;

#define RANGES __global const float4 *restrict ranges, __global const int *restrict next_shown
#define THE_RANGES ranges, next_shown

RAY_INLINE I bin_of(const VdvrCertify* q, V value, float outward) {
  V x = (value - q->range_lo) * q->range_scale + outward;
  x = MOST(x, (V)(0.0f));
  x = LEAST(x, (V)((float)(q->bins - 1)));
  return TO_I(x);
}
// Whether no value of [from, to] shows anything.
RAY_INLINE I is_clear(RANGES, const VdvrCertify* q, V from, V to) {
  const I first = bin_of(q, from, -VDVR_BIN_MARGIN), last = bin_of(q, to, VDVR_BIN_MARGIN);
  return GATHER(I, next_shown, first) > last;
}

// The two rows of the table, of runs of 2^k bins, that hold all bins of [from, to].
typedef struct {
  I first, second;
} Rows;
RAY_INLINE Rows rows_of_bins(const VdvrCertify* q, I first, I last) {
  const I k = 31 - AS_I(clz(AS_U(last - first + 1)));
  const Rows r = {k * q->bins + first, k * q->bins + last - ((I)(1) << k) + 1};
  return r;
}
RAY_INLINE Rows rows_of(const VdvrCertify* q, V from, V to) {
  return rows_of_bins(q, bin_of(q, from, -VDVR_BIN_MARGIN), bin_of(q, to, VDVR_BIN_MARGIN));
}
// The least extinction of [from, to], in halvings a length.
RAY_INLINE V least_extinction(RANGES, const VdvrCertify* q, V from, V to) {
  const Rows r = rows_of(q, from, to);
  __global const float* negative = (__global const float*)ranges + 1;
  const V a = GATHER(V, negative, 8 * r.first), b = GATHER(V, negative, 8 * r.second);
  return -MOST(a, b);
}
// Extinctions and visible colours of two rows together.
RAY_INLINE Shown shown_of(RANGES, Rows r) {
#define FIRST_LOW(n) ranges[2 * LANE(r.first, n)]
#define FIRST_HIGH(n) ranges[2 * LANE(r.first, n) + 1]
#define SECOND_LOW(n) ranges[2 * LANE(r.second, n)]
#define SECOND_HIGH(n) ranges[2 * LANE(r.second, n) + 1]
  const V4 al = TURN(FIRST_LOW), ah = TURN(FIRST_HIGH), bl = TURN(SECOND_LOW), bh = TURN(SECOND_HIGH);
#undef FIRST_LOW
#undef FIRST_HIGH
#undef SECOND_LOW
#undef SECOND_HIGH
  Shown s;
  s.t1 = MOST(al.x, bl.x);
  s.minus_t0 = MOST(al.y, bl.y);
  s.c1 = v3(MOST(al.z, bl.z), MOST(al.w, bl.w), MOST(ah.x, bh.x));
  s.minus_c0 = v3(MOST(ah.y, bh.y), MOST(ah.z, bh.z), MOST(ah.w, bh.w));
  return s;
}

RAY_INLINE Walk start_walk(const VdvrRaycast* p, const Ray* ray, I px, I py) {
  Walk w;
  w.brick = no_brick();
  w.c = ray->entry;
  w.t = w.bound = (V)(0.0f);
  w.away = (I)(0);
  w.active = ends_of(p, ray, px, py, (V)(1.0f)) > 0;
#if VDVR_LIGHT
  w.step = (I)(0);
  w.lit_step = (I)(-1);
  w.lit = (V)(1.0f);
  w.highlight = (V)(0.0f);
#endif
  return w;
}

#if VDVR_LIGHT
// The light of the steps that lanes `needed` are in: what is drawn with, from the field at the step's middle.
RAY_INLINE void light_steps(FIELD, BRICKS, VdvrGrid grid, const VdvrRaycast* p, const Ray* ray, Walk* w,
                            I needed) {
  needed &= w->step != w->lit_step;
  if (!ANY(needed)) return;
  const float3 cells_per_length =
      (float3)(p->cells_per_length_x, p->cells_per_length_y, p->cells_per_length_z);
  const V3 c = position_at(ray, grid, middle_of_step(ray, TO_V(w->step) * p->step, (V)(p->step)));
  const OpenBrick around = open_brick(bricks, grid, brick_at(grid, c));
  const Sampled sampled = sample_open(THE_FIELD, &around, grid, c);
  const V3 g = gradient_at(THE_FIELD, bricks, grid, &around, &sampled, c, cells_per_length, needed);
  const V none = (V)(0.0f), one = (V)(1.0f);
  const V highlight = shade(p, v3(none, none, none), g, ray->world, p->gradient_full).x;
  const V white = shade(p, v3(one, one, one), g, ray->world, p->gradient_full).x;
  w->lit = PICK(needed, white - highlight, w->lit);
  w->highlight = PICK(needed, highlight, w->highlight);
  w->lit_step = PICK(needed, w->step, w->lit_step);
}
// The step that t lies in, by the products that steps begin at.
RAY_INLINE I step_at(const VdvrRaycast* p, V t) {
  I k = TO_I(t * p->inverse_step);
  k += PICK(t >= TO_V(k + 1) * p->step, (I)(1), (I)(0));
  return k - PICK(t < TO_V(k) * p->step, (I)(1), (I)(0));
}
#endif

// Passes one cell, or all bricks that are clear. Returns the lanes that have a piece there which may show
// something.
RAY_INLINE I next_piece(FIELD, BRICKS, VdvrGrid grid, __global const uchar* restrict distance,
                        __global const float* restrict bounds, RANGES, const VdvrRaycast* p,
                        const VdvrCertify* q, const Ray* ray, Walk* w, Piece* piece) {
  if (ANY(w->active & NOT(is_inside(&w->brick, w->c)))) {
    const I3 at = brick_at(grid, w->c);
    w->brick = open_brick(bricks, grid, at);
    w->away = TO_I(GATHER(U8, distance, brick_index(grid, at)));
    w->bound = GATHER(V, bounds, brick_index(grid, at));
  }
  Box box = {w->c, w->c, w->c};
  const I leap = w->active & (w->away > 0), here = w->active & (w->away == 0);
  V3 low = w->c, scale = w->c;
  Octet corners;
  I shows = here;
  if (ANY(here)) {
#ifdef VDVR_SAMPLER_IMAGE3D
    Sampled sampled;
    sampled.value = 0.0f;
#else
    const Sampled sampled = sample_open(THE_FIELD, &w->brick, grid, w->c);
    const Octet o = {sampled.s000, sampled.s001, sampled.s010, sampled.s011,
                     sampled.s100, sampled.s101, sampled.s110, sampled.s111};
    corners = o;
#endif
    const CellBox cell = cell_box(grid, &w->brick, &sampled, w->c);
    low = cell.low;
    scale = cell.scale;
    box = box_between(ray, low, v3(low.x + 1.0f / scale.x, low.y + 1.0f / scale.y, low.z + 1.0f / scale.z));
  }
  if (ANY(leap)) {
    const Box around = box_around(ray, w->brick.at, w->away);
    box.low = pick3(leap, around.low, box.low);
    box.high = pick3(leap, around.high, box.high);
    box.far = pick3(leap, around.far, box.far);
  }
  const V in = w->t, far = leaves_box(&box), cut = LEAST(far, ray->length);
  V out = MOST(cut, in);
#if VDVR_LIGHT
  const V step_end = TO_V(w->step + 1) * p->step;
  const I ends_step = here & (step_end < out);
  out = PICK(ends_step, step_end, out);
#else
  const I ends_step = (I)(0);
#endif
  shows &= out > in;
  V e = w->bound;
#ifndef VDVR_SAMPLER_IMAGE3D
  if (ANY(shows)) {
    V least, most;
    octet_range(&corners, &least, &most);
    // What a position's rounding does to the field is its slope in the cell.
    e += q->slack + (most - least) * (q->reach[0] * scale.x + q->reach[1] * scale.y + q->reach[2] * scale.z);
    shows &= NOT(is_clear(THE_RANGES, q, least - e, most + e));
  }
#endif
  if (ANY(shows)) {
    const V3 a = position_at(ray, grid, in), b = position_at(ray, grid, out);
    const Octet f = octet_of_piece(THE_FIELD, &w->brick, grid, corners, low, scale, a, b);
#ifdef VDVR_SAMPLER_IMAGE3D
    V least, most;
    octet_range(&f, &least, &most);
    // The box of the piece may be as thin as its position is uncertain: the cell's own faces tell the slope.
    const Octet whole =
        octet_between(THE_FIELD, &w->brick, grid, low,
                      v3(low.x + 1.0f / scale.x, low.y + 1.0f / scale.y, low.z + 1.0f / scale.z));
    octet_range(&whole, &least, &most);
    e += q->slack + (most - least) * (q->reach[0] * scale.x + q->reach[1] * scale.y + q->reach[2] * scale.z);
#endif
    piece->b0 = f.f000;
    piece->b1 = (f.f100 + f.f010 + f.f001) * (1.0f / 3.0f);
    piece->b2 = (f.f110 + f.f101 + f.f011) * (1.0f / 3.0f);
    piece->b3 = f.f111;
    piece->length = PICK(shows, out - in, (V)(0.0f));
    piece->e = e;
#if VDVR_LIGHT
    light_steps(THE_FIELD, bricks, grid, p, ray, w, shows);
    piece->lit = w->lit;
    piece->highlight = w->highlight;
#endif
  }
  w->t = PICK(w->active, out, w->t);
  V3 behind = w->c;
  const I onward = pass_box(ray, grid, &box, &behind);
  w->c = pick3(ends_step, w->c, behind);
  w->active &= ends_step | onward;
#if VDVR_LIGHT
  w->step = PICK(ends_step, w->step + 1, step_at(p, w->t));
#endif
  return shows;
}

// The least and the largest coefficient of a piece, and the largest step between two.
RAY_INLINE V least_of(const Piece* s) {
  const V a = LEAST(s->b0, s->b1), b = LEAST(s->b2, s->b3);
  return LEAST(a, b);
}
RAY_INLINE V most_of(const Piece* s) {
  const V a = MOST(s->b0, s->b1), b = MOST(s->b2, s->b3);
  return MOST(a, b);
}

RAY_INLINE V steepest(const Piece* s) {
  const V a = fabs(s->b1 - s->b0), b = fabs(s->b2 - s->b1), c = fabs(s->b3 - s->b2), ab = MOST(a, b);
  return MOST(ab, c);
}

// Into how many parts a piece is cut, so that the coefficients of each spread by 2 kappa e at most.
RAY_INLINE I parts_of(const VdvrCertify* q, const Piece* s) {
  const V n = ceil(q->parts_per_spread * steepest(s) / MOST(s->e, (V)(1e-30f)));
  const V most = LEAST(n, (V)((float)VDVR_MOST_PARTS));
  return PICK(s->length > 0.0f, TO_I(MOST(most, (V)(1.0f))), (I)(0));
}

// A piece that is cut into n equal parts: the cubic by powers of the place on it, and a part's share of its
// length.
typedef struct {
  V b0, d1, s1, s3;
  V share, length, e;
} Cut;
RAY_INLINE Cut cut_of(const Piece* s, I n) {
  const V d2 = s->b2 - s->b1, d3 = s->b3 - s->b2;
  Cut c;
  c.b0 = s->b0;
  c.d1 = s->b1 - s->b0;
  c.s1 = d2 - c.d1;
  c.s3 = (d3 - d2) - c.s1;
  const V parts = TO_V(n);
  c.share = 1.0f / MOST(parts, (V)(1.0f));
  c.length = s->length * c.share;
  c.e = s->e + VDVR_CUT_ROUNDING * steepest(s);
  return c;
}
// Where two parts meet: the field, and by how much a coefficient beside it differs.
typedef struct {
  V value, rise;
} Joint;
RAY_INLINE Joint first_joint(const Piece* s, const Cut* c) {
  const Joint j = {s->b0, c->d1 * c->share};
  return j;
}
RAY_INLINE Joint last_joint(const Piece* s, const Cut* c) {
  const Joint j = {s->b3, (s->b3 - s->b2) * c->share};
  return j;
}
// Behind part k.
RAY_INLINE Joint joint_at(const Cut* c, int k) {
  const V t = (float)k * c->share, w = t * c->s3;
  const Joint j = {c->b0 + t * (3.0f * c->d1 + t * (3.0f * c->s1 + w)),
                   (c->d1 + t * (2.0f * c->s1 + w)) * c->share};
  return j;
}
// The coefficients of the part between two.
RAY_INLINE Piece piece_between(Joint front, Joint behind) {
  Piece s;
  s.b0 = front.value;
  s.b1 = front.value + front.rise;
  s.b2 = behind.value - behind.rise;
  s.b3 = behind.value;
  return s;
}
RAY_INLINE Joint pick_joint(I m, Joint a, Joint b) {
  const Joint j = {PICK(m, a.value, b.value), PICK(m, a.rise, b.rise)};
  return j;
}

// A colour under the light of a piece, and the negative of one.
RAY_INLINE V3 lit3(V3 c, V lit, V highlight) {
  return v3(c.x * lit + highlight, c.y * lit + highlight, c.z * lit + highlight);
}
RAY_INLINE Shown light_shown(Shown s, const Piece* piece) {
#if VDVR_LIGHT
  s.c1 = lit3(s.c1, piece->lit, piece->highlight);
  s.minus_c0 = lit3(s.minus_c0, piece->lit, -piece->highlight);
#endif
  return s;
}

#if VDVR_JOINT
// The transfer function where it is kept: at edges of bins, and on either side of its bends.
RAY_INLINE ValueShown value_shown(RANGES, const Piece* piece, I row) {
#define AT_VALUE(n) ranges[LANE(row, n)]
  const V4 at = TURN(AT_VALUE);
#undef AT_VALUE
  ValueShown s = {at.x, v3(at.y, at.z, at.w)};
#if VDVR_LIGHT
  s.c = lit3(s.c, piece->lit, piece->highlight);
#endif
  return s;
}
// Takes in bins in four runs that overlap, each as a box: of bins with too many bends.
RAY_INLINE void add_runs(RANGES, const VdvrCertify* q, const Piece* piece, Part* part, I first, I last,
                         I here, V3 behind, V3 minus_behind) {
  const I count = last - first + 1, k = MOST(30 - AS_I(clz(AS_U(count))), (I)(0)), run = (I)(1) << k;
  const I free = count - run;
  for (int j = 0; j < 4; ++j) {
    const I at = k * q->bins + first + (j * free) / 3;
    const Rows r = {at, at};
    Shown s = light_shown(shown_of(THE_RANGES, r), piece);
    s.t1 = PICK(here, s.t1, (V)(0.0f));
    add_box(q, part, &s, behind, minus_behind);
  }
}
// Takes in all values of bins, stretch by stretch.
RAY_INLINE void add_bins(RANGES, const VdvrCertify* q, const Piece* piece, Part* part, I first, I last,
                         V3 behind, V3 minus_behind) {
  __global const int* bends_before = next_shown + q->bins;
  I bend = GATHER(I, bends_before, first), left = GATHER(I, bends_before, last + 1) - bend;
  const I many = left > VDVR_MOST_BENDS;
  ValueShown from = value_shown(THE_RANGES, piece, q->first_edge + first);
  const ValueShown to = value_shown(THE_RANGES, piece, q->first_edge + last + 1);
  if (ANY(many)) add_runs(THE_RANGES, q, piece, part, first, last, many, behind, minus_behind);
  left = PICK(many, (I)(0), left);
  while (ANY(left > 0)) {
    const I here = left > 0;
    const I row = q->first_bend + 2 * PICK(here, bend, (I)(0));
    add_stretch(q, part, from, pick_value(here, value_shown(THE_RANGES, piece, row), to), behind,
                minus_behind);
    from = pick_value(here, value_shown(THE_RANGES, piece, row + 1), from);
    ++bend;
    --left;
  }
  add_stretch(q, part, from, to, behind, minus_behind);
}
#endif

// The part between two joints, of lanes that are `active`, before colours that are `behind` and minus
// `minus_behind`.
RAY_INLINE Part part_between(RANGES, const VdvrCertify* q, const Piece* whole, const Cut* cut, Joint front,
                             Joint joint, I active, V3 behind, V3 minus_behind) {
  const Piece s = piece_between(front, joint);
  const V from = least_of(&s) - cut->e, to = most_of(&s) + cut->e;
  Part part = new_part(cut->length, active);
#if VDVR_JOINT
  clear_part(&part, (I)(q->or_clear) != 0);
  add_bins(THE_RANGES, q, whole, &part, bin_of(q, from, -VDVR_BIN_MARGIN), bin_of(q, to, VDVR_BIN_MARGIN),
           behind, minus_behind);
#else
  part.all = light_shown(shown_of(THE_RANGES, rows_of(q, from, to)), whole);
#endif
  find_shares(&part);
  return part;
}

RAY_INLINE V3 widened(V3 a, V by) { return v3(a.x + by, a.y + by, a.z + by); }
RAY_INLINE V3 negative3(V3 a) { return v3(-a.x, -a.y, -a.z); }

// Whether a pixel is this launch's.
RAY_INLINE bool in_launch(const VdvrRaycast* p, const VdvrCertify* q, int x, int y) {
  return x < p->width && x < q->first_column + q->columns && y < p->height && y < q->first_row + q->rows;
}

// Every lane's interval of a pixel of this launch: its ends, which may be off by `error`, within
// the extremes of all that can show. [y][x] r, g, b and the parts it took; r, g, b and flags.
RAY_INLINE void put_interval(const VdvrRaycast* p, const VdvrCertify* q, __global float4* restrict least,
                             __global float4* restrict most, I px, I py, V3 upper, V3 minus_lower, V error,
                             V3 c_least, V3 c_most, I parts, I flags) {
  const V once = (V)(q->first_error);
  const V3 hi = least3(widened(upper, error), widened(c_most, once)),
           lo = most3(widened(negative3(minus_lower), -error), widened(c_least, -once));
#define PUT(n)                                                                               \
  if (in_launch(p, q, LANE(px, n), LANE(py, n))) {                                           \
    const ulong i = (ulong)LANE(py, n) * (ulong)p->width + (ulong)LANE(px, n);               \
    least[i] = (float4)(LANE(lo.x, n), LANE(lo.y, n), LANE(lo.z, n), (float)LANE(parts, n)); \
    most[i] = (float4)(LANE(hi.x, n), LANE(hi.y, n), LANE(hi.z, n), (float)LANE(flags, n));  \
  }
  EACH(PUT)
#undef PUT
}

#endif
