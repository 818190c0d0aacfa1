// D2VR: ray-casting straight from the filtered projections (Rautek et al. 2006), and the same field at
// points. The rays, leaps, colours and light of raycast.cl over the field of device/d2vr_field.h, so that a
// picture differs from that of a stored volume by the field alone.
//
// Layouts: field and views as in d2vr_field.h; points[i] in cells, values[i]. Called by: D2vrField::at and
// raycast_float() of a D2vrScene in host/picture/render/d2vr.cpp.
#ifndef VDVR_GRANULARITY
#error "VDVR_GRANULARITY (cells per brick and axis) must be defined"
#endif
#ifndef VDVR_KERNEL
#error "VDVR_KERNEL (the kernel to build, shared/raycast_params.h) must be defined"
#endif
// 1: gradients are the derivative of the bilinear sum, 0: central differences over one base cell.
#ifndef VDVR_D2VR_DERIVATIVE
#define VDVR_D2VR_DERIVATIVE 0
#endif
// Of mixed_sampler.h only the grid and its dialect are needed; it must be told some sample type.
#define VDVR_SAMPLE_TYPES 1

#include "device/raycast_settings.h"
#include "shared/mixed_sampler.h"
#include "shared/raycast_params.h"
#include "shared/d2vr_params.h"
#include "device/packet.h"
#include "device/d2vr_field.h"

#include "device/raycast_dvr.h"

#if VDVR_KERNEL == VDVR_KERNEL_POINTS
__kernel PACKET_HINT void d2vr_points(FIELD, __global const float4* restrict views,
                                      __global const float4* restrict points, __global float* restrict values,
                                      int count) {
  const I i = (int)get_global_id(0) * VDVR_LANES + COLUMNS + ROWS * PACKET_X;
  if (LANE(i, 0) >= count) return;
  V3 c;
#define POINT(n)                                             \
  {                                                          \
    const float4 point = points[min(LANE(i, n), count - 1)]; \
    LANE(c.x, n) = point.x;                                  \
    LANE(c.y, n) = point.y;                                  \
    LANE(c.z, n) = point.z;                                  \
  }
  EACH(POINT)
#undef POINT
  const V value = back_projected(THE_FIELD, views, c);
#define PUT_VALUE(n) \
  if (LANE(i, n) < count) values[LANE(i, n)] = LANE(value, n);
  EACH(PUT_VALUE)
#undef PUT_VALUE
}
#endif
