// Dense products of many rows with one matrix, or of one matrix with many.
#pragma once

#include "host/base/opencl/array.hpp"

namespace vdvr {

/// out[b][i][z] = sum_j a[b][i][j] v[b][j][z], 0 <= i < rows, 0 <= j < terms; element (j, z) of batch b of v
/// lies at b * v_batch + (z / 16) * v_chunk + 16 j + z % 16, of out alike from `out_first` on. A batch stride
/// of 0 shares one matrix. `run`: the terms of a run, which costs about what seven terms do besides.
struct ProductShape {
  std::int64_t rows = 0, terms = 0, z_padded = 0, batches = 1;
  int run = 16;
  std::uint64_t out_first = 0, out_batch = 0, out_chunk = 0, a_batch = 0, v_batch = 0, v_chunk = 0;
};

/// Enqueues; does not wait. Cost: batches * rows * terms * z_padded multiply-adds. A sum is rounded as
/// docs/error-bounds.md, section 7, says of products.
void batched_product(opencl::State& state, const opencl::DeviceArray<float>& out,
                     const opencl::DeviceArray<float>& a, const opencl::DeviceArray<float>& v,
                     const ProductShape& shape);

}  // namespace vdvr
