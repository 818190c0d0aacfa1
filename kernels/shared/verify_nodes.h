// Layouts of what `verify` makes F of: the table of fine columns, the nodes that are back-projected, blocks
// of gold made of these (verify_nodes.cl). Passed by value from host/verify/witness/nodes.cpp.
#ifndef VDVR_VERIFY_NODES_H
#define VDVR_VERIFY_NODES_H

// Nodes of a tile's side, which is back-projected with positions that count from its first node.
#define VDVR_VERIFY_TILE 8
// Views, and rows of the product along z, that are summed before they are added to the others.
#define VDVR_VERIFY_VIEWS 8
#define VDVR_VERIFY_ROWS 16

typedef struct {
  int accumulate;   // whether the views are added to what the nodes hold, or written
  int first_view;   // of the table, of all views
  int views;        // in the table
  int all_views;    // of the scan
  int columns;      // of the table
  int tiles;        // to be back-projected
  int rows_padded;  // heights of a node, to a multiple of 16
  int first_row;    // of the 16 that the table holds
} VdvrVerifyRows;

typedef struct {
  int blocks;
  int nx, ny;            // nodes of a block across
  int groups;            // of 16 heights
  int tiles_x, tiles_y;  // of the part that nodes are of
  int rows_padded;       // of a node
} VdvrVerifyHeights;

typedef struct {
  int outer, inner;   // what lies outside and inside of the axis; inner in vectors of 16
  int before, after;  // nodes along the axis
  int factor, by;     // values lie by / factor of a node apart
  int points;         // of a polynomial
  int axis;           // 0: x, 1: y
  int blocks;         // that `outer` counts, or rows of so many
} VdvrVerifyBetween;

#endif
