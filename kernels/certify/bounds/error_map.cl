// The worst error of multilinear interpolation of one plane wave, for every frequency of a grid of them
// (docs/error-bounds.md, section 3). centre: 1 - prod cos(kappa_j / 2). bound: the same where it is proved to
// be the worst error, else the smallest of what is proved: sums over the axes, and tables over prod cos, one
// for two axes and one for three; times `margin`, which covers fp32 rounding. Layout float [z][y][x].
// Called by host/certify/bounds/error_map.cpp.
#include "shared/error_map.h"

#ifndef VDVR_TABLE_STEPS
#error "VDVR_TABLE_STEPS: intervals of the table of bounds"
#endif

// 1 - cos(kappa / 2) without cancellation.
float axis_error(float kappa) {
  const float s = sin(0.25f * kappa);
  return 2.0f * s * s;
}

// The table falls with the product: its entry below, and one more for rounding, is never too small.
float beyond_product(__global const float* restrict beyond, float product, float exact_product) {
  return beyond[clamp((int)(fma(product / exact_product, (float)VDVR_TABLE_STEPS, -0.01f)), 0,
                      VDVR_TABLE_STEPS)];
}

__kernel void error_map(__global float* restrict centre, __global float* restrict bound,
                        __global const float* restrict beyond, VdvrFrequencies f) {
  const int x = (int)get_global_id(0);
  const int y = (int)get_global_id(1);
  const int z = (int)get_global_id(2);
  if (x >= f.count_x || y >= f.count_y || z >= f.count_z) return;
  const float ex = axis_error((float)(f.first_x + x) * f.step_x);
  const float ey = axis_error((float)(f.first_y + y) * f.step_y);
  const float ez = axis_error((float)(f.first_z + z) * f.step_z);
  // 1 - (1 - a)(1 - b) = a + b - a b, which keeps small errors to their last digits.
  const float exy = fma(-ex, ey, ex + ey);
  const float e = fma(-exy, ez, exy + ez);
  // The largest two axes alone, then the third added; or all three at once.
  const float low = min(ex, min(ey, ez)), high = max(ex, max(ey, ez));
  const float mid = max(min(ex, ey), min(max(ex, ey), ez));
  const float pair = fma(-mid, high, mid + high);
  float proved = e;
  if (mid > 0.0f && 1.0f - e < f.exact_product) {
    proved = pair;
    if (1.0f - pair < f.exact_product)
      proved = min(mid + high, beyond_product(beyond, 1.0f - pair, f.exact_product));
    proved += low;
    if (low > 0.0f)
      proved = min(proved, beyond_product(beyond + VDVR_TABLE_STEPS + 1, 1.0f - e, f.exact_product));
  }
  const size_t at = ((size_t)z * f.count_y + y) * f.count_x + x;
  centre[at] = e;
  bound[at] = proved * f.margin;
}
