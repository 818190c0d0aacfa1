// Line integrals, cell by cell: on a ray a trilinear cell is a cubic, and its mean over a piece is that of
// its four Bernstein coefficients, so that no step is taken and rounding alone is left. Each lane walks its
// own cells. Included by raycast.cl.
#ifndef VDVR_RAYCAST_INTEGRAL_H
#define VDVR_RAYCAST_INTEGRAL_H
#include "device/ray_cells.h"

// The mean of the field on the piece [in, out] of rays through the cells at c, which it returns the box of.
RAY_INLINE Box mean_of_piece(FIELD, VdvrGrid grid, const Ray* ray, const OpenBrick* brick, V3 c, V in, V* out,
                             V* mean) {
  Octet corners;
#ifdef VDVR_SAMPLER_IMAGE3D
  Sampled sampled;
  sampled.value = 0.0f;
#else
  const Sampled sampled = sample_open(THE_FIELD, brick, grid, c);
  const Octet own = {sampled.s000, sampled.s001, sampled.s010, sampled.s011,
                     sampled.s100, sampled.s101, sampled.s110, sampled.s111};
  corners = own;
#endif
  const CellBox cell = cell_box(grid, brick, &sampled, c);
  const V3 low = cell.low;
  const Box box = box_between(
      ray, low, v3(low.x + 1.0f / cell.scale.x, low.y + 1.0f / cell.scale.y, low.z + 1.0f / cell.scale.z));
  const V far = leaves_box(&box), cut = LEAST(far, ray->length);
  *out = MOST(cut, in);
  const V3 a = position_at(ray, grid, in), b = position_at(ray, grid, *out);
  const Octet f = octet_of_piece(THE_FIELD, brick, grid, corners, low, cell.scale, a, b);
  const V inner = (f.f100 + f.f010 + f.f001) + (f.f110 + f.f101 + f.f011);
  *mean = 0.25f * (f.f000 + f.f111) + (1.0f / 12.0f) * inner;
  return box;
}

// The integral of the field along each ray, density times world unit; 0 where it meets nothing. Its grey is
// made on the host, where the window is known. Pieces join at the parameters that cells are left by, so that
// their lengths add up to the ray's; what a sum loses is carried along (Kahan), so that long rays lose no
// more than short ones.
__kernel VDVR_HINT void raycast_integral(FIELD, BRICKS, VdvrGrid grid, __global const float2* restrict ranges,
                                         __global const float4* restrict table, VdvrRaycast p,
                                         __global float4* restrict picture,
                                         __global uint* restrict row_samples BOUNDS) {
  THE_PIXELS;
  const Ray ray = cast_rays(&p, grid, px, py);
  I active = ends_of(&p, &ray, px, py, (V)(1.0f)) > 0, samples = 0;
  V sum = (V)(0.0f), lost = sum, t = sum;
  V3 c = ray.entry;
  OpenBrick brick = no_brick();
  while (ANY(active)) {
    if (ANY(active & NOT(is_inside(&brick, c)))) brick = open_brick(bricks, grid, brick_at(grid, c));
    V out, mean;
    const Box box = mean_of_piece(THE_FIELD, grid, &ray, &brick, c, t, &out, &mean);
    const V added = mean * (out - t) - lost, more = sum + added;
    lost = PICK(active, (more - sum) - added, lost);
    sum = PICK(active, more, sum);
    samples += PICK(active, (I)(1), (I)(0));
    t = PICK(active, out, t);
    active &= pass_box(&ray, grid, &box, &c);
  }
  const V none = (V)(0.0f);
  put(p.width, p.height, picture, row_samples, px, py, v3(none, none, none), sum * p.length_unit, samples);
}

#endif
