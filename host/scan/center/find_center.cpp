// The centre by every method that applies, and how sure they make it.
#include "vdvr/expert/find_center.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/scan/center/centroids.hpp"
#include "host/scan/center/half_turn.hpp"
#include "host/scan/center/opposite_rays.hpp"
#include "host/scan/geometry/views_of_rows.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// One that knows its own place no better than that cannot speak for another.
constexpr double useful_uncertainty = center_agreement / 2;
// Two that agree need not be as sharp.
constexpr double fair_uncertainty = center_agreement;
// Half of the variance or of the wedge's energy: noise and constants explain less.
constexpr double least_quality = 0.5;
// A second place on the detector that is more than half as likely.
constexpr double most_rival = 0.5;

bool speaks(const CenterWitness& w, double uncertainty = useful_uncertainty) {
  return w.quality >= least_quality && w.uncertainty <= uncertainty;
}
bool agree(const CenterWitness& a, const CenterWitness& b) {
  return std::abs(a.center - b.center) <= center_agreement;
}

void decide(CenterEstimate& found, const std::vector<CenterWitness>& halves, double rival) {
  if (!speaks(found, fair_uncertainty)) {
    found.doubt = fmt::format("the views leave it open by {:.2g} columns", found.uncertainty);
    return;
  }
  if (!halves.empty() && rival > most_rival) {
    found.doubt = "another place on the detector fits nearly as well";
    return;
  }
  const auto says = [&](bool for_it, double uncertainty) {
    return std::find_if(found.others.begin(), found.others.end(), [&](const CenterWitness& w) {
      return speaks(w, uncertainty) && agree(found, w) == for_it;
    });
  };
  found.sure = says(true, fair_uncertainty) != found.others.end();
  if (found.sure) return;
  if (const auto w = says(false, useful_uncertainty); w != found.others.end()) {
    found.doubt = fmt::format("{} differs by {:.2f} columns", w->method, w->center - found.center);
    return;
  }
  if (halves.empty()) {
    found.doubt = "no second method speaks for it";
    return;
  }
  // Of opposite views or rays alone: each half of them says the same, and no other place comes near.
  if (!speaks(halves[0]) || !speaks(halves[1]) || !agree(halves[0], halves[1]))
    found.doubt = fmt::format("the halves of its views differ by {:.2f} columns",
                              std::abs(halves[0].center - halves[1].center));
  found.sure = found.doubt.empty();
}

// Rows that are constant but for rounding have no mirror, though tapers and rounding errors do.
bool is_flat(const ProjectionSet& scan) {
  const std::int64_t U = scan.geometry.columns;
  for (std::size_t at = 0; at < scan.data.size(); at += static_cast<std::size_t>(U)) {
    const auto [low, high] = std::minmax_element(scan.data.data() + at, scan.data.data() + at + U);
    if (*high - *low > 1e-5f * std::max(std::abs(*low), std::abs(*high))) return false;
  }
  return true;
}

std::optional<CenterEstimate> of_cone(const ProjectionSet& scan) {
  const auto rays = center::from_opposite_rays(scan);
  if (!rays || !(rays->all.quality >= least_quality)) return std::nullopt;
  CenterEstimate found{rays->all, false, {}, {}};
  decide(found, rays->halves, rays->rival);
  return found;
}

// Where the sample moved along columns, views as they would be of one that only turns: read between columns,
// which is near enough to look for mirror images.
ProjectionSet brought_back(const ProjectionSet& scan) {
  ProjectionSet out = scan;
  ParallelGeometry& g = out.geometry;
  for (std::int64_t k = 0; k < g.views(); ++k)
    for (std::int64_t r = 0; r < g.rows; ++r) {
      const std::int64_t first = (k * g.rows + r) * g.columns;
      for (std::int64_t i = 0; i < g.columns; ++i) {
        const double place = std::clamp(static_cast<double>(i) + g.column_shift[static_cast<std::size_t>(k)],
                                        0.0, static_cast<double>(g.columns - 1));
        const auto low = std::min(static_cast<std::int64_t>(place), g.columns - 2);
        const double part = place - static_cast<double>(low);
        const float* p = scan.data.data() + first + low;
        out.data[static_cast<std::size_t>(first + i)] =
            static_cast<float>((1 - part) * static_cast<double>(p[0]) + part * static_cast<double>(p[1]));
      }
    }
  g.column_shift.clear();
  return out;
}

}  // namespace

std::optional<CenterEstimate> find_center(const ProjectionSet& scan) {
  if (scan.geometry.views() < 2) return std::nullopt;
  if (static_cast<std::int64_t>(scan.data.size()) != scan.size())
    throw InputError(fmt::format("{} samples for {} views of {} x {}", scan.data.size(),
                                 scan.geometry.views(), scan.geometry.rows, scan.geometry.columns));
  if (const auto middle = views_of_middle(scan)) return find_center(*middle);
  if (!scan.geometry.column_shift.empty() && scan.geometry.columns > 1)
    return find_center(brought_back(scan));
  if (is_flat(scan)) return std::nullopt;
  if (scan.cone) return of_cone(scan);
  const auto opposite = center::from_opposite_views(scan);
  std::vector<CenterWitness> all;
  if (opposite) all.push_back(opposite->all);
  const auto ends = center::from_ends(scan), centroids = center::from_centroids(scan);
  std::optional<double> near;
  for (const auto& w : {centroids, ends, opposite ? std::optional(opposite->all) : std::nullopt})
    if (w && w->quality >= least_quality) near = w->center;
  for (const auto& w : {center::from_symmetry(scan, near), ends, centroids})
    if (w) all.push_back(*w);
  if (all.empty()) return std::nullopt;
  // In this order unless a method does not know its own place.
  auto first = std::find_if(all.begin(), all.end(), [](const auto& w) { return speaks(w); });
  if (first == all.end())
    first = std::find_if(all.begin(), all.end(), [](const auto& w) { return w.quality >= least_quality; });
  if (first == all.end()) return std::nullopt;
  CenterEstimate found{*first, false, {}, {}};
  const bool of_opposite = opposite && first == all.begin();
  all.erase(first);
  found.others = std::move(all);
  decide(found, of_opposite ? opposite->halves : std::vector<CenterWitness>{},
         of_opposite ? opposite->rival : 1);
  return found;
}

}  // namespace vdvr
