// The noise of a scan in files; see vdvr/expert/noise.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "host/base/system/casts.hpp"
#include "host/base/system/limits.hpp"
#include "host/field/noise/field_variance.hpp"
#include "host/field/noise/passed_noise.hpp"
#include "host/scan/prepare/upright_rows.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/noise.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr {
namespace {

// As the files have it, but for the centre, which says nothing of the noise: it need not be found.
ScanOptions as_measured(ScanOptions how, const ProjectionSet& scan) {
  if (!scan.cone || how.center)
    how.center =
        unbinned_center(how.center.value_or(stated_center({}, scan.geometry)), how.preparation.binning);
  const bool as_seen = how.preparation.heights == Heights::as_seen;
  how.preparation = {};
  how.preparation.half_acquisition = false;
  how.preparation.heights = as_seen ? Heights::as_seen : scan.report.preparation.heights;
  return how;
}

// Of each sample of upright rows that of the pixel it lies in: S leaves white noise as it is, near enough
// (docs/noise.md).
LineIntegralNoise on_upright_rows(LineIntegralNoise noise, const ParallelGeometry& g) {
  const std::int64_t measured_columns = g.columns + 2 * g.extension.cut;
  for (std::vector<float>* values : {&noise.photon, &noise.read}) {
    const std::int64_t measured_rows = std::ssize(*values) / measured_columns;
    if (measured_rows <= g.rows) continue;
    std::vector<float> upright;
    for (std::int64_t row = 0; row < g.rows; ++row)
      for (std::int64_t column = 0; column < g.columns; ++column)
        upright.push_back((*values)[at(nearest_pixel(g, measured_rows, measured_columns, row, column))]);
    *values = std::move(upright);
  }
  return noise;
}

// Of flats, pixel by pixel, at the heights that all views see: of the measured row that lies there where the
// sample stood in the middle.
std::optional<LineIntegralNoise> noise_of_flats(const std::filesystem::path& path, const ScanOptions& how,
                                                const ParallelGeometry& g) {
  std::optional<LineIntegralNoise> noise = read_line_noise(path, how);
  if (!noise || !g.extension.common_heights) return noise;
  if (g.axis_roll_deg != 0) return on_upright_rows(std::move(*noise), own_detector(g));
  const std::int64_t columns = own_detector(g).columns;
  for (std::vector<float>* values : {&noise->photon, &noise->read}) {
    const std::int64_t rows = std::ssize(*values) / columns;
    if (rows <= g.rows) continue;
    const auto first = values->begin() + (rows - g.rows) / 2 * columns;
    *values = {first, first + g.rows * columns};
  }
  return noise;
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
    found = scan_noise(unprepared, options, noise_of_flats(path, measured, unprepared.geometry), why);
  }
  if (!found) return found;
  found->model = passed_noise(found->model, rows, columns, scan, how.max_memory_bytes);
  found->passed = passed_share({}, found->model.spectrum);
  found->words += fmt::format("; {:.3g} of their variance is left after {}", found->passed,
                              text_of(scan.report.preparation));
  return found;
}

// Views of the longest stand at one height; of a helix, which has none, all.
ProjectionSet one_stand(ProjectionSet seen, std::uint64_t max_memory_bytes) {
  ParallelGeometry& g = seen.geometry;
  constexpr std::int64_t fewest_views = 16;
  std::map<double, std::int64_t> stands;
  for (const double shift : g.row_shift) ++stands[shift];
  const auto longest = std::max_element(stands.begin(), stands.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  if (longest == stands.end() || longest->second < fewest_views) return seen;
  const std::int64_t plane = g.rows * g.columns;
  ParallelGeometry own = g;
  own.theta_rad.clear();
  own.column_shift.clear();
  own.row_shift.clear();
  io::require_memory(seen.data.resident_bytes() + count(longest->second * plane) * sizeof(float),
                     max_memory_bytes, "the noise of a stand");
  std::vector<float> data;
  for (std::int64_t k = 0; k < g.views(); ++k) {
    if (g.row_shift[at(k)] != longest->first) continue;
    own.theta_rad.push_back(g.theta_rad[at(k)]);
    if (!g.column_shift.empty()) own.column_shift.push_back(g.column_shift[at(k)]);
    data.insert(data.end(), seen.data.begin() + k * plane, seen.data.begin() + (k + 1) * plane);
  }
  seen.data = SampleArray(std::move(data));
  g = std::move(own);
  return seen;
}

// Noise is of views as they were measured; SampleVariance follows it into the series.
std::optional<ScanNoise> of_series(const std::filesystem::path& path, ScanOptions how,
                                   const ProjectionSet& scan, const NoiseOptions& options, std::string* why,
                                   const Progress& progress) {
  if (options.photons || options.sigma_p) return scan_noise(scan, options, {}, why);
  how.preparation.heights = Heights::as_seen;
  how.preparation.half_acquisition = false;
  how.preparation.padding = Padding::none;
  if (!how.center) how.center = stated_center({}, scan.geometry);
  const ProjectionSet seen = one_stand(read_scan(path, how, progress), how.max_memory_bytes);
  if (seen.report.sha256 != scan.report.sha256)
    throw FileError(path.string() + ": was changed while it was read; start again once it is whole");
  return read_scan_noise(path, how, seen, options, why, progress);
}

}  // namespace

std::optional<ScanNoise> read_scan_noise(const std::filesystem::path& path, const ScanOptions& how,
                                         const ProjectionSet& scan, const NoiseOptions& options,
                                         std::string* why, const Progress& progress) {
  const bool is_series = !scan.geometry.series.none();
  if (!is_series && scan.geometry.extension != own_detector(scan.geometry).extension)
    return read_scan_noise(path, how, own_rows(scan), options, why, progress);
  if (!is_series && !changes_noise(scan.report.preparation)) {
    const bool stated = options.photons || options.sigma_p;
    return scan_noise(scan, options, stated ? std::nullopt : noise_of_flats(path, how, scan.geometry), why);
  }
  try {
    return is_series ? of_series(path, how, scan, options, why, progress)
                     : of_prepared(path, how, scan, options, why, progress);
  } catch (const ResourceError& e) {
    // No build fails for want of it.
    if (why) *why = e.what();
    return std::nullopt;
  }
}

}  // namespace vdvr
