// Cosine coefficients along one axis of a block: out[o][m][i] = sum_j a[m][j] in[o][j][i] with a the analysis
// matrix of host/cosine_series.hpp, stored transposed (float at[j][m]) so that neighbours in the last axis
// read neighbours. Sums run in runs of 32 terms, as in kernels/batched_product.cl, for rounding. Called by
// host/cosine_spectrum.cpp and host/paper_bounds.cpp.

__kernel void cosine_axis(__global float* restrict out, __global const float* restrict in,
                          __global const float* restrict at, int outer, int n, int inner) {
  // With inner == 1 the coefficients themselves are the fast axis.
  const int g = (int)get_global_id(0);
  const int m = inner == 1 ? g : (int)get_global_id(1);
  const int i = inner == 1 ? 0 : g;
  const int o = (int)get_global_id(2);
  if (m >= n || i >= inner || o >= outer) return;
  __global const float* line = in + (size_t)o * n * inner + i;
  if (inner != 1) {
    // Every fourth work-item does four coefficients, which share what they read of the line.
    if (m % 4 != 0) return;
    const int m1 = min(m + 1, n - 1), m2 = min(m + 2, n - 1), m3 = min(m + 3, n - 1);
    float4 totals = (float4)(0.0f);
    for (int first = 0; first < n; first += 32) {
      const int last = min(first + 32, n);
      float4 sum = (float4)(0.0f);
      for (int j = first; j < last; ++j) {
        __global const float* a = at + (size_t)j * n;
        sum = fma((float4)(a[m], a[m1], a[m2], a[m3]), (float4)(line[(size_t)j * inner]), sum);
      }
      totals += sum;
    }
    __global float* to = out + ((size_t)o * n + m) * inner + i;
    to[0] = totals.x;
    if (m1 > m) to[inner] = totals.y;
    if (m2 > m1) to[2 * (size_t)inner] = totals.z;
    if (m3 > m2) to[3 * (size_t)inner] = totals.w;
    return;
  }
  float total = 0.0f;
  for (int first = 0; first < n; first += 32) {
    const int last = min(first + 32, n);
    float sum = 0.0f;
    for (int j = first; j < last; ++j) sum = fma(at[(size_t)j * n + m], line[(size_t)j * inner], sum);
    total += sum;
  }
  out[((size_t)o * n + m) * inner + i] = total;
}
