// The rows that F is made of, made once more from those that were measured (docs/geometry.md, "Half
// acquisition" and "Rows that go on").
#pragma once

#include <cstdint>
#include <filesystem>

#include "vdvr/api.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// `measured` is read without half acquisition and padding, which `field` names: here they are made by means
/// of verify's own, which share no weight with extend_rows(). Without either the scan as it is. Throws
/// InputError for rows that are longer already, and what cannot be made so. Large rows lie in a scratch file
/// in that folder, as those of scans do (ScanOptions). Cost and memory: as extend_rows().
VDVR_API ProjectionSet rows_to_verify(ProjectionSet measured, const FieldOptions& field,
                                      std::uint64_t max_memory_bytes = 0,
                                      const std::filesystem::path& scratch = {});

}  // namespace vdvr
