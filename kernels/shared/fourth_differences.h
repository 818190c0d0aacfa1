// Blocks of kept gold whose fourth differences are looked at, brick by brick (fourth_differences.cl). Passed
// by value from host/certify/kept/brick_remainder.cpp.
#ifndef VDVR_FOURTH_DIFFERENCES_H
#define VDVR_FOURTH_DIFFERENCES_H

typedef struct {
  int bricks_x, bricks_y, bricks_z;
  int side_x, side_y, side_z;  // kept nodes from brick to brick
  int nx;                      // nodes of a row, two around the bricks included
  int stride;                  // floats from column to column
  int first_z, last_z;         // heights that count, from the first brick on
  float lowest;                // columns of a smaller coverage margin do not count
} VdvrFourthDifferences;

#endif
