// Detector rows that are filtered together, and where their columns go. Passed by value from
// host/field/fbp/filter_rows.cpp to filter_rows.cl.
#ifndef VDVR_FILTER_ROWS_H
#define VDVR_FILTER_ROWS_H

#include "shared/chunks.h"

// 48 bytes.
typedef struct {
  VdvrChunks out;  // a batch is a view
  int columns;     // of the detector
  int z_padded;    // rows of a view, to a multiple of 16
  int views;
  int offset;        // of the taps: where in them the difference VDVR_STEP - 1 is
  int first_column;  // detector column that out's column 0 is; below 0 beyond the detector's edge
  int out_columns;
} VdvrFilteredRows;

#endif
