// Columns of a detector and the finer ones made of them. Passed by value from
// host/field/fbp/upsample_columns.cpp to upsample_columns.cl.
#ifndef VDVR_UPSAMPLE_COLUMNS_H
#define VDVR_UPSAMPLE_COLUMNS_H

#include "shared/chunks.h"

// 88 bytes.
typedef struct {
  VdvrChunks in, out;  // a batch is a view
  int columns;         // of the detector
  int length;          // of the transform, a power of two
  int rate;            // finer columns to a detector column, even
  int pad, count;      // of the finer columns: those before the detector's edge, and all
  int margin;          // half columns that are kept on either side of the detector
  int views, chunks;   // of 16 rows
  int slots;           // work-items that share the work
  int reserved;
} VdvrFinerColumns;

#endif
