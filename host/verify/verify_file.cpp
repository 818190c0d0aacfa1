// Files held to their projections.
#include "vdvr/verify_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr {
namespace {

void check_consistency(const std::filesystem::path& path, const Certificate& c) {
  if (const std::string what = contradiction(c); !what.empty())
    throw MismatchError(fmt::format("{}: the certificate contradicts itself: {}", path.string(), what));
}

}  // namespace

VdvrFile read_certified(const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  VdvrFile file = read_vdvr(path, max_memory_bytes, Altered::refuse);
  check_consistency(path, file.certificate);
  return file;
}

VdvrFile read_large_certified(const std::filesystem::path& path, std::uint64_t max_memory_bytes,
                              const std::filesystem::path& scratch) {
  VdvrFile file = read_large_vdvr(path, max_memory_bytes, scratch, Altered::refuse);
  check_consistency(path, file.certificate);
  return file;
}

VdvrFile read_to_verify(const std::filesystem::path& path, std::uint64_t max_memory_bytes) {
  VdvrFile file = read_vdvr(path, max_memory_bytes, Altered::report);
  if (file.seal == Seal::broken && content_sha256(file.volume) == file.certificate.content_sha256)
    throw MismatchError(fmt::format("{}: {}", path.string(), file.altered));
  if (file.altered.empty()) check_consistency(path, file.certificate);
  if (file.certificate.comparison)
    throw MismatchError(
        fmt::format("{}: was built for comparison: it carries no promise to verify", path.string()));
  return file;
}

void check_input(const ProjectionSet& scan, const Certificate& c) {
  if (scan.report.sha256 == c.input_sha256) {
    if (scan.report.preparation == c.field.preparation) return;
    throw MismatchError(fmt::format("these projections were prepared by: {}; the volume's were by: {}",
                                    text_of(scan.report.preparation), text_of(c.field.preparation)));
  }
  throw MismatchError(fmt::format(
      "these are other projections: found {} of {} x {} x {} (views, rows, columns), sha256 {}; the volume "
      "was built from {} of {} with sha256 {}",
      scan.report.name, scan.geometry.views(), scan.geometry.rows, own_detector(scan.geometry).columns,
      scan.report.sha256, c.input_name, fmt::join(c.input_shape, " x "), c.input_sha256));
}

FileVerification verify_file(Device& device, const VdvrFile& file, const ProjectionSet& scan,
                             const VerifyOptions& options, const Progress& progress) {
  check_input(scan, file.certificate);
  VerifyOptions used = options;
  // An altered content may err anywhere: say where it does.
  used.exhaustive = options.exhaustive || !file.altered.empty();
  FileVerification result;
  result.exhaustive = used.exhaustive;
  result.content_matches = file.altered.empty();
  result.measured = verify(device, scan, file.volume, file.certificate, used, progress);
  result.holds = result.content_matches && result.measured.holds;
  result.failure = result.measured.failure;
  if (!result.content_matches)
    result.failure =
        fmt::format("{}; {}", file.altered,
                    result.measured.holds ? "it is still within epsilon everywhere tested" : result.failure);
  return result;
}

FileVerification verify_file(Device& device, const std::filesystem::path& file, const ProjectionSet& scan,
                             const VerifyOptions& options, const Progress& progress) {
  return verify_file(device, read_to_verify(file), scan, options, progress);
}

}  // namespace vdvr
