// A certified volume as files that other programs open. Uniform ones are MetaImage, NRRD, TIFF, HDF5, NPY,
// raw and OME-Zarr; VTK's keep the mixed resolution (export_vtk.hpp). docs/exports.md says what is exact.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {

enum class ExportFormat { mha, nrrd, npy, raw, tiff, hdf5, ome_zarr, vtm };
/// "mha", "nrrd", "npy", "raw", "tiff", "hdf5", "ome-zarr", "vtm".
VDVR_API const char* text_of(ExportFormat format);
/// By the ending of a name: .mha .nrrd .npy .raw .tif .tiff .h5 .hdf5 .zarr .vtm.
VDVR_API std::optional<ExportFormat> export_format_of(const std::filesystem::path& path);

struct ExportOptions {
  ExportFormat format = ExportFormat::mha;
  /// Samples per cell of the grid and axis, a power of two. In OME-Zarr it is the finest level's, and each
  /// other level has half, down to 1. VTK's blocks have their own.
  int oversampling = 1;
  /// u16 and u8 (npy, raw, tiff, hdf5): integers 0 to 2^bits - 1, value = offset + scale * integer.
  SampleType samples = SampleType::f32;
  /// The range that the integers span; by default least and largest value of the stored samples. Values
  /// beyond become the first or last integer.
  std::optional<std::pair<double, double>> range;
  Compression compression = Compression::deflate;  ///< hdf5, ome_zarr and vtm; the others have none
  std::size_t most_blocks = 2000;                  ///< vtm: as in VtkOptions
  std::uint64_t max_memory_bytes = 0;              ///< of the volume and this work together; 0: no limit
};

struct ExportResult {
  Grid grid;                     ///< of the (finest) samples; of VTK the volume's
  std::uint64_t samples = 0;     ///< written, all levels or blocks together
  std::uint64_t bytes = 0;       ///< of all files
  std::size_t blocks = 0;        ///< vtm
  double scale = 1, offset = 0;  ///< value = offset + scale * stored
  std::uint64_t clipped = 0;     ///< values outside of `range`
  /// No brick is finer than the exported samples: at covered points between them trilinear interpolation of
  /// float32 samples is within epsilon + `jump` of F. Else |exported - F| <= epsilon at the samples only.
  bool exact_between_samples = false;
  /// How far bricks of different triples disagree on their common faces, where integers were rounded:
  /// measured, 0 but for rounding in volumes of float32.
  double jump = 0;
};

/// Files and folders that an export to `path` puts in place, the one that tells of completeness last.
VDVR_API std::vector<std::filesystem::path> export_outputs(const std::filesystem::path& path,
                                                           ExportFormat format);

/// Writes them, each whole or not at all. TIFF is a file of pages where the name ends in .tif or .tiff, else
/// a folder of slices and a volume.json. Work is spread over the cores. Memory: the volume, and up to 64 MiB
/// (or one plane of samples, if that is more); the exported volume is never whole. Cost: about 20 ns a sample
/// and core, and compression. Throws InputError (options, unit; a folder in the way that holds something else
/// than an export), ResourceError (memory, disk), FileError, Interrupted.
VDVR_API ExportResult export_volume(const VdvrFile& file, const std::filesystem::path& path,
                                    const ExportOptions& options, const Progress& progress = {});

/// Throws, before anything is computed, where UniformWriter refuses its options or what lies in the way.
VDVR_API void check_uniform_output(const std::filesystem::path& path, const ExportOptions& options);

/// A uniform volume whose planes come one after the other, in any of these formats but vtm, by the same code.
/// OME-Zarr has one level then. Memory: up to 64 MiB, or one plane.
class VDVR_API UniformWriter {
 public:
  /// `oversampling` is 1; integers need a `range`. Throws as check_uniform_output and export_volume.
  UniformWriter(const std::filesystem::path& path, const Grid& grid, const ExportOptions& options);
  ~UniformWriter();
  UniformWriter(const UniformWriter&) = delete;
  UniformWriter& operator=(const UniformWriter&) = delete;
  /// The next samples, x fastest. Runs on all cores.
  void append(std::span<const float> samples);
  /// Puts files in place, whole; without it nothing appears. Throws InputError unless all samples have come,
  /// ResourceError, Interrupted.
  ExportResult commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Where sigma goes beside a volume: NAME-sigma with the volume's ending.
VDVR_API std::filesystem::path sigma_path(const std::filesystem::path& volume);
/// Sigma of F (Certificate::brick_sigma), float32, at the samples of `grid`, the grid of an exported volume,
/// in the same format but vtm. Throws InputError where the certificate does not know it, and as
/// UniformWriter.
VDVR_API ExportResult export_sigma(const VdvrFile& file, const std::filesystem::path& path, const Grid& grid,
                                   const ExportOptions& options, const Progress& progress = {});

/// log2 of samples per cell along x, y, z of the finest brick: at this rate uniform samples hold all of V.
VDVR_API std::array<int, 3> finest_per_cell(const MixedVolume& volume);

}  // namespace vdvr
