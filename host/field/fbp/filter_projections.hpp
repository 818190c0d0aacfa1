// Ramp filter on the device, and upsampling of slabs of rows (docs/geometry.md: ramp first, then upsample).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "host/base/opencl/array.hpp"
#include "host/base/opencl/column_tuning.hpp"
#include "host/field/fbp/cosine_series.hpp"
#include "host/field/fbp/filter_rows.hpp"
#include "host/field/fbp/upsample_columns.hpp"
#include "host/scan/units.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Ramp-filtered projections at detector resolution, times the view weights: F(x, y, z) = sum_k q_k(t_k, z),
/// or, of a cone-beam scan, F(p) = sum_k lambda_k(p)^-2 q_k(u_k(p), v_k(p)).
struct FilteredScan {
  ParallelGeometry geometry;      ///< with the centre in use, in the units of the samples
  std::vector<ViewMatrix> views;  ///< of cone beam, in the same units and for these columns; else none
  SampleArray samples;            ///< [view][u][v]; lies where the scan's data do
  std::int64_t fft_length = 0;    ///< of the zero-padded transform that gives the linear convolution
  std::vector<double> view_max;   ///< max |q| of each view's samples
  double ramp_error =
      0;  ///< sum over views of a bound on the error of any filtered sample (docs/error-bounds.md)
};

/// What is certified is filtered in double precision and rounded once; fp32 is faster. Geometry and samples
/// are in `units`. Cost: as RowFilter's. Memory: the filtered scan, on the host or in scratch as the scan
/// is; one chunk on the device; where line integrals are scaled, those once more.
FilteredScan filter_projections(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                                const Progress& progress = {}, FilterMethod method = FilterMethod::automatic,
                                Precision precision = Precision::fp64, const Units& units = {});

/// A scan's line integrals in other units: its own data, unless these have to be scaled.
class LineIntegrals {
 public:
  /// Keeps a reference to the scan.
  LineIntegrals(const ProjectionSet& scan, const Units& units);
  [[nodiscard]] std::span<const float> data() const {
    return scaled_.empty() ? std::span<const float>(scan_->data) : std::span<const float>(scaled_);
  }

 private:
  const ProjectionSet* scan_;
  SampleArray scaled_;
};

/// float values[row / 16][view][column][16]: one slab of rows, upsampled in u.
struct UpsampledSlab {
  opencl::DeviceArray<float> values;
  UpsampledColumns columns;
  std::int64_t first_view = 0, views = 0, rows = 0, rows_padded = 0;
};

/// Bytes of a slab.
std::uint64_t slab_bytes(const DeviceInfo& device, const ParallelGeometry& geometry,
                         const UpsampledColumns& columns, std::int64_t rows);

/// Slabs straight from the scan, where columns and rows are the detector's own and the device does the
/// filtering: the filtered scan stays there. The values are those of filter_projections in fp32 and
/// Upsampler; of products to the bit, of transforms within the error that these are charged for.
class DirectFilter {
 public:
  /// Keeps references to the state and the scan. Samples are in `units`.
  DirectFilter(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
               const Units& units = {});
  DirectFilter(const DirectFilter&) = delete;  // the filter refers to the geometry
  DirectFilter& operator=(const DirectFilter&) = delete;
  /// Nothing where the slab needs upsampling. Cost: RowFilter's. Throws InputError for a view that is not
  /// finite.
  std::optional<UpsampledSlab> operator()(const UpsampledColumns& columns, std::span<const double> rows,
                                          const Progress& progress);

 private:
  opencl::State* state_;
  LineIntegrals data_;
  ParallelGeometry geometry_;
  std::vector<double> weights_;
  std::unique_ptr<RowFilter> filter_;
};

/// How columns are made finer: `accurate` by transforms in double precision where the device has it
/// (upsample_columns.hpp), else by a product in short runs; `fast` by a product in long runs, or by
/// transforms where columns are many.
enum class ColumnMethod { fast, accurate };

