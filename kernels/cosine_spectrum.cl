// Cosine coefficients along one axis of a block: out[o][m][i] = sum_j a[m][j] in[o][j][i] with a the analysis
// matrix of host/cosine_series.hpp, stored transposed (float at[j][m]) so that neighbours in the last axis
// read neighbours. Sums run in runs of 32 terms, as in kernels/batched_product.cl, for rounding. The fast
// axis is i, or m where inner == 1; every 16th work-item along it does 16 of its entries. Called by
// host/cosine_spectrum.cpp and host/paper_bounds.cpp.

// One coefficient: a and line advance by their strides from term to term.
inline float coefficient(__global const float* a, int a_stride, __global const float* line, int stride,
                         int n) {
  float total = 0.0f;
  for (int first = 0; first < n; first += 32) {
    const int last = min(first + 32, n);
    float sum = 0.0f;
    for (int j = first; j < last; ++j) sum = fma(a[(size_t)j * a_stride], line[(size_t)j * stride], sum);
    total += sum;
  }
  return total;
}

__kernel void cosine_axis(__global float* restrict out, __global const float* restrict in,
                          __global const float* restrict at, int outer, int n, int inner) {
  const int g = (int)get_global_id(0), o = (int)get_global_id(2);
  const bool lines = inner == 1;  // 16 coefficients of one line, else one coefficient of 16 lines
  const int m = lines ? g : (int)get_global_id(1), i = lines ? 0 : g, fast = lines ? n : inner;
  if (g % 16 != 0 || g >= fast || m >= n || o >= outer) return;
  __global const float* line = in + (size_t)o * n * inner + i;
  __global float* to = out + ((size_t)o * n + m) * inner + i;
  if (g + 16 > fast) {
    for (int k = 0; k < fast - g; ++k)
      to[k] = coefficient(at + m + (lines ? k : 0), n, line + (lines ? 0 : k), inner, n);
    return;
  }
  float16 total = (float16)(0.0f);
  for (int first = 0; first < n; first += 32) {
    const int last = min(first + 32, n);
    float16 sum = (float16)(0.0f);
    if (lines)
      for (int j = first; j < last; ++j)
        sum = fma(vload16(0, at + (size_t)j * n + m), (float16)(line[j]), sum);
    else
      for (int j = first; j < last; ++j)
        sum = fma((float16)(at[(size_t)j * n + m]), vload16(0, line + (size_t)j * inner), sum);
    total += sum;
  }
  vstore16(total, 0, to);
}
