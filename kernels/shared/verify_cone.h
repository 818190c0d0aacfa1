// Layouts of the nodes that `verify` back-projects of cone-beam views (verify_cone.cl). Passed by value from
// host/verify/witness/cone_nodes.cpp.
#ifndef VDVR_VERIFY_CONE_H
#define VDVR_VERIFY_CONE_H

// Heights of a work-item, and of a block, which has one set of numbers for each view.
#define VDVR_VERIFY_CONE_HEIGHTS 8
#define VDVR_VERIFY_CONE_BLOCK 16
// Where eight columns are weighted once for a block: so many rows at most, and so many views together.
#define VDVR_VERIFY_CONE_STRIP 64
#define VDVR_VERIFY_CONE_VIEWS 4

typedef struct {
  int accumulate;     // whether the views are added to what the nodes hold, or written
  int views;          // in the table
  int columns, rows;  // of a view of the table
  int first_tile;     // of the tiles whose blocks have their numbers here
  int tiles;          // so many
  int blocks;         // of heights
  int all_heights;    // of a node
  int used;           // of these; what lies above may hold anything finite
} VdvrVerifyCone;

#endif
