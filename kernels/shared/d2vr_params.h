// The filtered projections as kernels of D2VR address them. Filled by host/picture/render/d2vr.cpp, read by
// d2vr_field.h; compiled by both sides. Columns and rows are those stored: of upsampled projections the finer
// ones.
#ifndef VDVR_D2VR_PARAMS_H
#define VDVR_D2VR_PARAMS_H

// Scalars only. 32 bytes.
typedef struct {
  int views, columns, rows;
  float first_row, rows_per_cell;       // row = first_row + rows_per_cell * z, z in cells
  float lowest_column, highest_column;  // what lies beyond in any view is not covered
  int pad;
} VdvrDetector;

#endif
