#include "vdvr/expert/certified_region.hpp"

#include "host/field/fdk/filter_cone.hpp"

namespace vdvr {

CertifiedRegion::CertifiedRegion(const ProjectionSet& scan, const FieldOptions& field)
    : coverage_(std::make_shared<const Coverage>(certified_coverage(scan, field))) {}

bool CertifiedRegion::contains(const Vec3& point) const {
  return coverage_->margin(point[0], point[1]) >= 0 && coverage_->margin_z(point[2]) >= 0;
}

double CertifiedRegion::inner_radius() const { return coverage_->inner_radius(); }

CoveredCylinder CertifiedRegion::cylinder() const {
  return {coverage_->inner_radius(), coverage_->heights()};
}

Grid certified_grid(const ProjectionSet& scan, const FieldOptions& field, const GridOptions& options) {
  if (!scan.cone) return make_grid(scan.geometry, options);
  const Coverage coverage = certified_coverage(scan, field);
  return grid_around(scan.geometry, coverage.inner_radius(), coverage.heights(), options);
}

}  // namespace vdvr
