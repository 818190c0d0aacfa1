// Values on a lattice denser than the detector as back-projection reads them: float in[column /
// 16][view][row][16] to float out[view][column][row % VDVR_RATE][row / VDVR_RATE], rows counted from `first`
// of `in_rows`, phases of rows `phase_stride` apart. What lies beyond the last of `rows` is 0. Called by
// host/field/fbp/dense_values.cpp.
#ifndef VDVR_RATE
#error "VDVR_RATE must be set"
#endif

__kernel void join_columns(__global float* out, __global const float* in, int views, int columns, int in_rows,
                           int first, int rows, int phase_stride) {
  const int i = (int)get_global_id(0), line = (int)get_global_id(1), k = (int)get_global_id(2);
  const int column = line / VDVR_RATE, phase = line % VDVR_RATE;
  if (i >= phase_stride || column >= columns || k >= views) return;
  const int row = i * VDVR_RATE + phase;
  out[(((size_t)k * columns + column) * VDVR_RATE + phase) * phase_stride + i] =
      row < rows ? in[(((size_t)(column / 16) * views + k) * in_rows + first + row) * 16 + column % 16]
                 : 0.0f;
}
