// The .vdvr file: HDF5, readable with h5py, MATLAB, HDFView (docs/file-format.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "vdvr/certificate.hpp"
#include "vdvr/mixed_volume.hpp"

namespace vdvr {

struct VdvrFile {
  MixedVolume volume;
  Certificate certificate;
  std::string certificate_json;  ///< as stored
  std::string generator;
  int format_version = 1;
  std::uint64_t file_bytes = 0;
};

/// How samples and index lie in the file; what they decode to, and its hash, are the same.
enum class Compression { none, deflate };

/// Written whole or not at all, chunked, deflated or not, with Fletcher32 checksums. An empty content_sha256
/// in the certificate is filled in; any other is stored as given. Throws InputError for a volume that
/// read_vdvr would refuse or a certificate that is not finite, FileError (folder), ResourceError (disk). Not
/// thread-safe with other users of HDF5.
void write_vdvr(const std::filesystem::path& path, const MixedVolume& volume, const Certificate& certificate,
                Compression compression = Compression::deflate);

/// Reads and checks everything: types, shapes in 64 bits before allocating, tile indices, finite geometry,
/// checksums. Throws FileError (path, dataset, value). Does not compare the content hash: see content_sha256.
/// `max_memory_bytes` 0: no limit.
VdvrFile read_vdvr(const std::filesystem::path& path, std::uint64_t max_memory_bytes = 0);

/// True when the file begins like HDF5 and says format = "vdvr".
bool is_vdvr(const std::filesystem::path& path);

/// SHA-256 over grid attributes, step, base, level, tile, tiles, offsets, shifts in that order
/// (docs/file-format.md).
std::string content_sha256(const MixedVolume& volume);

}  // namespace vdvr
