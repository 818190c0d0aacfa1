// A product along one axis of a block, in the one form that the kernel has for all axes. Passed by value from
// host/field/fbp/axis_product.cpp to axis_product.cl.
#ifndef VDVR_AXIS_PRODUCT_H
#define VDVR_AXIS_PRODUCT_H

// 24 bytes.
typedef struct {
  int batches, rows, terms, columns;
  int s_row, s_term;  // floats from one row of s to the next, and from one term to the next
} VdvrAxisProduct;

#endif
