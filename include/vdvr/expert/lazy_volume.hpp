// A .vdvr file that stays on the disk: V on lattices of points, for which only the chunks of samples are read
// that hold something of the bricks asked for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "vdvr/api.hpp"
#include "vdvr/expert/certified_points.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {

class VDVR_API LazyVolume {
 public:
  /// Reads grid, index, certificate and seal, and no sample. Throws what read_vdvr throws. Each chunk is
  /// compared with its checksum when it is read; the content's hash, which is over all samples, is not
  /// compared: read_vdvr does that. `max_memory_bytes`: of samples at a time (0: no limit).
  explicit LazyVolume(const std::filesystem::path& path, std::uint64_t max_memory_bytes = 0);
  ~LazyVolume();
  LazyVolume(const LazyVolume&) = delete;
  LazyVolume& operator=(const LazyVolume&) = delete;

  [[nodiscard]] const Grid& grid() const;
  [[nodiscard]] const VdvrFile& file() const;  ///< of whose samples only those are there that were read

  /// As values_on of certified_points.hpp, to the bit. What was read stays in memory. Throws FileError for a
  /// damaged chunk, ResourceError. Not thread-safe, nor with other users of HDF5.
  void values_on(const Lattice& lattice, std::span<float> out, const Progress& progress = {});
  /// As CertifiedPoints::bounds; reads no sample.
  void bounds_on(const Lattice& lattice, std::span<float> out, const Progress& progress = {}) const;

  /// Of samples, as they are stored: read so far, and in the file.
  [[nodiscard]] std::uint64_t bytes_read() const;
  [[nodiscard]] std::uint64_t bytes_stored() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdvr
