// Datasets of numbers as others write them, wherever their numbers lie: in the file, or as a virtual dataset
// in others. A virtual dataset is read here, source by source, and not by the HDF5 library, which looks for
// sources where its environment says and gives fill values where it finds none.
#pragma once

#include <memory>
#include <string>

#include "host/files/hdf5/hdf5_links.hpp"

namespace vdvr::io::hdf5 {

/// The dataset at `place`, checked: that it holds numbers, that its filters are there, and of a virtual one
/// that its sources, and theirs, are there with the elements and the type that it states, and leave no gap.
/// `files` knows then which files it lies in. `name` is its name in messages. Costs opening every source; at
/// most some 64 stay open. Throws FileError.
Dataset numeric_dataset(const std::shared_ptr<const LinkedFiles>& files, Place place, std::string name);

}  // namespace vdvr::io::hdf5
