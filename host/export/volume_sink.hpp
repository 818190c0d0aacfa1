// Where planes of a uniform volume go, one slab after the other: the interface of the formats' writers, and
// those that are a header and samples.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "host/export/export_note.hpp"

namespace vdvr {

class VolumeSink {
 public:
  VolumeSink() = default;
  VolumeSink(const VolumeSink&) = delete;
  VolumeSink& operator=(const VolumeSink&) = delete;
  virtual ~VolumeSink() = default;
  /// Planes that come together: every slab but the last has a multiple.
  [[nodiscard]] virtual std::int64_t planes_together() const { return 1; }
  /// Planes from number `first` on, in the note's type, x fastest. They come in order.
  virtual void put(std::int64_t first, std::span<const std::byte> planes) = 0;
  /// Puts the files in place; how many bytes they have. Throws ResourceError.
  virtual std::uint64_t commit() = 0;
};

/// MetaImage and NRRD by vdvr::VolumeWriter, float32.
std::unique_ptr<VolumeSink> raster_sink(const std::filesystem::path& path, const ExportNote& note);
/// NumPy's .npy, version 1.0, or bare samples; PATH.json beside it says what neither can.
std::unique_ptr<VolumeSink> flat_sink(const std::filesystem::path& path, const ExportNote& note, bool npy);
/// The JSON beside `path`.
std::filesystem::path note_path(const std::filesystem::path& path);

/// ResourceError where the disk of `beside`, a file or folder that exists, has no room for `bytes`.
void require_disk(const std::filesystem::path& shown, const std::filesystem::path& beside,
                  std::uint64_t bytes);

}  // namespace vdvr
