// Uniform volumes that are not one raster file: a dataset of an HDF5 file, a TIFF file of several images, a
// folder of TIFF slices.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// "FILE.h5:/dataset" in its two parts; nothing when the name is not of that form.
std::optional<std::pair<std::filesystem::path, std::string>> hdf5_volume_path(
    const std::filesystem::path& path);
bool is_tiff_path(const std::filesystem::path& path);
/// A folder without scan.json that holds TIFF files.
bool is_tiff_folder(const std::filesystem::path& path);

struct VolumeLimits {
  std::uint64_t max_memory_bytes = 0;  ///< 0: no limit
  std::optional<double> nan_as;        ///< for samples that are no finite floats
};

/// Throws FileError: not three axes, an axis of one sample, samples that are not finite floats, attributes of
/// another shape, damage. Memory: 4 bytes per sample and one slice of doubles. Attributes `scale` and
/// `offset`, as an export of integers has them, are applied.
Volume read_hdf5_volume(const std::filesystem::path& file, const std::string& dataset,
                        const VolumeLimits& limits);
/// Slices along z, of a file or of the files of a folder, each of one slice or several. Spacing, origin and
/// unit from ImageJ's tags where they are, else one pixel.
Volume read_tiff_volume(const std::filesystem::path& path, const VolumeLimits& limits);

}  // namespace vdvr
