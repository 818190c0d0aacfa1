// What a device is asked when it is opened: whether it computes as certificates assume. Each result is
// compared with the host's, most to the bit; host/base/opencl/trust_checks.cpp has the same lines in the same
// order. Everything comes from memory, so that no compiler knows it. Layouts: float in[5][values]; int
// whole[3][values]; results[line][value]. Called by host/base/opencl/trust.cpp.
#define VDVR_LANES 8  // of the vectors
#include "device/masks.h"
#include "shared/mixed_sampler.h"
#include "shared/trust.h"

#define N VDVR_TRUST_VALUES
#define PUT_BITS(v) out[line++ * N + i] = (uint)(v)
#define PUT(v) PUT_BITS(as_uint(v))

// What the sum of two numbers rounds off.
static inline float lost(float a, float b) {
  const float s = a + b, from_b = s - a;
  return (a - (s - from_b)) + (b - from_b);
}

__kernel void trust_scalar(__global uint* out, volatile __global int* totals, __global const float* in,
                           __global const int* whole) {
  const int i = (int)get_global_id(0);
  if (i >= N) return;
  const float a = in[i], b = in[N + i], c = in[2 * N + i], small = in[3 * N + i], odd = in[4 * N + i];
  const int m = whole[i], n = whole[N + i], d = whole[2 * N + i];
  int line = 0;
  // Contraction: c is nearly -a b.
  PUT(a * b + c);
  PUT(c - a * -b);
  PUT((1.0f - a) * b + a * c);
  const float product = a * b, sum = product + c;
  PUT(sum);
  // Reassociation: small is lost beside a.
  PUT(lost(a, small));
  PUT((small + a) - a);
  PUT((a + b) - (b + small));
  PUT((a * small) * b);
  // fma, division, square root.
  PUT(fma(a, b, c));
  PUT(fma(-a, b, small));
  PUT(a / b);
  PUT(small / a);
  PUT(1.0f / b);
  PUT(sqrt(a));
  PUT(sqrt(fabs(small)));
  // Conversions.
  PUT((float)m);
  PUT((float)(uint)m);
  PUT((float)(ushort)n);
  PUT_BITS((int)(a * (float)(d % 1000)));
  PUT_BITS(convert_int(rint(0.5f * (float)(d % 1000))));
  PUT(floor(c * 7.5f));
  PUT(ceil(c * 7.5f));
  PUT(round(0.5f * (float)(d % 1000)));
  // Subnormal numbers: 0 where a device says that it flushes them.
  PUT(odd * 0.25f);
  PUT(odd - in[4 * N + (i + 1) % N]);
  PUT(fabs(odd) * 0x1p-20f);
  PUT(as_float((m & 0x7fffff) | 1) * 0x1p100f);
  // Numbers that are none, in the forms in which kernels ask.
  const float none = in[4 * N + i] / in[4 * N + i] - in[4 * N + i] / in[4 * N + i], nan = none / none;
  PUT_BITS((fabs(nan) <= FLT_MAX) | (nan == nan) << 1 | (isfinite(nan) != 0) << 2 | (a <= FLT_MAX) << 3 |
           ((a / none) <= FLT_MAX) << 4 | (isfinite(a / none) != 0) << 5 | (isfinite(a) != 0) << 6 |
           !(nan <= a) << 7);
  // Integers.
  PUT_BITS((uint)m * (uint)n);
  PUT_BITS(m / d);
  PUT_BITS(m % d);
  PUT_BITS(m >> (n & 31));
  PUT_BITS((uint)m >> (n & 31));
  PUT_BITS(1u << (n & 31));
  PUT_BITS(clz((uint)m));
  PUT_BITS((ulong)(uint)m * (ulong)(uint)n >> 32);
  PUT_BITS((((ulong)(uint)m << 20) + (ulong)(uint)n) / (ulong)(uint)d);
  // One lane: comparisons give 1, and what is chosen by them follows.
  PUT(PICK(m > n, a, b));
  PUT_BITS((m > n) + 2 * (m == n) + 4 * !(m > n) + 8 * (m > n && n < d));
  PUT(fmax(a, c) - fmin(b, small));
  PUT_BITS(as_int(as_float(m & 0x3fffffff)));
  atomic_add(totals, n & 255);
  atomic_max(totals + 1, m);
  atomic_or(totals + 2, 1 << (i & 31));
  atomic_max(totals + 3, as_int(fabs(c)));
}

// The same in vectors, which compilers treat apart.
__kernel void trust_vector(__global uint* out, __global const float* in, __global const int* whole) {
  const int i = (int)get_global_id(0) * 8;
  if (i >= N) return;
  const float8 a = vload8(0, in + i), b = vload8(0, in + N + i), c = vload8(0, in + 2 * N + i),
               small = vload8(0, in + 3 * N + i);
  const int8 m = vload8(0, whole + i), n = vload8(0, whole + N + i);
  int line = 0;
#define PUT8(v) vstore8(as_uint8(v), 0, out + line++ * N + i)
  PUT8(a * b + c);
  PUT8((1.0f - a) * b + a * c);
  const float8 s = a + small, from_small = s - a;
  PUT8((a - (s - from_small)) + (small - from_small));
  PUT8(fma(a, b, c));
  PUT8(convert_float8(m));
  PUT8(convert_int8(c * 1000.0f));
  PUT8(PICK(m > n, a, b));
  PUT8((m > n) + ANY(m > n) + 2 * ALL(m > n) + 4 * ANY(m < n) + 8 * ALL(isfinite(a)));
}

// The sampler: what is certified, drawn and read on the host.
__kernel void trust_sampler(__global uint* out, __global const uchar* samples, __global const uint* records,
                            __global const float4* points, VdvrGrid grid) {
  const int i = (int)get_global_id(0);
  if (i >= VDVR_TRUST_POINTS) return;
  const float4 c = points[i];
  const int g = grid.granularity, x = vdvr_brick_of(c.x, g, grid.bricks_x),
            y = vdvr_brick_of(c.y, g, grid.bricks_y), z = vdvr_brick_of(c.z, g, grid.bricks_z);
  const VdvrBrick b = vdvr_brick(records, grid, ((vdvr_u64)z * grid.bricks_y + y) * grid.bricks_x + x);
  out[i] =
      as_uint(vdvr_sample_in_brick(samples, b, vdvr_local(c.x, x, b.level_x, g, grid.cells_x, grid.coarse_x),
                                   vdvr_local(c.y, y, b.level_y, g, grid.cells_y, grid.coarse_y),
                                   vdvr_local(c.z, z, b.level_z, g, grid.cells_z, grid.coarse_z)));
}

#if VDVR_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
__kernel void trust_double(__global ulong* out, __global const double* in) {
  const int i = (int)get_global_id(0);
  if (i >= N) return;
  const double a = in[i], b = in[N + i], c = in[2 * N + i], s = a + b, from_b = s - a;
  out[i] = as_ulong(a * b + c);
  out[N + i] = as_ulong((a - (s - from_b)) + (b - from_b));
  out[2 * N + i] = as_ulong(fma(a, b, c));
  out[3 * N + i] = as_ulong(a / b);
  out[4 * N + i] = as_uint(convert_float(a));
  out[5 * N + i] = as_ulong(convert_double(in[i] < 2 ? 1.5f : 2.5f) * (double)i);
}
#endif
