// One block of lit samples: the base, or the tiles of one level triple. Filled by
// host/volume/sampler/lit_samples.cpp, read by lit_samples.cl; compiled by both sides.
#ifndef VDVR_LIT_PARAMS_H
#define VDVR_LIT_PARAMS_H

// 64 bytes; scalars only.
typedef struct {
  int size_x, size_y, size_z;     // samples of one tile, or of the base
  int level_x, level_y, level_z;  // of its tiles
  int tiles;                      // 0: the base
  int base_type;                  // of the base as stored, with its scale and bias
  float base_scale, base_bias;
  float cells_per_length_x, cells_per_length_y, cells_per_length_z;
  float per_gradient;           // units of a stored gradient per density and length
  unsigned int first, samples;  // sample that its first tile starts at, and of all blocks; below 2^31
} VdvrLitBlock;

#endif
