// Iso-surfaces, cell by cell: on a ray a trilinear cell is a cubic (Marmitt et al. 2004), whose extrema cut
// it into monotone pieces; a piece whose ends lie on different sides of a surface holds one root, found by
// bisection to fp32. No feature is too thin. Each lane walks its own cells: a parameter t and a point c that
// never steps back. Included by raycast.cl.
#ifndef VDVR_RAYCAST_ISO_H
#define VDVR_RAYCAST_ISO_H

// Bisections of a piece: 2^-20 of a chord, which is as far as fp32 knows the ray's positions.
#define BISECTIONS 20

// How many surfaces a value lies on or above.
RAY_INLINE I side_of(const VdvrRaycast* p, V value) {
  I side = 0;
  for (int i = 0; i < p->surfaces; ++i) side += PICK(value >= p->surface[i].value, (I)(1), (I)(0));
  return side;
}

// The surface of each lane.
typedef struct {
  V3 rgb;
  V value, opacity;
} Surfaces;
RAY_INLINE Surfaces surfaces_at(const VdvrRaycast* p, I number) {
  Surfaces s;
#define CHOOSE(n)                                             \
  {                                                           \
    const int i = clamp(LANE(number, n), 0, p->surfaces - 1); \
    LANE(s.rgb.x, n) = p->surface[i].rgb[0];                  \
    LANE(s.rgb.y, n) = p->surface[i].rgb[1];                  \
    LANE(s.rgb.z, n) = p->surface[i].rgb[2];                  \
    LANE(s.value, n) = p->surface[i].value;                   \
    LANE(s.opacity, n) = p->surface[i].opacity;               \
  }
  EACH(CHOOSE)
#undef CHOOSE
  return s;
}

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

// The field along the diagonal of a box from f000 (s = 0) to f111 (s = 1), and where it turns.
typedef struct {
  V c0, c1, c2, c3;
  V turn, next_turn;  // in order, within [0, 1]; 0 where there is none
} Cubic;

RAY_INLINE V cubic_at(const Cubic* q, V s) { return q->c0 + s * (q->c1 + s * (q->c2 + s * q->c3)); }

RAY_INLINE Cubic cubic_along(const Octet* o) {
  Cubic q;
  const V f = o->f000, one = (V)(1.0f), zero = (V)(0.0f);
  const V first = (o->f001 - f) + (o->f010 - f) + (o->f100 - f);
  const V second = (o->f011 - f) + (o->f101 - f) + (o->f110 - f);
  q.c0 = f;
  q.c1 = first;
  q.c2 = second - 2.0f * first;
  q.c3 = (o->f111 - f) - second + first;
  // Roots of the derivative without cancellation.
  const V a = 3.0f * q.c3, under = q.c2 * q.c2 - a * q.c1;
  const I turns = under > 0.0f;
  const V root = sqrt(PICK(turns, under, zero));
  const V w = -(q.c2 + PICK(q.c2 < 0.0f, -root, root));
  const I has_a = turns & (a != 0.0f), has_w = turns & (w != 0.0f);
  V x = PICK(has_a, w / PICK(has_a, a, one), zero), y = PICK(has_w, q.c1 / PICK(has_w, w, one), zero);
  x = LEAST(x, one);
  y = LEAST(y, one);
  x = MOST(x, zero);
  y = MOST(y, zero);
  q.turn = LEAST(x, y);
  q.next_turn = MOST(x, y);
  return q;
}

// Where a monotone piece [from, to] reaches a value.
RAY_INLINE V cubic_root(const Cubic* q, V from, V to, V value, I up) {
  for (int i = 0; i < BISECTIONS; ++i) {
    const V middle = 0.5f * (from + to);
    const I is_before = (cubic_at(q, middle) >= value) != up;
    from = PICK(is_before, middle, from);
    to = PICK(is_before, to, middle);
  }
  return 0.5f * (from + to);
}

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

