// Uniform volumes that are not one raster file: a dataset of an HDF5 file, a TIFF file of several images, a
// folder of TIFF slices. Called by volume_file.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "vdvr/grid.hpp"

namespace vdvr {

/// "FILE.h5:/dataset" in its two parts; nothing when the name is not of that form.
std::optional<std::pair<std::filesystem::path, std::string>> hdf5_volume_path(
    const std::filesystem::path& path);
bool is_tiff_path(const std::filesystem::path& path);
/// A folder without scan.json that holds TIFF files.
bool is_tiff_folder(const std::filesystem::path& path);

/// Throws FileError: not three axes, an axis of one sample, samples that are not finite floats, attributes of
/// another shape, damage. Memory: 4 bytes per sample and one slice of doubles.
Volume read_hdf5_volume(const std::filesystem::path& file, const std::string& dataset,
                        std::uint64_t max_memory_bytes);
/// Slices along z. Spacing and unit from ImageJ's tags where they are, else one pixel.
Volume read_tiff_volume(const std::filesystem::path& path, std::uint64_t max_memory_bytes);

}  // namespace vdvr
