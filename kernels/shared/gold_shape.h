// Blocks of gold side by side: what kernels that read gold are told of its layout (node_slack.cl).
#ifndef VDVR_GOLD_SHAPE_H
#define VDVR_GOLD_SHAPE_H

// With the bricks under them. Passed by value from host/certify/gold/gold_batch.cpp to classify.cl,
// cell_test.cl and fit_tiles.cl. 48 bytes.
typedef struct {
  int nx, ny, nz;                    // nodes of a block, without its halo
  int halo;                          // nodes on every side
  int gold_stride, stride;           // of a column of gold, and of slack
  int rate;                          // gold cells to a cell of the grid
  int bricks_x, bricks_y, bricks_z;  // of a block
  int blocks;
  float lowest;  // columns of a smaller coverage margin are not tested
} VdvrGoldShape;

// Alone. Passed by value from host/certify/gold/fit_base.cpp to fit_base.cl. 36 bytes.
typedef struct {
  int nx, ny, nz;   // nodes of a block, without its halo
  int halo;         // nodes on every side
  int gold_stride;  // of a column of gold
  int blocks;
  int z_first, z_last;  // tested nodes along z
  float lowest;         // columns of a smaller coverage margin are not tested
} VdvrGoldBlocks;

#endif
