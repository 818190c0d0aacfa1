// What registration found, as people say it.
#pragma once

#include "host/verify/audit/fit.hpp"
#include "vdvr/expert/audit.hpp"

namespace vdvr {

/// Of the variance: an amplitude of .2 %.
constexpr double kNegligible = 4e-6;
/// Samples or columns; below, programs differ by how they round.
constexpr double kLeastShift = 0.05;

/// Whether what was found explains so much more that it is named: half of what is unexplained without it.
bool earns_its_keep(double without, double with);

/// Sets scale and offset where they count, and the words.
void name_faults(Registration& registration, const LinearFit& linear, const ProjectionSet& scan,
                 const FieldOptions& field);

}  // namespace vdvr
