// Rays cell by cell: the boxes of cells and bricks that rays pass, and the field at the corners of the box
// that a piece of a ray spans. Each lane walks its own cells: a parameter t and a point c that never steps
// back. Included by raycast_iso.h, raycast_integral.h and certify_ray.h.
#ifndef VDVR_RAY_CELLS_H
#define VDVR_RAY_CELLS_H

// The field at the corners of a box, f<z><y><x>.
typedef struct {
  V f000, f001, f010, f011, f100, f101, f110, f111;
} Octet;

RAY_INLINE void octet_range(const Octet* o, V* lo, V* hi) {
  const V a = LEAST(o->f000, o->f001), b = LEAST(o->f010, o->f011), c = LEAST(o->f100, o->f101),
          d = LEAST(o->f110, o->f111), ab = LEAST(a, b), cd = LEAST(c, d);
  const V e = MOST(o->f000, o->f001), f = MOST(o->f010, o->f011), g = MOST(o->f100, o->f101),
          h = MOST(o->f110, o->f111), ef = MOST(e, f), gh = MOST(g, h);
  *lo = LEAST(ab, cd);
  *hi = MOST(ef, gh);
}

#ifdef VDVR_SAMPLER_IMAGE3D
// Of the box that points a and b of one cell span.
RAY_INLINE Octet octet_between(FIELD, const OpenBrick* brick, VdvrGrid grid, V3 a, V3 b) {
#define AT(X, Y, Z) sample_open(THE_FIELD, brick, grid, v3(X, Y, Z)).value
  const Octet o = {AT(a.x, a.y, a.z), AT(b.x, a.y, a.z), AT(a.x, b.y, a.z), AT(b.x, b.y, a.z),
                   AT(a.x, a.y, b.z), AT(b.x, a.y, b.z), AT(a.x, b.y, b.z), AT(b.x, b.y, b.z)};
#undef AT
  return o;
}
#else
// Of the box that fractions a and b of a cell span, by the cell's own corners.
RAY_INLINE Octet octet_within(Octet o, V3 a, V3 b) {
#define ALONG(FROM, TO, A, B)                                          \
  {                                                                    \
    const V low = lerp(o.FROM, o.TO, A), high = lerp(o.FROM, o.TO, B); \
    o.FROM = low;                                                      \
    o.TO = high;                                                       \
  }
  ALONG(f000, f001, a.x, b.x)
  ALONG(f010, f011, a.x, b.x)
  ALONG(f100, f101, a.x, b.x)
  ALONG(f110, f111, a.x, b.x)
  ALONG(f000, f010, a.y, b.y)
  ALONG(f001, f011, a.y, b.y)
  ALONG(f100, f110, a.y, b.y)
  ALONG(f101, f111, a.y, b.y)
  ALONG(f000, f100, a.z, b.z)
  ALONG(f001, f101, a.z, b.z)
  ALONG(f010, f110, a.z, b.z)
  ALONG(f011, f111, a.z, b.z)
#undef ALONG
  return o;
}
#endif

// One axis of a box that a ray passes, by its faces low and high.
RAY_INLINE V enters(V low, V high, V entry, V inverse) {
  const V a = (low - entry) * inverse, b = (high - entry) * inverse;
  return LEAST(a, b);
}
RAY_INLINE V leaves(V low, V high, V entry, V inverse) {
  const V a = (low - entry) * inverse, b = (high - entry) * inverse;
  return MOST(a, b);
}

// The coordinate of the next cell: beyond the face that the ray leaves by, else no less far than before.
RAY_INLINE V beyond(I by_this, I up, V low, V high, V before, V reached) {
  const V further = PICK(up, MOST(before, reached), LEAST(before, reached));
  // The largest number below a face belongs to the cell before it.
  const V below = PACKET(as_float)(PACKET(as_int)(low) - 1);
  return PICK(by_this, PICK(up, high, PICK(low > 0.0f, below, (V)(0.0f))), further);
}

RAY_INLINE V fraction_of(V c, V low, V scale) {
  V f = (c - low) * scale;
  f = LEAST(f, (V)(1.0f));
  return MOST(f, (V)(0.0f));
}

