// The worst error of multilinear interpolation of one plane wave, for every frequency of a grid of them
// (docs/error-bounds.md, section 3). centre: 1 - prod cos(kappa_j / 2). bound: the same where it is proved to
// be the worst error, else the smaller of the sum over the axes and a table over prod cos, one table for two
// axes and one for three; times `margin`, which covers fp32 rounding. Layout float [z][y][x].
// Called by host/error_map.cpp.
#ifndef VDVR_TABLE_STEPS
#error "VDVR_TABLE_STEPS: intervals of the table of bounds"
#endif

// 1 - cos(kappa / 2) without cancellation.
float axis_error(float kappa) {
  const float s = sin(0.25f * kappa);
  return 2.0f * s * s;
}

__kernel void error_map(__global float* restrict centre, __global float* restrict bound,
                        __global const float* restrict beyond, int first_x, int first_y, int first_z,
                        int count_x, int count_y, int count_z, float4 step, float exact_product,
                        float margin) {
  const int x = (int)get_global_id(0);
  const int y = (int)get_global_id(1);
  const int z = (int)get_global_id(2);
  if (x >= count_x || y >= count_y || z >= count_z) return;
  const float ex = axis_error((float)(first_x + x) * step.x);
  const float ey = axis_error((float)(first_y + y) * step.y);
  const float ez = axis_error((float)(first_z + z) * step.z);
  // 1 - (1 - a)(1 - b) = a + b - a b, which keeps small errors to their last digits.
  const float exy = fma(-ex, ey, ex + ey);
  const float e = fma(-exy, ez, exy + ez);
  const int axes = (ex > 0.0f) + (ey > 0.0f) + (ez > 0.0f);
  const float product = 1.0f - e;
  float proved = e;
  if (axes > 1 && product < exact_product) {
    // The table falls with the product: its entry below, and one more for rounding, is never too small.
    const int i = clamp((int)(product / exact_product * VDVR_TABLE_STEPS - 0.01f), 0, VDVR_TABLE_STEPS);
    proved = min(ex + ey + ez, beyond[(axes - 2) * (VDVR_TABLE_STEPS + 1) + i]);
  }
  const size_t at = ((size_t)z * count_y + y) * count_x + x;
  centre[at] = e;
  bound[at] = proved * margin;
}
