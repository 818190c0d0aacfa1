// W against F at points: at all samples by the device, at the worst of them and in the worst cells in double
// precision.
#pragma once

#include <vector>

#include "host/verify/audit/audit_bound.hpp"
#include "host/verify/audit/audited_volume.hpp"
#include "vdvr/expert/exact_field.hpp"

namespace vdvr {

/// Fills what `figures` says of samples, and returns the worst of them, in cells. Cost: a reconstruction of
/// W's grid plane by plane, and F by ExactField at some of the worst.
std::vector<Vec3> compare_samples(Device& device, const ProjectionSet& scan, const FieldOptions& field,
                                  const ExactField& exact, const AuditedVolume& w, AuditFigures& figures,
                                  const Progress& progress);

/// Fills `lower` and its point: the worst among `points`, in the boxes, and around the worst of these. Cost:
/// some thousand points of ExactField, less where a point is dear.
void search_worst(const ExactField& exact, const AuditedVolume& w, const std::vector<WorstBox>& boxes,
                  const std::vector<Vec3>& points, AuditFigures& figures, const Progress& progress);

}  // namespace vdvr
