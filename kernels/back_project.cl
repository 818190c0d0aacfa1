// Back-projection onto columns of z samples: out[block][y][x][z] = sum_k q_k(t_k(x, y), z), the paper's Eq. 2 with the
// view weights folded into q.
// Layouts: float filtered[view][column n][z], z padded to a multiple of VDVR_LANES; float out[block][y][x][z] alike;
// per block and view a float4 {step of s along x, along y, fraction of s at the block's first sample, its integer part}.
// One work-item carries VDVR_LANES samples of z for VDVR_COLUMNS neighbours in x: position, index and weights are shared by
// the whole column, and the loads are contiguous. Positions are relative to the block, so fp32 holds them (docs/error-bounds.md).
// Called by host/back_project.cpp.
#pragma OPENCL FP_CONTRACT ON

#ifndef VDVR_CUBIC
#error "VDVR_CUBIC must be 0 (linear in u) or 1 (4-point cubic in u)"
#endif
// Tuning; never changes the result.
#ifndef VDVR_LANES
#define VDVR_LANES 16
#endif
#ifndef VDVR_COLUMNS
#define VDVR_COLUMNS 2
#endif

#if VDVR_LANES == 1
#define VEC float
#define LOAD(p) (*(p))
#define STORE(v, p) (*(p) = (v))
#elif VDVR_LANES == 4
#define VEC float4
#define LOAD(p) vload4(0, p)
#define STORE(v, p) vstore4(v, 0, p)
#elif VDVR_LANES == 8
#define VEC float8
#define LOAD(p) vload8(0, p)
#define STORE(v, p) vstore8(v, 0, p)
#else
#define VEC float16
#define LOAD(p) (*(__global const float16*)(p))
#define STORE(v, p) (*(__global float16*)(p) = (v))
#endif

__kernel void back_project(__global float* out, __global const float* filtered, __global const float4* steps, int views,
                           int columns, int z_padded, int nx, int ny, int blocks) {
  const int z = (int)get_global_id(0) * VDVR_LANES;
  const int x = (int)get_global_id(1) * VDVR_COLUMNS;
  const int row = (int)get_global_id(2);
  const int block = row / ny, y = row - block * ny;
  if (z >= z_padded || x >= nx || block >= blocks) return;

  VEC sum[VDVR_COLUMNS];
  for (int c = 0; c < VDVR_COLUMNS; ++c) sum[c] = (VEC)(0.0f);

  __global const float* plane = filtered + z;
  for (int k = 0; k < views; ++k, plane += (size_t)columns * z_padded) {
    const float4 step = steps[block * views + k];
    const int first = (int)step.w;
    const float at_y = fma(step.y, (float)y, step.z);
    for (int c = 0; c < VDVR_COLUMNS; ++c) {
      const float s = fma(step.x, (float)(x + c), at_y);
      const float below = floor(s);
      const float f = s - below;
#if VDVR_CUBIC
      const int n = clamp(first + (int)below, 1, columns - 3);
      __global const float* q = plane + (size_t)(n - 1) * z_padded;
      // Lagrange weights on the nodes -1, 0, 1, 2.
      const float g = 1.0f - f, h = 2.0f - f, e = 1.0f + f;
      sum[c] = fma((VEC)(-f * g * h * (1.0f / 6.0f)), LOAD(q), sum[c]);
      sum[c] = fma((VEC)(e * g * h * 0.5f), LOAD(q + z_padded), sum[c]);
      sum[c] = fma((VEC)(e * f * h * 0.5f), LOAD(q + 2 * z_padded), sum[c]);
      sum[c] = fma((VEC)(-e * f * g * (1.0f / 6.0f)), LOAD(q + 3 * z_padded), sum[c]);
#else
      const int n = clamp(first + (int)below, 0, columns - 2);
      __global const float* q = plane + (size_t)n * z_padded;
      sum[c] = fma((VEC)(1.0f - f), LOAD(q), sum[c]);
      sum[c] = fma((VEC)(f), LOAD(q + z_padded), sum[c]);
#endif
    }
  }
  __global float* target = out + (((size_t)block * ny + y) * nx + x) * z_padded + z;
  for (int c = 0; c < VDVR_COLUMNS; ++c)
    if (x + c < nx) STORE(sum[c], target + (size_t)c * z_padded);
}
