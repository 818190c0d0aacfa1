// Where columns lie that are cut along z into chunks of 16 samples: sample z of column n of batch b at first
// + b * batch + (z / 16) * chunk + 16 n + z % 16. Included by batched_product.h and filter_rows.h.
#ifndef VDVR_CHUNKS_H
#define VDVR_CHUNKS_H

#ifdef __OPENCL_VERSION__
typedef ulong VdvrPlace;
#else
#include <cstdint>
typedef std::uint64_t VdvrPlace;
#endif

// In floats. 24 bytes.
typedef struct {
  VdvrPlace first, batch, chunk;
} VdvrChunks;

#endif
