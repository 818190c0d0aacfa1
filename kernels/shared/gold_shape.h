// Blocks of gold side by side, and the bricks under them: what kernels that read gold are told of its layout
// (node_slack.cl). Passed by value from host/gold/gold_batch.cpp to classify.cl and measure.cl.
#ifndef VDVR_GOLD_SHAPE_H
#define VDVR_GOLD_SHAPE_H

typedef struct {
  int nx, ny, nz;                    // nodes of a block, without its halo
  int halo;                          // nodes on every side
  int gold_stride, stride;           // of a column of gold, and of slack
  int rate;                          // gold cells to a cell of the grid
  int bricks_x, bricks_y, bricks_z;  // of a block
  int blocks;
  float lowest;  // columns of a smaller coverage margin are not tested
} VdvrGoldShape;

#endif
