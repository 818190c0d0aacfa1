// F of cone beam at some points anywhere, without a table finer than the detector twice: for estimates.
#pragma once

#include <span>
#include <vector>

#include "host/base/opencl/state.hpp"
#include "host/scan/units.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// Sums over the views at covered points, which are in the scan's units; elsewhere anything. Beside fp32 it
/// errs by less than 1e-4 of the amplitudes of each view's waves. Cost: tables of all views at twice the
/// detector's density both ways, and 3 x 16 multiply-adds of eight lanes a view and point. Memory: the
/// filtered views, and tables of eight of them.
std::vector<float> cone_at_points(opencl::State& state, const ScanInUnits& from, const FieldOptions& field,
                                  std::span<const Vec3> points, const Progress& progress);

}  // namespace vdvr
