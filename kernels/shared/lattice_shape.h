// A lattice of every spacing-th gold node of a block, per axis: node n of an axis has index n / spacing +
// reach. Passed by value from host/certify/gold/fit_coefficients.cpp and host/certify/gold/gold_batch.cpp to
// fit_coefficients.cl and classify.cl.
#ifndef VDVR_LATTICE_SHAPE_H
#define VDVR_LATTICE_SHAPE_H

typedef struct {
  int spacing_x, spacing_y, spacing_z;  // gold nodes
  int reach_x, reach_y, reach_z;        // of the lattice's samples in the halo
  int cx, cy, cz;                       // samples per block
} VdvrLattice;

// A column of blocks of gold, or of a lattice, that takes part. 16 bytes.
typedef struct {
  int block, y, x;
  unsigned int runs;  // a bit for each run of 16 nodes along z
} VdvrMarkedColumn;

#endif
