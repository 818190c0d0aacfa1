// Global bounds that rest on the filtered projections: sups, the errors of the chain to gold
// (docs/error-bounds.md).
#pragma once

#include <vector>

#include "host/field/fbp/back_project.hpp"
#include "host/field/fbp/filter_projections.hpp"
#include "host/field/fdk/view_derivatives.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// What a scan allows to be said before any gold sample exists; sums over the views, weights included.
struct FieldSups {
  double value = 0;     ///< sum over views of sup |q|
  double second_u = 0;  ///< of sup |q_uu|
  double second_v = 0;  ///< of sup |q_vv|
  /// Of cone beam view by view; none of parallel beam. The sums above are then the largest of lambda^-2 times
  /// these on the covered region, with lengths as at the axis.
  std::vector<DetectorSups> by_view;
};

/// Throws InputError where a derivative's sup is no finite number: no bound can be made of it.
/// Cost: values and derivatives on a grid 4 times denser than the detector both ways.
/// `step`: of every step-th view, times all views over those: an estimate where it is not 1.
FieldSups field_sups(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                     std::int64_t step = 1);
/// Derivatives by Bernstein's inequality, at a third of the cost: what rates of six taps and gold need.
FieldSups value_sups(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan);
/// Of cone beam: values and second derivatives, view by view. Cost: as field_sups.
FieldSups cone_sups(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                    std::int64_t step = 1);
/// What sums over every step-th view have to be multiplied by.
double share_of_views(std::int64_t views, std::int64_t step);
/// Multiply-adds of field_sups.
double cost_of_sups(const ParallelGeometry& geometry);

/// Bounds the growth of sample errors by band-limited interpolation of n samples (Lebesgue constant of the
/// mirror extension).
double lebesgue_constant(std::int64_t n);

/// How far the field of the computed filtered samples lies from F, anywhere: part of arithmetic_bound. It is
/// a band-limited field itself, so bounds of curvature made from those samples need not pay for it again.
double filter_error_bound(Upsampler& upsampler, const FilteredScan& scan);

constexpr double unit_roundoff = 0x1p-24;

/// Whose rounding a bound is of: this device's, or that of another by ColumnMethod::accurate, which has
/// double precision or lacks it.
enum class Fp64 { as_here, present, absent };

/// How much an upsampled column may err, weights not included, where the rows of its view are at most
/// `largest` at the detector's columns and its own is at most `sup` between them.
double column_error(Upsampler& upsampler, std::int64_t detector_columns, const UpsampledColumns& columns,
                    double largest, double sup, Fp64 fp64 = Fp64::as_here);

/// What n samples of at most `largest`, of a signal of at most `sup`, err once transforms have made them
/// `rate` times finer (upsample_columns.hpp).
double transform_error(std::int64_t n, int rate, double largest, double sup);

/// What two products of a view may lose below the smallest normal number: relative bounds do not cover it,
/// and devices may flush, in each of the terms and in what is kept of each run.
double product_underflow(const ParallelGeometry& geometry, double gain_u);

/// How much a sum of n products in compensated runs errs, in units of u times the sum of magnitudes
/// (kernels/field/fbp/batched_product.cl).
double product_error(std::int64_t n, int run);

/// Where computed back-projected samples depart from F, step by step, on the detector's own rows.
struct ChainErrors {
  double ramp = 0;           ///< of the field of the computed filtered samples, anywhere: filter_error_bound
  double columns = 0;        ///< of upsampled columns by fp32, each by itself, weights included
  double summation = 0;      ///< of the sum over views, alike
  double position = 0;       ///< of places in fp32, the same for all rows
  double interpolation = 0;  ///< between columns, the same for all rows
  double underflow = 0;      ///< of what relative bounds do not cover
};
ChainErrors chain_errors(Upsampler& upsampler, const FilteredScan& scan, const FieldSups& sups,
                         const UpsampledColumns& columns, const ColumnBlocks& blocks,
                         Interpolation interpolation, Fp64 fp64 = Fp64::as_here);

/// fp32 rounding of the whole chain from filter to back-projection, largest over the samples of such blocks.
double arithmetic_bound(Upsampler& upsampler, const FilteredScan& scan, const FieldSups& sups,
                        const UpsampledColumns& columns, const ColumnBlocks& blocks,
                        Interpolation interpolation, Fp64 fp64 = Fp64::as_here);

}  // namespace vdvr
