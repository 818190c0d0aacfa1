// Between a pass along u and one along v: float d[z / 16][view][column n][16], z being v. Called by
// host/field/fbp/dense_values.cpp.

// Rows become columns: out[n / 16][view][v][16] of d, z being v; columns beyond the last are 0.
__kernel void turn(__global float* out, __global const float* d, int views, int columns, int rows) {
  const int v = (int)get_global_id(0), chunk = (int)get_global_id(1), k = (int)get_global_id(2);
  if (v >= rows || k >= views || chunk * 16 >= columns) return;
  __global const float* p = d + ((size_t)(v / 16) * views + k) * columns * 16 + v % 16;
  __global float* target = out + (((size_t)chunk * views + k) * rows + v) * 16;
  for (int i = 0; i < 16; ++i) {
    const int n = chunk * 16 + i;
    target[i] = n < columns ? p[(size_t)n * 16] : 0.0f;
  }
}
