// The gradient of the field at points of a packet: what stands beside the samples (VDVR_LIT), the derivative
// of the cell (VDVR_GRADIENT_ANALYTIC), or central differences over one base cell. Included by
// packet_sampler.h.
#ifndef VDVR_PACKET_GRADIENT_H
#define VDVR_PACKET_GRADIENT_H

// The boxes of the cells of samples that points c of these bricks lie in: lowest corner, and samples per cell
// of the base.
typedef struct {
  V3 low, scale;
} CellBox;
#if defined(VDVR_SAMPLER_IMAGE3D)
RAY_INLINE float cell_low(float c, int b, uint level, int cells, int coarse) {
  const VdvrLocal l = vdvr_local(c, b, level, VDVR_GRANULARITY, cells, coarse);
  return (float)(b * VDVR_GRANULARITY) + (float)l.index / vdvr_per_cell(level, coarse);
}
#endif
RAY_INLINE CellBox cell_box(VdvrGrid grid, const OpenBrick* b, const Sampled* k, V3 c) {
  CellBox box;
#ifdef VDVR_SAMPLER_IMAGE3D
  const VdvrBrick* r = &b->record;
  box.scale = v3(vdvr_per_cell(r->level_x, VDVR_COARSE_X), vdvr_per_cell(r->level_y, VDVR_COARSE_Y),
                 vdvr_per_cell(r->level_z, VDVR_COARSE_Z));
  box.low = v3(cell_low(c.x, b->at.x, r->level_x, grid.cells_x, VDVR_COARSE_X),
               cell_low(c.y, b->at.y, r->level_y, grid.cells_y, VDVR_COARSE_Y),
               cell_low(c.z, b->at.z, r->level_z, grid.cells_z, VDVR_COARSE_Z));
#elif VDVR_UNIFORM
  const I3 i = k->cell.index;
  box.scale = v3((V)(1.0f), (V)(1.0f), (V)(1.0f));
  box.low = v3(TO_V(i.x), TO_V(i.y), TO_V(i.z));
#else
  const I3 i = k->cell.index;
  box.scale = b->scale;
  box.low = v3(b->low.x + TO_V(i.x) / b->scale.x, b->low.y + TO_V(i.y) / b->scale.y,
               b->low.z + TO_V(i.z) / b->scale.z);
#endif
  return box;
}

#if VDVR_LIT
// Light is not certified: one rounding less where the device has it.
RAY_INLINE V between(V a, V b, V t) {
#ifdef FP_FAST_FMAF
  return fma(t, b - a, a);
#else
  return a + t * (b - a);
#endif
}

