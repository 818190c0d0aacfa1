// Volumes and certificates in other units (units.hpp).
#pragma once

#include <vector>

#include "host/scan/units.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

/// 2^exponent times samples and step; integers stay what they are.
void scale(MixedVolume& volume, int exponent);
/// 2^exponent times what is a density. Bounds by brick never become smaller.
void scale(ErrorBudget& budget, int exponent);
void scale(std::vector<Bound>& bounds, int exponent);

/// What is given in `units` in world units. Bounds by brick never become smaller.
Certificate to_world(Certificate certificate, const Units& units);

}  // namespace vdvr
