// What the test of gold cells is told beside gold's layout (gold_shape.h). Passed by value from
// host/certify/gold/cell_test.cpp.
#ifndef VDVR_CELL_TEST_H
#define VDVR_CELL_TEST_H

typedef struct {
  int z_first, z_last;  // nodes of a block at heights that are tested
  int counted;          // whether slack counts: 0 tests |V - gold| alone
  int windowed;         // whether cells outside the window do not count
  float window_low, window_high;
  int parts;        // whether to say which parts of bricks are over the tolerance
  float curvature;  // of the second differences: an eighth, or what finer gold would have of these
} VdvrCellTest;

#endif