// Adds the crossing of surface `number` at parameter `at` in the lanes `crossing`.
RAY_INLINE void add_surface(FIELD, BRICKS, VdvrGrid grid, const VdvrRaycast* p, const Ray* ray, Surfaces s,
                            V at, I crossing, Seen* seen BOUNDS) {
#if VDVR_BOUNDS
  raise_bound(grid, brick_at(grid, position_at(ray, grid, at)), crossing, seen THE_BOUNDS);
#else
  const I first = crossing & (seen->depth < 0.0f);
  seen->depth = PICK(first, (ray->first + at) * p->length_unit, seen->depth);
  if (p->shading || VDVR_GEOMETRY) {
    const float3 cells_per_length =
        (float3)(p->cells_per_length_x, p->cells_per_length_y, p->cells_per_length_z);
    const V3 hit = position_at(ray, grid, at);
    const OpenBrick around = open_brick(bricks, grid, brick_at(grid, hit));
    const Sampled sampled = sample_open(THE_FIELD, &around, grid, hit);
    const V3 g = gradient_at(THE_FIELD, bricks, grid, &around, &sampled, hit, cells_per_length, crossing);
    seen->normal = pick3(first, normal_of(g), seen->normal);
    s.rgb = shade(p, s.rgb, g, ray->world, 0.0f);
  }
#endif
  const V weight = PICK(crossing, (1.0f - seen->alpha) * s.opacity, (V)(0.0f));
  seen->colour = plus(seen->colour, scaled(s.rgb, weight));
  seen->alpha += weight;
}

