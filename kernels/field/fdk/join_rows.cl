// Rows of upsampled columns as back-projection reads them: float in[row / 16][line][16] to float
// out[line][row % VDVR_RATE][row / VDVR_RATE], where a line is a column of a view, and phases of rows are
// `phase_stride` apart. What lies beyond the last row is 0. Work-items of a line's phases follow one another:
// they read the same cache lines. Called by host/field/fdk/cone_back_project.cpp.
#ifndef VDVR_RATE
#error "VDVR_RATE must be set"
#endif

__kernel void join_rows(__global float* out, __global const float* in, int lines, int rows,
                        int phase_stride) {
  const int i = (int)get_global_id(0), phase = (int)get_global_id(1), line = (int)get_global_id(2);
  if (i >= phase_stride || phase >= VDVR_RATE || line >= lines) return;
  const int row = i * VDVR_RATE + phase;
  out[((size_t)line * VDVR_RATE + phase) * phase_stride + i] =
      row < rows ? in[((size_t)(row / 16) * lines + line) * 16 + row % 16] : 0.0f;
}
