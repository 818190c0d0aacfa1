#include "vdvr/certified_region.hpp"

#include "host/fdk/filter_cone.hpp"

namespace vdvr {

CertifiedRegion::CertifiedRegion(const ProjectionSet& scan, const FieldOptions& field)
    : coverage_(std::make_shared<const Coverage>(certified_coverage(scan, field))) {}

bool CertifiedRegion::contains(const Vec3& point) const {
  return coverage_->margin(point[0], point[1]) >= 0 && coverage_->margin_z(point[2]) >= 0;
}

double CertifiedRegion::inner_radius() const { return coverage_->inner_radius(); }

}  // namespace vdvr
