// OME-Zarr 0.5: a Zarr v3 group of arrays, one a level, each a folder of chunks.
#pragma once

#include <filesystem>

#include "host/export/volume_sink.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

struct ZarrTotals {
  std::uint64_t samples = 0, bytes = 0;
};

/// Levels at 2^finest, ..., 2, 1 samples a cell, finest first, as arrays "0", "1", ... Every level is V at
/// its own samples, no average. `note` is of the finest. Chunks are made on all cores, each from V itself:
/// memory is a few MiB a core.
ZarrTotals write_ome_zarr(const VdvrFile& file, const std::filesystem::path& path, const ExportNote& note,
                          int finest, const ExportOptions& options, const Progress& progress);

/// One level, of planes that come one after the other; of these `most_bytes` are kept, or one.
std::unique_ptr<VolumeSink> ome_zarr_sink(const std::filesystem::path& path, const ExportNote& note,
                                          Compression compression, std::uint64_t most_bytes);

}  // namespace vdvr
