// A grid of frequencies on which the error of interpolation is mapped. Passed by value from
// host/certify/bounds/error_map.cpp to error_map.cl.
#ifndef VDVR_ERROR_MAP_H
#define VDVR_ERROR_MAP_H

// 44 bytes; scalars only.
typedef struct {
  int first_x, first_y, first_z;  // frequency i of an axis is (first + i) * step
  int count_x, count_y, count_z;
  float step_x, step_y, step_z;  // radians per sample
  float exact_product;           // prod cos from which on the error at the centre is proved to be the worst
  float margin;                  // that bounds are multiplied by for fp32 rounding
} VdvrFrequencies;

#endif