// A box of cells, and where rays leave it along each axis.
typedef struct {
  V3 low, high, far;
} Box;
RAY_INLINE Box box_between(const Ray* ray, V3 low, V3 high) {
  Box b;
  b.low = low;
  b.high = high;
  b.far = v3(leaves(low.x, high.x, ray->entry.x, ray->inverse.x),
             leaves(low.y, high.y, ray->entry.y, ray->inverse.y),
             leaves(low.z, high.z, ray->entry.z, ray->inverse.z));
  return b;
}
RAY_INLINE V enters_box(const Ray* ray, const Box* b) {
  const V x = enters(b->low.x, b->high.x, ray->entry.x, ray->inverse.x);
  const V y = enters(b->low.y, b->high.y, ray->entry.y, ray->inverse.y);
  const V z = enters(b->low.z, b->high.z, ray->entry.z, ray->inverse.z);
  const V xy = MOST(x, y), xyz = MOST(xy, z);
  return MOST(xyz, (V)(0.0f));
}
RAY_INLINE V leaves_box(const Box* b) {
  const V xy = LEAST(b->far.x, b->far.y);
  return LEAST(xy, b->far.z);
}
// The bricks that lie on the same side as those at `at`.
RAY_INLINE Box box_around(const Ray* ray, I3 at, I away) {
  const I less = away - 1;
  return box_between(ray,
                     v3(TO_V((at.x - less) * VDVR_GRANULARITY), TO_V((at.y - less) * VDVR_GRANULARITY),
                        TO_V((at.z - less) * VDVR_GRANULARITY)),
                     v3(TO_V((at.x + away) * VDVR_GRANULARITY), TO_V((at.y + away) * VDVR_GRANULARITY),
                        TO_V((at.z + away) * VDVR_GRANULARITY)));
}

// The field at the corners of the boxes that points a and b of the cells that begin at `low` span; `corners`
// are the cells' own, which the texture unit does not read.
RAY_INLINE Octet octet_of_piece(FIELD, const OpenBrick* brick, VdvrGrid grid, Octet corners, V3 low, V3 scale,
                                V3 a, V3 b) {
#ifdef VDVR_SAMPLER_IMAGE3D
  return octet_between(THE_FIELD, brick, grid, a, b);
#else
  return octet_within(corners,
                      v3(fraction_of(a.x, low.x, scale.x), fraction_of(a.y, low.y, scale.y),
                         fraction_of(a.z, low.z, scale.z)),
                      v3(fraction_of(b.x, low.x, scale.x), fraction_of(b.y, low.y, scale.y),
                         fraction_of(b.z, low.z, scale.z)));
#endif
}

// Moves c into the cells behind `box`, the cells or bricks that it lies in. Returns which lanes are still on
// their ray.
RAY_INLINE I pass_box(const Ray* ray, VdvrGrid grid, const Box* box, V3* c) {
  const I3 up = {ray->inverse.x > 0.0f, ray->inverse.y > 0.0f, ray->inverse.z > 0.0f};
  const V step = leaves_box(box), within = LEAST(step, ray->length);
  const V3 reached = position_at(ray, grid, MOST(within, (V)(0.0f)));
  const I3 by = {box->far.x <= step, box->far.y <= step, box->far.z <= step};
  const I outside = (by.x & PICK(up.x, (I)(box->high.x >= (float)grid.cells_x), (I)(box->low.x <= 0.0f))) |
                    (by.y & PICK(up.y, (I)(box->high.y >= (float)grid.cells_y), (I)(box->low.y <= 0.0f))) |
                    (by.z & PICK(up.z, (I)(box->high.z >= (float)grid.cells_z), (I)(box->low.z <= 0.0f)));
  *c = v3(beyond(by.x, up.x, box->low.x, box->high.x, c->x, reached.x),
          beyond(by.y, up.y, box->low.y, box->high.y, c->y, reached.y),
          beyond(by.z, up.z, box->low.z, box->high.z, c->z, reached.z));
  return (step < ray->length) & NOT(outside);
}

#endif
