// The .vdvr file: HDF5, readable with h5py, MATLAB, HDFView (docs/file-format.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

/// Whether certificate, totals by brick and attributes are those that were written together. It is no
/// signature: whoever changes a file can seal it again, which only `verify` finds.
enum class Seal {
  none,  ///< a file of an earlier version, or one that was written anew without
  whole,
  broken,
};
/// "unsealed", "sealed", "BROKEN SEAL".
VDVR_API const char* text_of(Seal seal);

struct VdvrFile {
  MixedVolume volume;
  Certificate certificate;       ///< or, where it says so, the record of a comparison
  std::string certificate_json;  ///< as stored
  std::string generator;
  int format_version = 1;
  std::uint64_t file_bytes = 0;
  Seal seal = Seal::none;
  std::string altered;  ///< one line: what is not as it was written; empty where all that is hashed is
};

/// The treatment of a file that reads well and is not as it was written.
enum class Altered {
  refuse,  ///< MismatchError
  report,  ///< in VdvrFile::altered
};

/// How samples and index lie in the file. They decode to the same values, with the same hash.
enum class Compression { none, deflate };

/// Written whole or not at all, chunked, deflated or not, with Fletcher32 checksums, and sealed. An empty
/// content_sha256 in the certificate is filled in; any other is stored as given. Throws InputError for a
/// volume that read_vdvr would refuse or a certificate that is not finite, FileError (folder), ResourceError
/// (disk). Not thread-safe with other users of HDF5.
VDVR_API void write_vdvr(const std::filesystem::path& path, const MixedVolume& volume,
                         const Certificate& certificate, Compression compression = Compression::deflate);

/// Reads and checks everything: types, shapes in 64 bits before allocating, tile indices, finite geometry,
/// checksums; then compares the seal and the content's hash. Throws FileError (path, dataset, value), and
/// MismatchError for a file that was altered, unless it is to be reported. `max_memory_bytes` 0: no limit.
VDVR_API VdvrFile read_vdvr(const std::filesystem::path& path, std::uint64_t max_memory_bytes = 0,
                            Altered altered = Altered::refuse);

/// read_vdvr, but that samples of more than a quarter of the limit lie in scratch files in `scratch` (empty:
/// the default folder of scratch.hpp). An eighth of the limit may be resident of these. Whoever reads them
/// needs not know. Throws as read_vdvr, and ResourceError naming the folder where it has no room.
VDVR_API VdvrFile read_large_vdvr(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                                  const std::filesystem::path& scratch, Altered altered = Altered::refuse);

/// True when the file begins like HDF5 and says format = "vdvr".
VDVR_API bool is_vdvr(const std::filesystem::path& path);

/// SHA-256 over grid attributes, step, base, level, tile, tiles, offsets, shifts in that order
/// (docs/file-format.md).
VDVR_API std::string content_sha256(const MixedVolume& volume);

}  // namespace vdvr
