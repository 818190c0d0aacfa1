// The rows that F is made of, made once more from those that were measured (docs/geometry.md, "Half
// acquisition" and "Rows that go on").
#pragma once

#include "vdvr/api.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// `measured` is read without half acquisition and padding, which `field` names: here they are made by means
/// of verify's own, which share no weight with extend_rows(). Without either the scan as it is. Throws
/// InputError for rows that are longer already, and what cannot be made so. Cost and memory: as
/// extend_rows().
VDVR_API ProjectionSet rows_to_verify(ProjectionSet measured, const FieldOptions& field);

}  // namespace vdvr
