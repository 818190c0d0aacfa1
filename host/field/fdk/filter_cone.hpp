// The ramp filter of cone-beam projections (docs/geometry.md, "Cone beam").
#pragma once

#include "host/field/fbp/coverage.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "host/field/fdk/cone_coverage.hpp"
#include "host/field/fdk/fdk_weights.hpp"
#include "host/scan/units.hpp"

namespace vdvr {

/// The matrices with the centre in use.
ConeGeometry used_cone(const ProjectionSet& scan, const FieldOptions& field);
/// Columns that a displaced detector is padded with count as seen: their rays weigh nothing.
ConeCoverage cone_coverage(const ProjectionSet& scan, const FieldOptions& field);
/// What is certified of a scan of either beam, in world units.
Coverage certified_coverage(const ProjectionSet& scan, const FieldOptions& field);
/// In units of computation.
ViewMatrix from_world(ViewMatrix matrix, const Units& units);

/// What filtered cone-beam views are before they hold samples: the detector with its padding, the matrices
/// for it, and how samples and views are weighed. All but `cone` and `weights` in `units`.
struct ConeFrame {
  /// Throws what FdkWeights throws.
  ConeFrame(const ProjectionSet& scan, const FieldOptions& field, const Units& units);

  ConeGeometry cone;  ///< as the scan has it, with the centre in use
  FdkWeights weights;
  FilteredScan filtered;          ///< geometry and matrices alone
  std::vector<bool> flipped{};    ///< by view: rows are kept in the other order, so that they grow with z
  std::vector<double> of_view{};  ///< times a view's samples, where the ramp is that of pitch 1
};

/// Samples weighed, filtered along rows at the pitch at the axis, times the views' weights. The detector gets
/// the columns that FdkWeights pads it with. Cost: as filter_projections(). Memory: as its; a chunk of views
/// in double precision.
FilteredScan filter_cone(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                         const Progress& progress = {}, Precision precision = Precision::fp64,
                         const Units& units = {});

/// Of either beam: this, or filter_projections().
FilteredScan filter_scan(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                         const Progress& progress = {}, Precision precision = Precision::fp64,
                         const Units& units = {});

}  // namespace vdvr
