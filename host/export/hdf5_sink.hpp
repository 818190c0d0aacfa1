// HDF5: one dataset, its chunks packed on all cores.
#pragma once

#include "host/export/volume_sink.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {

/// /volume [z][y][x] with attributes spacing, origin (z, y, x), unit, scale, offset, epsilon_abs,
/// element_size_um where the unit is a length; chunks of whole rows of a plane, shuffled and deflated.
std::unique_ptr<VolumeSink> hdf5_sink(const std::filesystem::path& path, const ExportNote& note,
                                      Compression compression);

}  // namespace vdvr
