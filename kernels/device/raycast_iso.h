// Iso-surfaces, cell by cell: on a ray a trilinear cell is a cubic (Marmitt et al. 2004), whose extrema cut
// it into monotone pieces; a piece whose ends lie on different sides of a surface holds one root, found by
// bisection to fp32. No feature is too thin. Each lane walks its own cells: a parameter t and a point c that
// never steps back. Included by raycast.cl.
#ifndef VDVR_RAYCAST_ISO_H
#define VDVR_RAYCAST_ISO_H
#include "device/ray_cells.h"

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

// Meets the surfaces in the cells at c, which `sampled` was taken from. Returns the cells.
RAY_INLINE Box pass_cells(FIELD, BRICKS, VdvrGrid grid, const VdvrRaycast* p, const Ray* ray,
                          const OpenBrick* brick, const Sampled* sampled, V3 c, I active, I* was,
                          Seen* seen BOUNDS) {
  const CellBox cell = cell_box(grid, brick, sampled, c);
  const V3 low = cell.low;
  const Box box = box_between(
      ray, low, v3(low.x + 1.0f / cell.scale.x, low.y + 1.0f / cell.scale.y, low.z + 1.0f / cell.scale.z));
#ifdef VDVR_SAMPLER_IMAGE3D
  Octet octet = {(V)(0.0f)};  // the texture unit is asked, not these
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
  octet = octet_of_piece(THE_FIELD, brick, grid, octet, low, cell.scale, a, b);
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
    active &= pass_box(&ray, grid, &box, &c) & (seen.alpha < p.termination);
  }
  put_seen(&p, picture, row_samples, px, py, &seen, seen.depth, samples);
}

#endif
