// Tables that upright detectors would have, made of those of leaning ones. Passed by value from
// host/certify/kept/cone_tiles.cpp to upright_table.cl.
#ifndef VDVR_UPRIGHT_TABLE_H
#define VDVR_UPRIGHT_TABLE_H

#include "shared/cone_nodes.h"

typedef struct {
  VdvrOffset from_plane;             // floats from one view of the old table to the next
  int from_stride;                   // and from column to column
  int last_column;                   // of it, that eight may begin at
  int columns, rows, stride, views;  // of the new one: columns, their rows and room
} VdvrUprightTable;

// Rows of a work-item.
#define VDVR_UPRIGHT_RUN 32

#endif
