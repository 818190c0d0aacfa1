#include "apps/vdvr/cone.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/vdvr/understood.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/rtk_geometry.hpp"

namespace vdvr::cli {
namespace {

/// The smallest and the largest over all views.
struct Span {
  double low = 0, high = 0;

  void add(double value, bool first) {
    low = first ? value : std::min(low, value);
    high = first ? value : std::max(high, value);
  }
  [[nodiscard]] double middle() const { return 0.5 * (low + high); }
};

struct Summary {
  Span source_to_axis, pitch_u, pitch_v, center, row, in_plane, out_of_plane;
  double half_fan = 0, half_cone = 0;  ///< rad, at the detector's farther edges
};

// Angles of the detector about the normal through the source. A mirrored or skew detector has none.
void add_tilts(const ViewMatrix& matrix, const ConeView& view, bool first, Summary& s) {
  try {
    const CircularView v = circular_parameters(matrix, view.pitch_u, view.pitch_v, view.center, view.row);
    s.in_plane.add(v.in_plane_rad, first);
    s.out_of_plane.add(v.out_of_plane_rad, first);
  } catch (const InputError&) {
  }
}

Summary summary(const ProjectionSet& scan) {
  const ParallelGeometry& g = scan.geometry;
  Summary s;
  for (std::size_t k = 0; k < scan.cone->views.size(); ++k) {
    const ConeView v = cone_view(scan.cone->views[k]);
    s.source_to_axis.add(v.source_to_axis, k == 0);
    s.pitch_u.add(v.pitch_u, k == 0);
    s.pitch_v.add(v.pitch_v, k == 0);
    s.center.add(v.center, k == 0);
    s.row.add(v.row, k == 0);
    add_tilts(scan.cone->views[k], v, k == 0, s);
    const auto half = [&](double middle, std::int64_t count, double pitch) {
      const double reach = std::max(middle + 0.5, static_cast<double>(count) - 0.5 - middle);
      return std::atan(reach * pitch / v.source_to_axis);
    };
    s.half_fan = std::max(s.half_fan, half(v.center, g.columns, v.pitch_u));
    s.half_cone = std::max(s.half_cone, half(v.row, g.rows, v.pitch_v));
  }
  return s;
}

std::string span_text(const Span& s, double unit = 1) {
  if (s.high - s.low <= 1e-9 * std::abs(s.high)) return fmt::format("{:.6g}", s.middle() * unit);
  return fmt::format("{:.6g} to {:.6g}", s.low * unit, s.high * unit);
}

Json span_json(const Span& s, double unit = 1) {
  return Json(std::vector<double>{s.low * unit, s.high * unit});
}

/// [view][row][column]
Json matrices_json(const ConeGeometry& cone) {
  std::vector<std::vector<std::vector<double>>> all;
  for (const ViewMatrix& matrix : cone.views) {
    all.emplace_back();
    for (const auto& row : matrix) all.back().emplace_back(row.begin(), row.end());
  }
  return Json(all);
}

}  // namespace

Json cone_json(const ProjectionSet& scan) {
  const Summary s = summary(scan);
  const SourceArc arc = source_arc(*scan.cone);
  Json json = {{"source_to_axis", span_json(s.source_to_axis)},
               {"pitch_u_at_axis", span_json(s.pitch_u)},
               {"pitch_v_at_axis", span_json(s.pitch_v)},
               {"center", span_json(s.center)},
               {"row", span_json(s.row)},
               {"half_fan_deg", s.half_fan * degrees_per_radian},
               {"half_cone_deg", s.half_cone * degrees_per_radian},
               {"arc_deg", arc.arc_rad * degrees_per_radian},
               {"in_plane_deg", span_json(s.in_plane, degrees_per_radian)},
               {"out_of_plane_deg", span_json(s.out_of_plane, degrees_per_radian)},
               {"redundancy", text_of(scan.cone->redundancy)},
               {"matrices", matrices_json(*scan.cone)}};
  if (const double detector = scan.report.source_to_detector; detector > 0) {
    json["source_to_detector"] = detector;
    json["magnification"] = detector / s.source_to_axis.middle();
  }
  return json;
}

void print_cone(const ProjectionSet& scan) {
  const Summary s = summary(scan);
  const std::string& unit = scan.geometry.unit;
  fmt::print("  cone beam    source to axis {} {}", span_text(s.source_to_axis), unit);
  if (const double detector = scan.report.source_to_detector; detector > 0)
    fmt::print(", to detector {:.6g} {}, magnification {:.4g}", detector, unit,
               detector / s.source_to_axis.middle());
  fmt::print("\n  at the axis  pitch {} x {} {}, isocentre at column {} and row {}\n", span_text(s.pitch_u),
             span_text(s.pitch_v), unit, span_text(s.center), span_text(s.row));
  fmt::print("  angles       half fan {:.2f}, half cone {:.2f}, arc {:.2f} degrees ({})\n",
             s.half_fan * degrees_per_radian, s.half_cone * degrees_per_radian,
             source_arc(*scan.cone).arc_rad * degrees_per_radian, text_of(scan.cone->redundancy));
  const double largest = std::max({std::abs(s.in_plane.low), std::abs(s.in_plane.high),
                                   std::abs(s.out_of_plane.low), std::abs(s.out_of_plane.high)});
  if (largest > 1e-9)
    fmt::print("  tilt         in plane {}, out of plane {} degrees\n",
               span_text(s.in_plane, degrees_per_radian), span_text(s.out_of_plane, degrees_per_radian));
}

}  // namespace vdvr::cli
