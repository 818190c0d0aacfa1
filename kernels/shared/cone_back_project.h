// A band of sample columns that is back-projected from cone-beam views. Passed by value from
// host/field/fdk/cone_back_project.cpp to cone_back_project.cl.
#ifndef VDVR_CONE_BACK_PROJECT_H
#define VDVR_CONE_BACK_PROJECT_H

// Columns of samples that share the point which a view's numbers are relative to, along x and y.
#define VDVR_CONE_BLOCK 32

// 48 bytes.
typedef struct {
  int views, columns, rows;  // of the table; rows without those that only vectors read
  int row_stride;            // floats from one column of the table to the next, a multiple of the rate
  int nx, ny, nz;            // samples of the band
  int out_stride;            // floats from one column of samples to the next
  int blocks_x;              // blocks along x
  int adds;                  // 1: to what `out` holds
  int spans_v, spans_u;      // rows and columns that a vector's lanes may lie between, at most
} VdvrConeBand;

// What a view is about a block: places in the table, steps per sample.
//
//   lambda = lambda_0 + step_lambda . d,  d in samples from the block's middle
//   column = whole_u + part_u + (step_u . d) / lambda,  row alike
//
// 64 bytes.
typedef struct {
  float step_u[3], part_u;
  float step_v[3], part_v;
  float step_lambda[3], lambda;
  float whole_u, whole_v;
  float unused[2];
} VdvrConeView;

#endif
