// Upsampled columns as back-projection reads them: float in[row / 16][line][16], where a line is a column of
// a view, to float table[line][stride]; 0 beyond the last row. Called by host/certify/kept/cone_tiles.cpp.
__kernel void join_kept_rows(__global float* table, __global const float* in, int lines, int rows,
                             int stride) {
  const int row = (int)get_global_id(0), line = (int)get_global_id(1);
  if (row >= stride || line >= lines) return;
  table[(size_t)line * stride + row] =
      row < rows ? in[((size_t)(row / 16) * lines + line) * 16 + row % 16] : 0.0f;
}
