// The pieces of the ramp filter around the FFT along u: zero-padding, the product with the kernel's real
// spectrum, and the crop that turns rows [view][v][u] into columns [view][u][v] with v contiguous (method:
// linear convolution, docs/geometry.md). Called by host/filter_rows.cpp.

__kernel void pad_rows(__global float* padded, __global const float* rows, int columns, int length,
                       int count) {
  const int i = (int)get_global_id(0), r = (int)get_global_id(1);
  if (i >= length || r >= count) return;
  padded[(size_t)r * length + i] = i < columns ? rows[(size_t)r * columns + i] : 0.0f;
}

__kernel void multiply_spectrum(__global float2* spectrum, __global const float* filter, int bins,
                                int count) {
  const int i = (int)get_global_id(0), r = (int)get_global_id(1);
  if (i >= bins || r >= count) return;
  spectrum[(size_t)r * bins + i] *= filter[i];
}

__kernel void crop_transposed(__global float* columns_out, __global const float* padded,
                              __global const float* weights, int columns, int rows, int rows_padded,
                              int length, int views) {
  const int v = (int)get_global_id(0), u = (int)get_global_id(1), k = (int)get_global_id(2);
  if (v >= rows_padded || u >= columns || k >= views) return;
  columns_out[((size_t)k * columns + u) * rows_padded + v] =
      v < rows ? weights[k] * padded[((size_t)k * rows + v) * length + u] : 0.0f;
}
