// The noise of a scan in files; see vdvr/expert/noise.hpp.
#include <fmt/format.h>

#include "host/field/noise/field_variance.hpp"
#include "host/field/noise/passed_noise.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/noise.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr {
namespace {

// As the files have it, but for the centre, which says nothing of the noise: it need not be found.
ScanOptions as_measured(ScanOptions how, const ProjectionSet& scan) {
  if (!scan.cone || how.center)
    how.center = unbinned_center(how.center.value_or(scan.geometry.center), how.preparation.binning);
  how.preparation = {};
  how.preparation.half_acquisition = false;
  return how;
}

std::optional<ScanNoise> of_prepared(const std::filesystem::path& path, const ScanOptions& how,
                                     const ProjectionSet& scan, const NoiseOptions& options, std::string* why,
                                     const Progress& progress) {
  const int b = scan.report.preparation.binning;
  std::int64_t rows = scan.geometry.rows * b, columns = scan.geometry.columns * b;
  std::optional<ScanNoise> found;
  if (options.photons || options.sigma_p) {
    found = scan_noise({scan.geometry, {}, {}, {}}, options);
  } else {
    const ScanOptions measured = as_measured(how, scan);
    const ProjectionSet unprepared = read_scan(path, measured, progress);
    if (unprepared.report.sha256 != scan.report.sha256)
      throw FileError(path.string() + ": was changed while it was read; start again once it is whole");
    rows = unprepared.geometry.rows;
    columns = unprepared.geometry.columns;
    found = scan_noise(unprepared, options, read_line_noise(path, measured), why);
  }
  if (!found) return found;
  found->model = passed_noise(found->model, rows, columns, scan, how.max_memory_bytes);
  found->passed = passed_share({}, found->model.spectrum);
  found->words += fmt::format("; {:.3g} of their variance is left after {}", found->passed,
                              text_of(scan.report.preparation));
  return found;
}

}  // namespace

std::optional<ScanNoise> read_scan_noise(const std::filesystem::path& path, const ScanOptions& how,
                                         const ProjectionSet& scan, const NoiseOptions& options,
                                         std::string* why, const Progress& progress) {
  if (scan.geometry.extension != RowExtension{})
    return read_scan_noise(path, how, own_rows(scan), options, why, progress);
  if (!changes_noise(scan.report.preparation)) {
    const bool stated = options.photons || options.sigma_p;
    return scan_noise(scan, options, stated ? std::nullopt : read_line_noise(path, how), why);
  }
  try {
    return of_prepared(path, how, scan, options, why, progress);
  } catch (const ResourceError& e) {
    // No build fails for want of it.
    if (why) *why = e.what();
    return std::nullopt;
  }
}

}  // namespace vdvr
