// Angular weights from the gaps between directions modulo pi or 2 pi.
#include "host/scan/geometry/view_weights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "host/scan/geometry/angular_gaps.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// A wedge is weighed as so many usual gaps: as wide as a gap may be without doubt.
constexpr double most_usual_gaps = 4;

double degrees(double radians) { return radians * (180 / std::numbers::pi); }

std::string text_of_wedges(const std::vector<double>& widths) {
  if (widths.size() == 1) return fmt::format("a wedge of {:.1f} degrees", degrees(widths.front()));
  return fmt::format("{} wedges, the widest of {:.1f} degrees", widths.size(), degrees(widths.front()));
}

std::vector<std::string> notes_of(const AngularGaps& gaps, const std::vector<double>& wedges,
                                  int grouped_views) {
  std::vector<std::string> notes;
  if (!wedges.empty())
    notes.push_back(
        fmt::format("limited angle: no view sees {}, where views are usually {:.3g} degrees apart; weights "
                    "beside it are those of four such gaps, and densities fall short",
                    text_of_wedges(wedges), degrees(gaps.usual_rad)));
  if (gaps.doubtful)
    notes.push_back(fmt::format(
        "unequal angles: gaps between views reach {:.3g} degrees, and half of what was seen lies in gaps up "
        "to {:.3g}; the views beside a gap count for it, and what moves faster than that is lost there",
        degrees(gaps.widest_filled_rad()), degrees(gaps.usual_rad)));
  if (grouped_views > 0)
    notes.push_back(fmt::format("{} coincident views share their weights", grouped_views));
  return notes;
}

}  // namespace

ViewWeights view_weights(const std::vector<double>& theta_rad, double period, Arc arc) {
  ViewWeights result;
  result.weight.assign(theta_rad.size(), 0.0);
  if (theta_rad.empty()) return result;
  const AngularGaps gaps = angular_gaps(theta_rad, period);
  std::vector<double> wedges = gaps.wedges_rad();
  if (arc == Arc::open && !wedges.empty()) wedges.erase(wedges.begin());
  result.wedges = static_cast<int>(wedges.size());
  result.one_direction = gaps.one_direction;
  result.seen_rad = period;
  for (const double wedge : gaps.wedges_rad()) result.seen_rad -= wedge;
  const auto width = [&](const Direction& direction) {
    return direction.wedge_after ? std::min(direction.gap_after_rad, most_usual_gaps * gaps.usual_rad)
                                 : direction.gap_after_rad;
  };
  const std::size_t m = gaps.directions.size();
  for (std::size_t d = 0; d < m; ++d) {
    const std::vector<std::size_t>& views = gaps.directions[d].views;
    if (views.size() > 1) result.grouped_views += static_cast<int>(views.size());
    const double before = width(gaps.directions[(d + m - 1) % m]), after = width(gaps.directions[d]);
    for (const std::size_t k : views)
      result.weight[k] = 0.5 * (before + after) / static_cast<double>(views.size());
  }
  result.notes = notes_of(gaps, wedges, result.grouped_views);
  return result;
}

ViewWeights view_weights(const ParallelGeometry& g) {
  if (!g.extension.half_acquisition.value_or(false)) return view_weights(g.theta_rad);
  ViewWeights weights = view_weights(g.theta_rad, 2 * std::numbers::pi);
  for (double& w : weights.weight) w *= 0.5;
  return weights;
}

void require_directions(const ViewWeights& weights) {
  if (weights.one_direction)
    throw InputError(
        fmt::format("all {} views see one direction: their angles are alike, or opposite; a volume from one "
                    "direction is worthless: give each view its own angle",
                    weights.weight.size()));
  // A whole turn in radians, read as degrees.
  constexpr double longest_turn_deg = 2 * std::numbers::pi;
  if (degrees(weights.seen_rad) <= 1.01 * longest_turn_deg)
    throw InputError(fmt::format(
        "all {} views lie within {:.2f} degrees: a volume from so short an arc is worthless. If these angles "
        "are radians, say so by `angle_unit` radians",
        weights.weight.size(), degrees(weights.seen_rad)));
}

}  // namespace vdvr
