// Rows of upsampled columns as back-projection reads them: float in[row / 16][line][16] to float
// out[line][row % rate][row / rate], where a line is a column of a view, and phases of rows are
// `phase_stride` apart. What lies beyond the last row is 0. Called by host/field/fdk/cone_back_project.cpp.
__kernel void join_rows(__global float* out, __global const float* in, int lines, int rows, int rate,
                        int phase_stride) {
  const int i = (int)get_global_id(0), line = (int)get_global_id(1);
  if (i >= rate * phase_stride || line >= lines) return;
  const int row = i % phase_stride * rate + i / phase_stride;
  out[(size_t)line * rate * phase_stride + i] =
      row < rows ? in[((size_t)(row / 16) * lines + line) * 16 + row % 16] : 0.0f;
}
