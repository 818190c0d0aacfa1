// Dense products a v of a batch, and where their matrices lie. Passed by value from
// host/field/fbp/batched_product.cpp to batched_product.cl.
#ifndef VDVR_BATCHED_PRODUCT_H
#define VDVR_BATCHED_PRODUCT_H

#include "shared/chunks.h"

// 72 bytes.
typedef struct {
  VdvrChunks out, v;  // `batch` of v is 0 where all batches share it
  VdvrPlace a_batch;  // floats from one matrix to the next; 0 where all batches share it
  int rows, terms;    // of a matrix a; terms are also the columns of v
  int z_padded;       // samples along z, to a multiple of 16
  int batches;
} VdvrProduct;

#endif
