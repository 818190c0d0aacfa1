// What a certificate notes of the scan that its volume was built from.
#pragma once

#include <optional>

#include "vdvr/api.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/input_statement.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// The scan without its projections, as certify() noted it in the certificate, with which CertifiedRegion
/// tells the points that the certificate speaks of; none where another program wrote the file without. Throws
/// FileError where it is ill-formed.
VDVR_API std::optional<ProjectionSet> noted_geometry(const Certificate& certificate);

/// What was stated of the input, as certify() noted it; whoever reads the scan again states the same. Throws
/// FileError where it is ill-formed.
VDVR_API InputStatement noted_input(const Certificate& certificate);

}  // namespace vdvr
