// Plans, volumes and certificates in other units (units.hpp). Called by plan.cpp, build.cpp, verify_terms.cpp
// and verify_field.cpp.
#pragma once

#include "host/scan/units.hpp"
#include "vdvr/certificate.hpp"
#include "vdvr/mixed_volume.hpp"
#include "vdvr/plan.hpp"

namespace vdvr {

/// 2^exponent times samples and step; integers stay what they are.
void scale(MixedVolume& volume, int exponent);

/// What is given in `units` in world units. Bounds by brick never become smaller.
Plan to_world(Plan plan, const Units& units);
Certificate to_world(Certificate certificate, const Units& units);

}  // namespace vdvr
