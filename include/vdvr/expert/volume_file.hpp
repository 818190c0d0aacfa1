// Uniform volumes: MHA (MetaImage) and NRRD, read and written; HDF5 datasets, TIFF stacks and NPY, read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// .mha/.mhd/.nrrd/.nhdr; FILE.h5:/dataset (three axes z, y, x; attributes `spacing` and `origin` in that
/// order, `unit`); FILE.tif of several images; a folder of TIFF images, one a slice, in natural order of
/// their names; FILE.npy (float32 or float64, axes z, y, x). Any integer or floating type becomes float. Axes
/// of MetaImage and NRRD that run along others of the world, or backwards, are put in order; every sample
/// stays at its place. What is no finite float becomes `nan_as`. Throws FileError, without `nan_as` of such
/// samples too; 0: no memory limit.
VDVR_API Volume read_volume(const std::filesystem::path& path, std::uint64_t max_memory_bytes = 0,
                            std::optional<double> nan_as = {});
/// True when read_volume takes it by its name, or as a folder without scan.json that holds TIFF files. An
/// .npy may be projections too: false.
VDVR_API bool is_volume_input(const std::filesystem::path& path);
/// The file of "FILE.h5:/dataset"; the path itself of any other input.
VDVR_API std::filesystem::path file_of_volume(const std::filesystem::path& path);
/// float32, by extension .mha or .nrrd; whole or not at all.
VDVR_API void write_volume(const std::filesystem::path& path, const Volume& volume);

/// The same file from planes that come one after the other.
class VDVR_API VolumeWriter {
 public:
  /// Throws InputError (extension, unit), ResourceError where the disk has no room for the whole.
  VolumeWriter(const std::filesystem::path& path, const Grid& grid);
  ~VolumeWriter();
  VolumeWriter(const VolumeWriter&) = delete;
  VolumeWriter& operator=(const VolumeWriter&) = delete;
  /// The next samples, x fastest.
  void append(std::span<const float> samples);
  /// Puts the file in place. Throws InputError unless all samples of the grid have come, ResourceError.
  void commit();

 private:
  struct File;
  std::unique_ptr<File> file_;
};

/// True when the extension is one of MHA or NRRD.
VDVR_API bool is_volume_path(const std::filesystem::path& path);

}  // namespace vdvr
