// A file's whole promise held to its projections: seal, hash, certificate and field. `vdvr verify` does this.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/expert/verify.hpp"
#include "vdvr/vdvr_file.hpp"

namespace vdvr {

/// read_vdvr for whoever relies on the certificate: refuses an altered file, and a certificate whose own
/// numbers do not follow from each other. Throws as read_vdvr, MismatchError naming the path.
VDVR_API VdvrFile read_certified(const std::filesystem::path& path, std::uint64_t max_memory_bytes = 0);

/// The same by read_large_vdvr.
VDVR_API VdvrFile read_large_certified(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                                       const std::filesystem::path& scratch);

/// read_certified for verify_file: altered samples stay in VdvrFile::altered, since they can be measured.
/// Throws MismatchError for a broken seal over samples that are whole, since a certificate that is not the
/// one written has nothing to compare with. Throws MismatchError also for a certificate that contradicts
/// itself, and for a volume for comparison, which promises nothing.
VDVR_API VdvrFile read_to_verify(const std::filesystem::path& path, std::uint64_t max_memory_bytes = 0);

/// Throws MismatchError unless the certificate is of these projections.
VDVR_API void check_input(const ProjectionSet& scan, const Certificate& certificate);

struct FileVerification {
  VerifyResult measured;
  bool exhaustive = false;       ///< as asked for, and of altered contents always
  bool content_matches = false;  ///< samples and index are those that the certificate is of
  bool holds = false;            ///< content and field
  std::string failure;           ///< one line; empty when it holds
};

/// Verifies a file that read_to_verify gave. `scan` may be read with any centre: F is the certificate's.
/// Throws MismatchError for other projections, and as verify.
VDVR_API FileVerification verify_file(Device& device, const VdvrFile& file, const ProjectionSet& scan,
                                      const VerifyOptions& options = {}, const Progress& progress = {});

/// Reads and verifies. Throws as read_to_verify too.
VDVR_API FileVerification verify_file(Device& device, const std::filesystem::path& file,
                                      const ProjectionSet& scan, const VerifyOptions& options = {},
                                      const Progress& progress = {});

}  // namespace vdvr
