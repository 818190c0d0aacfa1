// Grids of files that have none.
#include <map>
#include <string>
#include <utility>

#include "vdvr/error.hpp"
#include "vdvr/expert/audit.hpp"
#include "vdvr/expert/certified_region.hpp"

namespace vdvr {
namespace {

/// In the scan's units, where both units are lengths that can be converted.
double unit_factor(const std::string& from, const std::string& to) {
  static const std::map<std::string, double> metres{{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}};
  const auto a = metres.find(from), b = metres.find(to);
  return a != metres.end() && b != metres.end() ? a->second / b->second : 1;
}

}  // namespace

PlacedVolume placed_volume(Volume volume, const ProjectionSet& scan, const FieldOptions& field,
                           const PlaceOptions& options) {
  PlacedVolume p{std::move(volume), "option", "option"};
  Grid& g = p.volume.grid;
  const bool spaced = g.unit != "pixel" || g.spacing != Vec3{1, 1, 1}, placed = g.origin != Vec3{0, 0, 0};
  const double factor = unit_factor(g.unit, scan.geometry.unit);
  for (std::size_t a = 0; a < 3; ++a) {
    g.spacing[a] *= factor;
    g.origin[a] *= factor;
  }
  g.unit = scan.geometry.unit;
  const Grid usual = certified_grid(scan, field, {});
  if (options.spacing || !spaced) g.spacing = options.spacing.value_or(usual.spacing);
  if (!options.spacing) p.spacing_from = spaced ? "file" : "the detector's pitch";
  for (const double s : g.spacing)
    if (!(s > 0)) throw InputError("`spacing`: not above 0");
  if (options.origin) {
    g.origin = *options.origin;
  } else if (!placed) {
    const double middle = 0.5 * (usual.origin[2] + usual.position(usual.cells)[2]);
    for (std::size_t a = 0; a < 3; ++a)
      g.origin[a] = -0.5 * static_cast<double>(g.cells[a]) * g.spacing[a] + (a == 2 ? middle : 0.0);
    p.origin_from = "centred on the axis";
  } else {
    p.origin_from = "file";
  }
  return p;
}

}  // namespace vdvr
