#include "host/scan/cone_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "vdvr/error.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr {

namespace fs = std::filesystem;

void require_on_detector(const fs::path& path, double center, std::int64_t columns,
                         const ScanOptions& options) {
  const double last = static_cast<double>(columns) - 0.5;
  if (!(center >= -0.5 && center <= last)) {
    const std::string text =
        fmt::format("{}: centre {} is not on the detector's columns -0.5 to {}", path.string(), center, last);
    if (options.center) throw InputError(text);
    throw FileError(text);
  }
}

namespace {

// All views moved alike, so that the isocentre is seen at column `wanted` on the average. Where it is but for
// the mean's rounding, nothing moves: a certificate's centre gives the matrices that it was made of.
void move_axis(ConeGeometry& cone, double wanted) {
  double mean = 0, largest = 0;
  const auto views = static_cast<double>(cone.views.size());
  for (const ViewMatrix& m : cone.views) {
    mean += m[0][3] / m[2][3] / views;
    largest = std::max(largest, std::abs(m[0][3] / m[2][3]));
  }
  if (std::abs(wanted - mean) <= (2 * views + 4) * 0x1p-53 * largest) return;
  for (ViewMatrix& m : cone.views) m = recentred(m, m[0][3] / m[2][3] + wanted - mean);
}

// The opposite views, which would see what the narrower side does not, do not exist. Who states a full turn
// has it so.
void require_no_displaced_short_scan(const fs::path& path, const ConeGeometry& cone,
                                     const ParallelGeometry& g) {
  const SourceArc arc = source_arc(cone);
  const double below = g.center, above = static_cast<double>(g.columns - 1) - g.center;
  const bool open = cone.redundancy == Redundancy::short_scan ||
                    natural_redundancy(cone, g.columns) == Redundancy::short_scan;
  const bool displaced =
      cone.redundancy == Redundancy::displaced || std::abs(above - below) >= 0.1 * (above + below);
  if (open && displaced && cone.redundancy != Redundancy::full_turn)
    throw FileError(fmt::format(
        "{}: a short scan ({:.1f} degrees) whose axis is seen at column {:.2f} of {}: the opposite views "
        "that would see the far side do not exist; crop the wider side of the detector, or measure a full "
        "turn",
        path.string(), arc.arc_rad * (180 / std::numbers::pi), g.center, g.columns));
}

}  // namespace

void set_cone(const fs::path& path, const io::RawScan& raw, const ScanOptions& options, ProjectionSet& scan) {
  ConeGeometry cone;
  cone.views = raw.cone->geometry.views;
  InputReport& r = scan.report;
  r.source_to_detector = raw.cone->geometry.source_to_detector;
  r.center_source = options.center ? "option" : raw.center ? "file" : raw.cone->geometry.center_source;
  std::optional<double> wanted = raw.center;
  if (options.center) wanted = unbinned_center(*options.center, options.preparation.binning);
  if (wanted) {
    require_on_detector(path, *wanted, raw.columns, options);
    move_axis(cone, *wanted);
    r.notes.push_back(fmt::format("all views were moved so that the axis is at column {:g}, as {} says",
                                  *wanted, options.center ? "`center`" : "scan.json's 'center'"));
  }
  cone.redundancy = raw.cone->redundancy.value_or(natural_redundancy(cone, raw.columns));
  scan.geometry = parallel_limit(cone, raw.columns, raw.rows, raw.unit);
  require_on_detector(path, scan.geometry.center, raw.columns, options);
  if (const std::string& cause = raw.cone->geometry.if_at_edge;
      !cause.empty() && !wanted && std::abs(scan.geometry.center) < 0.5)
    throw FileError(
        fmt::format("{}: the axis falls on the detector's first pixel. {}", path.string(), cause));
  require_no_displaced_short_scan(path, cone, scan.geometry);
  const SourceArc arc = source_arc(cone);
  r.notes.push_back(
      fmt::format("weights of a {} scan, as {}: sources over {:.1f} degrees, axis at column {:.2f}",
                  text_of(cone.redundancy), raw.cone->redundancy ? "scan.json says" : "the views tell",
                  arc.arc_rad * (180 / std::numbers::pi), scan.geometry.center));
  scan.cone = std::move(cone);
}

}  // namespace vdvr
