// Tiles of kept nodes that are back-projected from cone-beam views. Passed by value from
// host/certify/kept/cone_tiles.cpp to cone_nodes.cl.
#ifndef VDVR_CONE_NODES_H
#define VDVR_CONE_NODES_H

// Nodes of a tile's side, and heights that are computed together.
#define VDVR_CONE_TILE 32
#define VDVR_CONE_HEIGHTS 8
// Views that are added up together, then to the others.
#define VDVR_CONE_VIEWS 4
// Of cone_runs.cl: heights of a work-item, rows of a tile alike, and floats of a strip.
#define VDVR_CONE_RUN 64
#define VDVR_CONE_ROWS 8
#define VDVR_CONE_STRIP 768

#ifdef __OPENCL_VERSION__
typedef ulong VdvrOffset;
#else
#include <cstdint>
typedef std::uint64_t VdvrOffset;
#endif

typedef struct {
  VdvrOffset plane;   // floats from one view of the table to the next
  VdvrOffset tile;    // floats from one tile of nodes to the next
  int views;          // of the table
  int column_stride;  // floats from one column of the table to the next
  int last_column;    // that six taps may begin at
  int last_row;       // that eight values may be read from
  int stride;         // floats from one column of nodes to the next
  int groups;         // of heights
  int tiles;
  int block_side, block_groups;  // nodes across, and groups, that share a view's numbers
  int blocks_across, blocks;     // along x, or y; of a tile
} VdvrConeNodes;

#endif
