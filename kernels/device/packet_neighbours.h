// The field of packet_sampler.h half a cell of the grid before and behind a sampled point, along each axis:
// what packet_gradient.h makes gradients of. Included by packet_sampler.h.
#ifndef VDVR_PACKET_NEIGHBOURS_H
#define VDVR_PACKET_NEIGHBOURS_H

#ifdef VDVR_SAMPLER_IMAGE3D
RAY_INLINE V at_point(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, V x, V y, V z) {
  const V3 c = v3(x, y, z);
  return is_inside(b, c) ? sample_open(THE_FIELD, b, grid, c).value
                         : sample_anywhere(THE_FIELD, bricks, grid, c).value;
}
#else

// The field in a face of cells with lowest sample i, by fractions along the two axes that it runs along.
RAY_INLINE V in_face(FIELD, const Cell* c, Place i, Place u, V fu, Place v, V fv) {
  const Place iv = after(i, v);
  return lerp(lerp(load(field, c, i), load(field, c, after(i, u)), fu),
              lerp(load(field, c, iv), load(field, c, after(iv, u)), fu), fv);
}
// The same where the first of them is x.
RAY_INLINE V in_face_along_x(FIELD, const Cell* c, Place i, V fx, Place v, V fv) {
  const Pair p = load_pair(field, c, i), q = load_pair(field, c, after(i, v));
  return lerp(lerp(p.at, p.next, fx), lerp(q.at, q.next, fx), fv);
}

RAY_INLINE V face_at(FIELD, const Cell* c, Place i, int along_x, Place u, V fu, Place v, V fv) {
  return along_x ? in_face_along_x(field, c, i, fu, v, fv) : in_face(field, c, i, u, fu, v, fv);
}

// How one axis' two points lie: cells of samples away from the sampled one's, and the fractions there. Half a
// base cell is a whole number of samples where a cell has several, else half a spacing or less: `half_cell`.
typedef struct {
  I back, ahead;
  V behind, before;
} Spread;
RAY_INLINE Spread spread_of(I reach, V t, V half_cell) {
  Spread s;
  const I whole = reach != 0;
  const V lo = t - half_cell, hi = t + half_cell;
  s.back = PICK(whole, -reach, PICK(lo < 0.0f, (I)(-1), (I)(0)));
  s.ahead = PICK(whole, reach, PICK(hi < 1.0f, (I)(0), (I)(1)));
  s.behind = PICK(whole, t, lo - TO_V(s.back));
  s.before = PICK(whole, t, hi - TO_V(s.ahead));
  return s;
}

// The field at two points.
typedef struct {
  V lo, hi;
} Ends;

// The field half a cell of the grid before and behind the sampled point along one axis, w its stride; a, b
// are the field in the faces across it of the sampled cell. Beyond first and last, where the grid ends, the
// outermost face counts.
RAY_INLINE Ends ends_along(FIELD, const Cell* c, V a, V b, I reach, I index, V t, V half_cell, I first,
                           I last, Offset w, int along_x, Place u, V fu, Place v, V fv) {
  const Spread s = spread_of(reach, t, half_cell);
#define FACE(n)                                                                                              \
  face_at(field, c,                                                                                          \
          after(c->lowest, place(TO_OFFSET(LEAST(MOST(index + (n), first), last) - index) * w, 0)), along_x, \
          u, fu, v, fv)
  const V outer = FACE(s.back), outermost = FACE(s.ahead + 1);
  V inner, nearer;
  if (ANY(reach > 1)) {
    inner = FACE(s.back + 1);
    nearer = FACE(s.ahead);
  } else {
    inner = PICK(s.back < 0, a, b);
    nearer = PICK(s.ahead > 0, b, a);
  }
#undef FACE
  const Ends e = {lerp(outer, inner, s.behind), lerp(nearer, outermost, s.before)};
  return e;
}

typedef struct {
  Ends x, y, z;
} Neighbours;