/// Slabs of a scan that lies in scratch, where their rows are the detector's own: only these are read and
/// filtered, when they are asked for. The values are those of filter_projections and Upsampler but for the
/// rounding of a product with the identity.
class WindowFilter {
 public:
  /// Keeps references to the state and the scan. Samples are in `units`.
  WindowFilter(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
               Precision precision, const Units& units);
  /// Nothing where a row lies between two of the detector's. Cost: the rows from the first to the last, read
  /// and filtered. Memory: these, twice. Throws InputError for a view that is not finite, ResourceError.
  std::optional<UpsampledSlab> operator()(const UpsampledColumns& columns, std::span<const double> rows,
                                          const Progress& progress);

 private:
  [[nodiscard]] ProjectionSet window(std::int64_t first, std::int64_t rows) const;

  opencl::State* state_;
  const ProjectionSet* scan_;
  FieldOptions field_;
  Precision precision_;
  Units units_;
};

/// Terms of a run of the products along rows and along columns (batched_product.hpp). The former's errors are
/// grown by the latter's matrix, and it is the smaller one.
constexpr int row_run = 4, column_run = 16, accurate_column_run = 4;

/// Evaluates the filtered projections, or even derivatives of them, on upsampled columns and at any rows.
class Upsampler {
 public:
  Upsampler(opencl::State& state, const FilteredScan& scan, ColumnMethod method = ColumnMethod::fast)
      : state_(&state), scan_(&scan), method_(method) {}
  /// Whether values at such columns are made by transforms in double precision.
  [[nodiscard]] bool transforms(const UpsampledColumns& columns) const;
  /// Terms of a run where they are not.
  [[nodiscard]] int run() const {
    return method_ == ColumnMethod::accurate ? accurate_column_run : column_run;
  }

  /// `rows` are detector row positions (real). Derivative orders 0, 2 or 4 in world units. `row_lattice` > 0:
  /// the rows are multiples of 1 / row_lattice. Views [first_view, first_view + views). Cost: for rows
  /// between the detector's own views * rows * U * V multiply-adds; then those of ColumnUpsampling, or views
  /// * rows * U * columns.
  UpsampledSlab operator()(const UpsampledColumns& columns, std::span<const double> rows, int order_u = 0,
                           int order_v = 0, int row_lattice = 0, std::int64_t first_view = 0,
                           std::int64_t views = -1);

  /// How much an error of the samples can grow along u: cosine_gain of the columns.
  double gain_u();
  /// The same of a derivative, at these columns: the largest absolute row sum of its matrix.
  double gain_u(const UpsampledColumns& columns, int order);

  /// Bytes of one slab.
  [[nodiscard]] std::uint64_t slab_bytes(const UpsampledColumns& columns, std::int64_t rows) const;

 private:
  struct Matrix {
    opencl::DeviceArray<float> values;
    double gain = 0;
  };
  struct RowMatrix {
    std::vector<double> rows;
    int order = 0;
    opencl::DeviceArray<float> values;
  };
  const opencl::DeviceArray<float>& row_matrix(std::span<const double> rows, int order, int lattice);
  /// float values[chunk][view][u][16]: detector columns u and rows v as they are.
  void copy(opencl::DeviceArray<float>& values, std::int64_t first_view, std::int64_t views,
            std::span<const std::int64_t> u, std::span<const std::int64_t> v);
  /// The same of all columns, at any rows.
  void resample_rows(opencl::DeviceArray<float>& values, std::int64_t first_view, std::int64_t views,
                     std::span<const double> rows, int order, int lattice);
  const Matrix& matrix_u(const UpsampledColumns& columns, int order);

  opencl::State* state_;
  const FilteredScan* scan_;
  ColumnMethod method_;
  double gain_ = 0;  // 0: not known yet
  RowMatrix rows_;   // of the last rows
  std::map<std::tuple<int, std::int64_t, std::int64_t, int>, Matrix> matrices_;
  std::map<int, ColumnUpsampling> transforms_;  // by rate
};

}  // namespace vdvr
