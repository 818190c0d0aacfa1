// zstd as a filter of HDF5, number 32015, over libzstd: Debian has no plugin of it.
#pragma once

#include <hdf5.h>

namespace vdvr::io::hdf5 {

constexpr H5Z_filter_t zstd_filter_number = 32015;

/// Makes it known to HDF5; once in a process. Its one parameter, which may be absent, is the level of
/// compression.
void register_zstd_filter();

}  // namespace vdvr::io::hdf5
