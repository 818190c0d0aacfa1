// Blocks of sample columns that are back-projected together, and the filtered projections under them. Passed
// by value from host/field/fbp/back_project.cpp to back_project.cl.
#ifndef VDVR_BACK_PROJECT_H
#define VDVR_BACK_PROJECT_H

// 36 bytes.
typedef struct {
  int views, columns;  // of the filtered projections; columns are the upsampled ones
  int z_padded;        // samples of a column, to a multiple of 16
  int out_stride;      // floats from one column of samples to the next
  int nx, ny;          // columns of samples to a block
  int blocks;
  int first_chunk;  // of 16 rows of the filtered projections: the one that z = 0 lies in
  int out_row;      // where in a column of samples z = 0 lies
} VdvrColumnBlocks;

#endif
