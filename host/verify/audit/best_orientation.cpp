// Each orientation at all whole shifts, on a thinned grid of the axes that it asks for.
#include "host/verify/audit/best_orientation.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fdk/filter_cone.hpp"
#include "host/verify/audit/registration_words.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {
namespace {

/// The shift, in whole samples, under which F explains most of W in this orientation.
Placed best_shift(const Volume& w, const Orientation& o, const ThinnedGrid& thin,
                  const std::vector<double>& f) {
  Placed best;
  best.orientation = o;
  const Index3 n = w.grid.samples(), m = oriented(w.grid, o).samples();
  std::vector<double> values, truth;
  for (int code = 0; code < 125; ++code) {
    const Index3 shift{code % 5 - kReach, code / 5 % 5 - kReach, code / 25 - kReach};
    values.clear();
    truth.clear();
    for (std::size_t i = 0; i < f.size(); ++i) {
      Index3 s = thin.samples()[i];
      bool in = true;
      for (std::size_t a = 0; a < 3; ++a) {
        s[a] += shift[a];
        in = in && s[a] >= 0 && s[a] < m[a];
      }
      if (!in) continue;
      const Index3 p = source_of(s, w.grid, o);
      values.push_back(static_cast<double>(w.samples[at((p[2] * n[1] + p[1]) * n[0] + p[0])]));
      truth.push_back(f[i]);
    }
    // What lies beyond the edge must not make a shift look good.
    if (2 * values.size() < f.size()) continue;
    const double unexplained = linear_fit(values, truth).unexplained;
    const auto size = [](const Index3& k) { return std::abs(k[0]) + std::abs(k[1]) + std::abs(k[2]); };
    if (unexplained < best.unexplained * (1 - 1e-9) ||
        (unexplained <= best.unexplained && size(shift) < size(best.shift))) {
      best.unexplained = unexplained;
      best.shift = shift;
    }
  }
  return best;
}

}  // namespace

Placed best_orientation(Device& device, const ProjectionSet& scan, const Volume& w,
                        const AuditOptions& options, const FitSettings& settings, const Orientation& current,
                        const Progress& progress) {
  const Coverage coverage = certified_coverage(scan, options.field);
  std::map<std::array<int, 3>, std::pair<ThinnedGrid, std::vector<double>>> of_axes;
  for (const Orientation& o : orientations()) {
    if (of_axes.count(o.axes) > 0) continue;
    throw_if_stopped();
    report(progress, "register", static_cast<double>(of_axes.size()) / 100);
    try {
      ThinnedGrid thin(oriented(w.grid, o), coverage, options, kReach + 1);
      std::vector<double> f = thin.field(device, scan, options.field, settings);
      of_axes.emplace(o.axes, std::pair(std::move(thin), std::move(f)));
    } catch (const InputError&) {
      if (o == current) throw;  // a long volume across the axis: it cannot be so
    }
  }
  std::vector<Placed> placed(orientations().size());
  for (std::size_t i = 0; i < placed.size(); ++i) placed[i].orientation = orientations()[i];
  parallel_for(static_cast<std::int64_t>(placed.size()), {}, "", [&](std::int64_t i) {
    const auto known = of_axes.find(orientations()[at(i)].axes);
    if (known != of_axes.end())
      placed[at(i)] = best_shift(w, orientations()[at(i)], known->second.first, known->second.second);
  });
  double least = 1;
  for (const Placed& p : placed) least = std::min(least, p.unexplained);
  const auto own =
      std::find_if(placed.begin(), placed.end(), [&](const Placed& p) { return p.orientation == current; });
  // As in earns_its_keep(); of two that are alike the first, which is simpler.
  if (own->unexplained <= 2 * least + kNegligible) return *own;
  return *std::find_if(placed.begin(), placed.end(),
                       [&](const Placed& p) { return p.unexplained <= 1.05 * least + kNegligible; });
}

}  // namespace vdvr
