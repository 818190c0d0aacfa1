// Rows of upsampled columns in one run each: float in[row / 16][line][16] to float out[line][row_stride],
// where a line is a column of a view. Rows from `rows` on are zeros. Called by
// host/fbp/cone_back_project.cpp.
__kernel void join_rows(__global float* out, __global const float* in, int lines, int rows, int row_stride,
                        int rows_padded) {
  const int chunk = (int)get_global_id(0), line = (int)get_global_id(1);
  if (chunk * 16 >= row_stride || line >= lines) return;
  __global float* to = out + (size_t)line * row_stride + chunk * 16;
  __global const float* from = in + ((size_t)chunk * lines + line) * 16;
  for (int i = 0; i < 16; ++i) {
    const int row = chunk * 16 + i;
    to[i] = row < rows && row < rows_padded ? from[i] : 0.0f;
  }
}
