// Values on a lattice denser than the detector as back-projection reads them: float in[column /
// 16][view][row] [16] to float table[view][column][stride]; 0 beyond the last row. Called by
// host/certify/kept/cone_tiles.cpp.
__kernel void join_columns(__global float* table, __global const float* in, int views, int columns, int rows,
                           int stride) {
  const int row = (int)get_global_id(0), column = (int)get_global_id(1), k = (int)get_global_id(2);
  if (row >= stride || column >= columns || k >= views) return;
  table[((size_t)k * columns + column) * stride + row] =
      row < rows ? in[(((size_t)(column / 16) * views + k) * rows + row) * 16 + column % 16] : 0.0f;
}
