// TIFF by libtiff: one file of pages, or a folder of slices.
#pragma once

#include "host/export/volume_sink.hpp"

namespace vdvr {

/// True where `path` means a file: its name ends in .tif or .tiff.
bool is_tiff_file_name(const std::filesystem::path& path);

/// A page per plane, uncompressed, with ImageJ's description; BigTIFF where 4 GiB would not hold it.
std::unique_ptr<VolumeSink> tiff_pages_sink(const std::filesystem::path& path, const ExportNote& note);
/// slice_00000.tif and so on, and volume.json. Slices of a slab are written on all cores.
std::unique_ptr<VolumeSink> tiff_folder_sink(const std::filesystem::path& path, const ExportNote& note);

}  // namespace vdvr
