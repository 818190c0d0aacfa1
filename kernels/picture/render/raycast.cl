// Ray-casting of the mixed-resolution field: emission-absorption (dvr), iso-surfaces (iso), maximum (mip),
// line integral (integral), slice. One source for both samplers and for packets of 1 to 16 rays per work-item
// (device/packet.h).
//
// Sample positions are global along a ray, t_k = t_entry + (k + 1/2) step, the last in the middle of the path
// that is left. Each belongs to the brick that vdvr_brick_of names; bricks decide what is skipped and which
// record is open, never where a sample lies. The rays of a packet share k; each counts from its own entry. So
// neither skipping nor packets change a bit.
//
// Layouts: bricks[bz][by][bx], distance[bz][by][bx] (bricks to the nearest one of another class, 0 where
// worth sampling), ranges[bz][by][bx], table[table_size] (rgb, opacity of one step; then the opacities
// alone), picture[y][x] (r, g, b, alpha | depth | maximum |
// integral; with VDVR_GEOMETRY normal, depth | bound). Called
// by raycast() in host/picture/render/raycast.cpp.
#ifndef VDVR_GRANULARITY
#error "VDVR_GRANULARITY (cells per brick and axis) must be defined"
#endif
#if defined(VDVR_SAMPLER_BUFFER) == defined(VDVR_SAMPLER_IMAGE3D)
#error "define one of VDVR_SAMPLER_BUFFER and VDVR_SAMPLER_IMAGE3D"
#endif
#ifndef VDVR_KERNEL
#error "VDVR_KERNEL (the kernel to build, shared/raycast_params.h) must be defined"
#endif
// 1: every brick reads a float32 base, whose cells are then addressed without records.
#ifndef VDVR_UNIFORM
#define VDVR_UNIFORM 0
#endif
// 1: gradients are the derivative of the cell, 0: central differences over one base cell.
#ifndef VDVR_GRADIENT_ANALYTIC
#define VDVR_GRADIENT_ANALYTIC 0
#endif
#include "device/raycast_settings.h"
#include "shared/mixed_sampler.h"
#include "device/mixed_image.h"
#include "shared/raycast_params.h"
#include "device/packet.h"
#include "device/packet_sampler.h"

#include "device/raycast_dvr.h"
// Here for both: a text is put where it is first named, and nowhere else.
#if VDVR_KERNEL == VDVR_KERNEL_ISO || VDVR_KERNEL == VDVR_KERNEL_INTEGRAL
#include "device/ray_cells.h"
#endif
#if VDVR_KERNEL == VDVR_KERNEL_PREINTEGRATED
#include "device/raycast_preintegrated.h"
#elif VDVR_KERNEL == VDVR_KERNEL_LEVEL
#include "device/raycast_level.h"
#elif VDVR_KERNEL == VDVR_KERNEL_ADAPTIVE
#include "device/raycast_adaptive.h"
#elif VDVR_KERNEL == VDVR_KERNEL_ISO
#include "device/raycast_iso.h"
#elif VDVR_KERNEL == VDVR_KERNEL_INTEGRAL
#include "device/raycast_integral.h"
#elif VDVR_KERNEL == VDVR_KERNEL_MIP

// The largest sample along the ray; a brick that cannot raise it is leapt over. Geometry: where it lies; no
// normal.
__kernel VDVR_HINT void raycast_mip(FIELD, BRICKS, VdvrGrid grid, __global const float2* restrict ranges,
                                    __global const float4* restrict table, VdvrRaycast p,
                                    __global float4* restrict picture,
                                    __global uint* restrict row_samples BOUNDS) {
  THE_PIXELS;
  const V nothing = (V)(NAN);
  V largest = (V)(-INFINITY), depth = nothing;
  I samples = 0;
  const Ray ray = cast_rays(&p, grid, px, py);
  // At least one sample, so that a ray that only grazes the box has a value.
  const I hits = ends_of(&p, &ray, px, py, (V)(1.0f));
  const I by_length = ends_of(&p, &ray, px, py, ray.length * p.inverse_step - 0.5f);
  const I ends = MOST(hits, by_length);
  const int end = most_lane(ends);
  OpenBrick brick = no_brick();
  __global const float* most = (__global const float*)ranges + 1;
  int k = 0;
  while (k < end) {
    const I active = k < ends;
    const V middle = (V)(((float)k + 0.5f) * p.step), t = LEAST(middle, ray.length);
    const V3 c = position_at(&ray, grid, t);
    if (ANY(active & NOT(is_inside(&brick, c)))) {
      const I3 at = brick_at(grid, c);
      if (p.skip) {
        const V top = GATHER(V, most, 2 * brick_index(grid, at));
        if (!ANY(active & (top + p.slack > largest))) {
          k = leap_to(leave_bricks(&ray, at, (I)(0)), active, p.inverse_step, 0.5f, k, end);
          continue;
        }
      }
      brick = open_brick(bricks, grid, at);
    }
    const V value = sample_open(THE_FIELD, &brick, grid, c).value;
    samples += PICK(active, (I)(1), (I)(0));
    const I raised = active & (value > largest);
    largest = PICK(raised, value, largest);
#if VDVR_BOUNDS
    depth = PICK(raised, GATHER(V, bounds, brick_index(grid, brick_at(grid, c))), depth);
#else
    depth = PICK(raised, (ray.first + t) * p.length_unit, depth);
#endif
    ++k;
  }
#if VDVR_GEOMETRY
  put(p.width, p.height, picture, row_samples, px, py, v3(nothing, nothing, nothing), depth, samples);
#else
  const V3 rgb = pick3(samples > 0, colour_of(table, row_of(&p, largest)), background(&p, py));
  put(p.width, p.height, picture, row_samples, px, py, rgb, largest, samples);
#endif
}

#elif VDVR_KERNEL == VDVR_KERNEL_SLICE

// One orthogonal slice, grey; .w is the field itself, NaN outside the grid.
__kernel VDVR_HINT void slice(FIELD, BRICKS, VdvrGrid grid, VdvrSlice p, __global float4* restrict picture,
                              __global uint* restrict row_samples) {
  THE_PIXELS;
  V c[3] = {(V)(p.first[0]), (V)(p.first[1]), (V)(p.first[2])};
  c[p.across] += TO_V(px) * p.step_across;
  c[p.down] += TO_V(py) * p.step_down;
  const V3 point = v3(c[0], c[1], c[2]), nearest = clamp_to_grid(point, grid);
  const I inside = (point.x == nearest.x) & (point.y == nearest.y) & (point.z == nearest.z);
  const V value = sample_anywhere(THE_FIELD, bricks, grid, nearest).value, none = (V)(0.0f), one = (V)(1.0f);
  const V grey = clamp((value - p.window_lo) * p.window_scale, none, one);
  const V shown = PICK(inside, grey, (V)(VDVR_GREY_OUTSIDE));
  put(p.width, p.height, picture, row_samples, px, py, v3(shown, shown, shown), PICK(inside, value, (V)(NAN)),
      (I)(0));
}

#endif