// The surfaces that a cubic over [in, out] meets, front to back, in the lanes `possible`; `was` is on how
// many the field lies before it, and after.
RAY_INLINE void meet_surfaces(FIELD, BRICKS, VdvrGrid grid, const VdvrRaycast* p, const Ray* ray,
                              const Cubic* cubic, V in, V out, I possible, I* was, Seen* seen BOUNDS) {
  V from = (V)(0.0f);
  for (int piece = 0; piece < 4; ++piece) {
    const V to = piece == 0   ? (V)(0.0f)
                 : piece == 1 ? cubic->turn
                 : piece == 2 ? cubic->next_turn
                              : (V)(1.0f);
    const V value = cubic_at(cubic, to);
    I side = side_of(p, value);
    if (piece == 0) {
      // Cells agree on their faces to rounding: a surface within it was met before, or will be.
      const I least = side_of(p, value - p->slack), most = side_of(p, value + p->slack);
      const I raised = MOST(*was, least);
      side = LEAST(raised, most);
    }
    while (1) {
      const I crossing = possible & (*was != side) & (seen->alpha < p->termination);
      if (!ANY(crossing)) break;
      const I rises = side > *was;
      const Surfaces s = surfaces_at(p, PICK(rises, *was, *was - 1));
      const V root = cubic_root(cubic, from, to, s.value, rises);
      add_surface(THE_FIELD, bricks, grid, p, ray, s, in + root * (out - in), crossing, seen THE_BOUNDS);
      *was = PICK(crossing, PICK(rises, *was + 1, *was - 1), *was);
    }
    *was = PICK(possible, side, *was);
    from = to;
  }
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

// Meets the surfaces in the cells at c, which `sampled` was taken from. Returns the cells.
RAY_INLINE Box pass_cells(FIELD, BRICKS, VdvrGrid grid, const VdvrRaycast* p, const Ray* ray,
                          const OpenBrick* brick, const Sampled* sampled, V3 c, I active, I* was,
                          Seen* seen BOUNDS) {
  const CellBox cell = cell_box(grid, brick, sampled, c);
  const V3 low = cell.low;
  const Box box = box_between(
      ray, low, v3(low.x + 1.0f / cell.scale.x, low.y + 1.0f / cell.scale.y, low.z + 1.0f / cell.scale.z));
#ifdef VDVR_SAMPLER_IMAGE3D
  const I worth = active;
#else
  Octet octet = {sampled->s000, sampled->s001, sampled->s010, sampled->s011,
                 sampled->s100, sampled->s101, sampled->s110, sampled->s111};
  V lo, hi;
  octet_range(&octet, &lo, &hi);
  const I worth = active & ((side_of(p, lo - p->slack) != *was) | (side_of(p, hi + p->slack) != *was));
#endif
  if (!ANY(worth)) return box;
  const V in = enters_box(ray, &box), far = leaves_box(&box), cut = LEAST(far, ray->length),
          out = MOST(cut, in);
  const V3 a = position_at(ray, grid, in), b = position_at(ray, grid, out);
#ifdef VDVR_SAMPLER_IMAGE3D
  const Octet octet = octet_between(THE_FIELD, brick, grid, a, b);
#else
  octet = octet_within(octet,
                       v3(fraction_of(a.x, low.x, cell.scale.x), fraction_of(a.y, low.y, cell.scale.y),
                          fraction_of(a.z, low.z, cell.scale.z)),
                       v3(fraction_of(b.x, low.x, cell.scale.x), fraction_of(b.y, low.y, cell.scale.y),
                          fraction_of(b.z, low.z, cell.scale.z)));
#endif
  const Cubic cubic = cubic_along(&octet);
  meet_surfaces(THE_FIELD, bricks, grid, p, ray, &cubic, in, out, worth, was, seen THE_BOUNDS);
  return box;
}

// Crossings of surfaces, front to back. A lane knows on which side of the surfaces it is; cells on that side
// alone are passed. Bricks all on one side are leapt over together with the neighbours that are on the same
// (`distance`); a jump of the field at a brick's face is a crossing there. Geometry: of the first.
__kernel VDVR_HINT void raycast_iso(FIELD, BRICKS, VdvrGrid grid, __global const uchar* restrict distance,
                                    __global const float4* restrict table, VdvrRaycast p,
                                    __global float4* restrict picture,
                                    __global uint* restrict row_samples BOUNDS) {
  THE_PIXELS;
  Seen seen = nothing_seen((V)(-1.0f));
  const Ray ray = cast_rays(&p, grid, px, py);
  const I3 up = {ray.inverse.x > 0.0f, ray.inverse.y > 0.0f, ray.inverse.z > 0.0f};
  I active = ends_of(&p, &ray, px, py, (V)(1.0f)) > 0, samples = 0, was = 0, away = 0;
  V3 c = ray.entry;
  OpenBrick brick = no_brick();
  int starts = 1;
  while (ANY(active)) {
    if (ANY(active & NOT(is_inside(&brick, c)))) {
      brick = open_brick(bricks, grid, brick_at(grid, c));
      if (p.skip) away = TO_I(GATHER(U8, distance, brick_index(grid, brick.at)));
    }
    const Sampled sampled = sample_open(THE_FIELD, &brick, grid, c);
    samples += PICK(active, (I)(1), (I)(0));
    const I here = side_of(&p, sampled.value);
    if (starts) was = here;
    starts = 0;
    Box box = {c, c, c};
    if (ANY(active & ((away == 0) | (here != was))))
      box =
          pass_cells(THE_FIELD, bricks, grid, &p, &ray, &brick, &sampled, c, active, &was, &seen THE_BOUNDS);
    const I leap = active & (away > 0);
    if (ANY(leap)) {
      const Box around = box_around(&ray, brick.at, away);
      box.low = pick3(leap, around.low, box.low);
      box.high = pick3(leap, around.high, box.high);
      box.far = pick3(leap, around.far, box.far);
    }
    const V step = leaves_box(&box), within = LEAST(step, ray.length);
    const V3 reached = position_at(&ray, grid, MOST(within, (V)(0.0f)));
    const I3 by = {box.far.x <= step, box.far.y <= step, box.far.z <= step};
    const I outside = (by.x & PICK(up.x, (I)(box.high.x >= (float)grid.cells_x), (I)(box.low.x <= 0.0f))) |
                      (by.y & PICK(up.y, (I)(box.high.y >= (float)grid.cells_y), (I)(box.low.y <= 0.0f))) |
                      (by.z & PICK(up.z, (I)(box.high.z >= (float)grid.cells_z), (I)(box.low.z <= 0.0f)));
    c = v3(beyond(by.x, up.x, box.low.x, box.high.x, c.x, reached.x),
           beyond(by.y, up.y, box.low.y, box.high.y, c.y, reached.y),
           beyond(by.z, up.z, box.low.z, box.high.z, c.z, reached.z));
    active &= (step < ray.length) & NOT(outside) & (seen.alpha < p.termination);
  }
  put_seen(&p, picture, row_samples, px, py, &seen, seen.depth, samples);
}

#endif
