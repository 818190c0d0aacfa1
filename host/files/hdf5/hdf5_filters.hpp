// Filters that HDF5 finds as plugins, and zstd, which is ours: named, looked for, and their chunks looked
// into before HDF5 unpacks them, since plugins believe the sizes that a chunk states.
#pragma once

#include <optional>
#include <string>

#include "host/files/hdf5/hdf5.hpp"

namespace vdvr::io::hdf5 {

/// What is missing for reading this dataset, with the package that brings it; or nothing.
std::optional<std::string> check_filters_present(const Dataset& dataset);

/// Of the chunks that a selection of the dataset's space touches: that each was written, states the size
/// which its shape needs, and holds no more and no less than it states. Costs reading what is stored, no
/// unpacking. Does nothing where all chunks were written and all filters are HDF5's own. What is wrong, with
/// the place of the chunk, or nothing.
std::optional<std::string> check_chunks(const Dataset& dataset, hid_t selection);

}  // namespace vdvr::io::hdf5
