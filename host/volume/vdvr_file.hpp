// A .vdvr file opened to be read in parts: everything but samples is there.
#pragma once

#include <filesystem>
#include <map>
#include <memory>

#include "host/files/hdf5/hdf5_reader.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {

struct VdvrParts {
  std::unique_ptr<io::hdf5::Reader> reader;
  /// Checked as read_vdvr checks it, but for samples: blocks of `volume` have their types, offsets and shifts
  /// and no samples yet. `altered` speaks of the seal alone, since the content's hash is over all samples.
  VdvrFile file;
  io::hdf5::Dataset base;
  std::map<TileKind, io::hdf5::Dataset> tiles;
};

/// Throws what read_vdvr throws.
VdvrParts open_parts(const std::filesystem::path& path, std::uint64_t max_memory_bytes);

}  // namespace vdvr