// Density per length along the world axes: what stands at the corners of the cell, interpolated as the field
// is. Read here and not with the values: most samples are not lit. The grid's step is the gradients' here.
RAY_INLINE V3 gradient_at(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, const Sampled* k, V3 c,
                          float3 cells_per_length, I needed) {
  const V3 f = k->cell.fraction;
  const Planes w =
      planes_of((__global const float*)field + 2 * (ulong)grid.lit_samples, k);  // bits of floats
#define OF(AXIS, g) TO_V(AXIS(AS_I(w.g)))
#define BLEND(AXIS)                                                       \
  between(between(between(OF(AXIS, low.x), OF(AXIS, low.z), f.x),         \
                  between(OF(AXIS, low.y), OF(AXIS, low.w), f.x), f.y),   \
          between(between(OF(AXIS, high.x), OF(AXIS, high.z), f.x),       \
                  between(OF(AXIS, high.y), OF(AXIS, high.w), f.x), f.y), \
          f.z)
  const V3 g = v3(BLEND(LIT_X), BLEND(LIT_Y), BLEND(LIT_Z));
#undef BLEND
#undef OF
  return v3(g.x * grid.step, g.y * grid.step, g.z * grid.step);
}
#elif VDVR_GRADIENT_ANALYTIC
// Density per length along the world axes: the derivative of the trilinear cell that the point lies in. Jumps
// from cell to cell.
RAY_INLINE V3 gradient_at(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, const Sampled* k, V3 c,
                          float3 cells_per_length, I needed) {
  const CellBox box = cell_box(grid, b, k, c);
#ifdef VDVR_SAMPLER_IMAGE3D
  // Along an axis the cell is linear: its two faces tell.
  const V3 lo = box.low;
  const V3 hi = v3(lo.x + 1.0f / box.scale.x, lo.y + 1.0f / box.scale.y, lo.z + 1.0f / box.scale.z);
#define AT(X, Y, Z) sample_open(THE_FIELD, b, grid, v3(X, Y, Z)).value
  const V3 d = v3(AT(hi.x, c.y, c.z) - AT(lo.x, c.y, c.z), AT(c.x, hi.y, c.z) - AT(c.x, lo.y, c.z),
                  AT(c.x, c.y, hi.z) - AT(c.x, c.y, lo.z));
#undef AT
#else
  const V3 f = k->cell.fraction;
  const V3 d = v3(lerp(lerp(k->s001 - k->s000, k->s011 - k->s010, f.y),
                       lerp(k->s101 - k->s100, k->s111 - k->s110, f.y), f.z),
                  lerp(lerp(k->s010 - k->s000, k->s011 - k->s001, f.x),
                       lerp(k->s110 - k->s100, k->s111 - k->s101, f.x), f.z),
                  lerp(lerp(k->s100 - k->s000, k->s101 - k->s001, f.x),
                       lerp(k->s110 - k->s010, k->s111 - k->s011, f.x), f.y));
#endif
  return v3(d.x * box.scale.x * cells_per_length.x, d.y * box.scale.y * cells_per_length.y,
            d.z * box.scale.z * cells_per_length.z);
}
#else
// Density per length along the world axes by central differences that reach half a base cell to each side,
// whatever the level: one operator for the whole volume, so that shading has no seam where levels meet.
// One-sided at the grid's faces, where the reach is cut. `k` was sampled at c; lanes outside `needed` get any
// value.
RAY_INLINE V3 gradient_at(FIELD, BRICKS, VdvrGrid grid, const OpenBrick* b, const Sampled* k, V3 c,
                          float3 cells_per_length, I needed) {
  const V3 lo = v3(MOST(c.x - GRADIENT_REACH, (V)(0.0f)), MOST(c.y - GRADIENT_REACH, (V)(0.0f)),
                   MOST(c.z - GRADIENT_REACH, (V)(0.0f)));
  const V3 hi = v3(LEAST(c.x + GRADIENT_REACH, (V)((float)grid.cells_x)),
                   LEAST(c.y + GRADIENT_REACH, (V)((float)grid.cells_y)),
                   LEAST(c.z + GRADIENT_REACH, (V)((float)grid.cells_z)));
#ifdef VDVR_SAMPLER_IMAGE3D
  const V3 d = v3(at_point(THE_FIELD, bricks, grid, b, hi.x, c.y, c.z) -
                      at_point(THE_FIELD, bricks, grid, b, lo.x, c.y, c.z),
                  at_point(THE_FIELD, bricks, grid, b, c.x, hi.y, c.z) -
                      at_point(THE_FIELD, bricks, grid, b, c.x, lo.y, c.z),
                  at_point(THE_FIELD, bricks, grid, b, c.x, c.y, hi.z) -
                      at_point(THE_FIELD, bricks, grid, b, c.x, c.y, lo.z));
#else
  Neighbours n = neighbours_within(field, grid, b, k);
#if !VDVR_UNIFORM
  sample_beyond(field, bricks, grid, b, c, lo, hi, needed, &n);
#endif
  const V3 d = v3(n.x.hi - n.x.lo, n.y.hi - n.y.lo, n.z.hi - n.z.lo);
#endif
  return v3(d.x / (hi.x - lo.x) * cells_per_length.x, d.y / (hi.y - lo.y) * cells_per_length.y,
            d.z / (hi.z - lo.z) * cells_per_length.z);
}
#endif

#endif
