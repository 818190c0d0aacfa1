// What values on a lattice denser than the detector both ways err (host/field/fbp/dense_values.hpp).
#pragma once

#include "host/certify/bounds/projection_bounds.hpp"

namespace vdvr {

/// Of views whose samples sum up to `samples` and whose sups, on the detector's rows, to `sup`: columns by a
/// part of their own, which the series along v makes grow, and rows by theirs.
double dense_rounding(Upsampler& upsampler, const FilteredScan& scan, const UpsampledColumns& columns,
                      const UpsampledColumns& rows, double samples, double sup, Fp64 fp64 = Fp64::as_here);

}  // namespace vdvr
