// The points that certificates speak of.
#pragma once

#include <memory>

#include "vdvr/api.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {

class Coverage;

/// Of parallel beam all points whose projections fall on the detector in every view; of cone beam the largest
/// upright cylinder among them (docs/geometry.md, "Cone beam").
class VDVR_API CertifiedRegion {
 public:
  /// The scan's projections are not looked at. Throws InputError where the region is empty.
  explicit CertifiedRegion(const ProjectionSet& scan, const FieldOptions& field = {});
  [[nodiscard]] bool contains(const Vec3& point) const;
  [[nodiscard]] double inner_radius() const;
  /// The largest upright cylinder in it.
  [[nodiscard]] CoveredCylinder cylinder() const;

 private:
  std::shared_ptr<const Coverage> coverage_;
};

/// The grid that a volume has by default: around the certified region, with cells of a pixel at the axis.
/// Throws InputError as make_grid does.
VDVR_API Grid certified_grid(const ProjectionSet& scan, const FieldOptions& field,
                             const GridOptions& options);

}  // namespace vdvr