// The same along every axis. Right where the points lie in what the bricks reach.
RAY_INLINE Neighbours neighbours_within(FIELD, VdvrGrid grid, const OpenBrick* b, const Sampled* k) {
  const Cell* c = &k->cell;
  const V3 t = c->fraction;
#if VDVR_UNIFORM
  const I3 reach = {(I)(0), (I)(0), (I)(0)}, first = reach;
  const I3 last = {(I)(grid.cells_x), (I)(grid.cells_y), (I)(grid.cells_z)};
  const V3 half_cell = v3((V)(0.5f), (V)(0.5f), (V)(0.5f));
  const Offset wy = (Offset)(c->y.all), wz = (Offset)(c->z.all);
#else
  const I3 reach = b->reach, first = b->first, last = b->last;
  const V3 half_cell = v3(0.5f * b->scale.x, 0.5f * b->scale.y, 0.5f * b->scale.z);
  const Offset wy = b->stride_y, wz = b->stride_z;
#endif
  Neighbours n;
  n.x = ends_along(field, c, lerp(lerp(k->s000, k->s010, t.y), lerp(k->s100, k->s110, t.y), t.z),
                   lerp(lerp(k->s001, k->s011, t.y), lerp(k->s101, k->s111, t.y), t.z), reach.x, c->index.x,
                   t.x, half_cell.x, first.x, last.x, (Offset)(1), 0, c->y, t.y, c->z, t.z);
  // Along y and z the edges along x are shared.
  const V e00 = lerp(k->s000, k->s001, t.x), e01 = lerp(k->s010, k->s011, t.x);
  const V e10 = lerp(k->s100, k->s101, t.x), e11 = lerp(k->s110, k->s111, t.x);
  n.y = ends_along(field, c, lerp(e00, e10, t.z), lerp(e01, e11, t.z), reach.y, c->index.y, t.y, half_cell.y,
                   first.y, last.y, wy, 1, c->x, t.x, c->z, t.z);
  n.z = ends_along(field, c, lerp(e00, e01, t.y), lerp(e10, e11, t.y), reach.z, c->index.z, t.z, half_cell.z,
                   first.z, last.z, wz, 1, c->x, t.x, c->y, t.y);
  return n;
}

#if !VDVR_UNIFORM
// Samples the points that lie beyond what the bricks reach, one a lane and round: most lanes have none or
// one.
RAY_INLINE void sample_beyond(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, V3 c, V3 lo, V3 hi, I needed,
                              Neighbours* n) {
  const I none = (I)(0);
  I left = PICK(lo.x < b->low.x, (I)(1), none) | PICK(hi.x > b->high.x, (I)(2), none) |
           PICK(lo.y < b->low.y, (I)(4), none) | PICK(hi.y > b->high.y, (I)(8), none) |
           PICK(lo.z < b->low.z, (I)(16), none) | PICK(hi.z > b->high.z, (I)(32), none);
  left = PICK(needed & NOT(b->base_around), left, none);
  while (ANY(left != 0)) {
    const I now = left & -left;
    const V3 point =
        v3(PICK(now == 1, lo.x, PICK(now == 2, hi.x, c.x)), PICK(now == 4, lo.y, PICK(now == 8, hi.y, c.y)),
           PICK(now == 16, lo.z, PICK(now == 32, hi.z, c.z)));
    const V value = sample_anywhere(field, bricks, grid, point).value;
    n->x.lo = PICK(now == 1, value, n->x.lo);
    n->x.hi = PICK(now == 2, value, n->x.hi);
    n->y.lo = PICK(now == 4, value, n->y.lo);
    n->y.hi = PICK(now == 8, value, n->y.hi);
    n->z.lo = PICK(now == 16, value, n->z.lo);
    n->z.hi = PICK(now == 32, value, n->z.hi);
    left &= left - 1;
  }
}
#endif

#endif

#endif
