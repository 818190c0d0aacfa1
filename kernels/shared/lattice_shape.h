// Samples that are fitted to gold. Passed by value, or in arrays, from host/certify/gold/fit_base.cpp,
// fit_tiles.cpp and gold_batch.cpp to the kernels of the same stems and to classify.cl.
#ifndef VDVR_LATTICE_SHAPE_H
#define VDVR_LATTICE_SHAPE_H

#ifdef __OPENCL_VERSION__
typedef ulong VdvrRoom;
#else
#include <cstdint>
typedef std::uint64_t VdvrRoom;
#endif

// Every second gold node of a block, as base samples lie: node n of an axis has index n / 2 + reach. 24
// bytes.
typedef struct {
  int reach_x, reach_y, reach_z;  // of the lattice's samples in the halo
  int cx, cy, cz;                 // samples per block
} VdvrLattice;

// The lattice of one brick's tile, at a level of its own: every spacing-th node of the brick, and some
// samples around these that steps read. 80 bytes.
typedef struct {
  int block, node_x, node_y, node_z;    // of the brick's first node in its block
  int spacing_x, spacing_y, spacing_z;  // gold nodes, powers of two
  int before_x, before_y, before_z;     // samples ahead of the brick's own
  int side_x, side_y, side_z;           // samples of the brick
  int cx, cy, cz;                       // samples in all
  int stride;                           // floats from column to column of its arrays
  int pad;
  VdvrRoom room;  // where its arrays begin, in floats
} VdvrTileFit;

#endif
