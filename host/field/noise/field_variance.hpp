// The variance of F by back-projection with squared weights.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "host/base/opencl/state.hpp"
#include "host/base/system/casts.hpp"
#include "host/scan/geometry/weights_by_height.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/line_noise.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// The filter's band-limited kernel of pitch 1, squared, as a filter of variances.
class SquaredFilter {
 public:
  explicit SquaredFilter(const FieldOptions& field);

  /// g(m / 2)^2 within 12 columns.
  [[nodiscard]] double at(std::int64_t half_columns) const;
  /// sum_i g(place / 2 - i)^2 v_i over a row. `blocks`: blocks_of(row). At columns g^2 falls with the fourth
  /// power of the distance: what lies beyond 12 of them, 5e-5 of the sum, is left out. Between columns it
  /// falls with the second alone, where the window has not closed at Nyquist; the whole sum is known (it is
  /// that at columns, by Parseval), so what lies beyond is its rest over the square of the distance.
  [[nodiscard]] double operator()(std::span<const double> row, std::span<const double> blocks,
                                  std::int64_t place) const;
  static std::vector<double> blocks_of(std::span<const double> row);

 private:
  std::vector<double> kernel_;
  double rest_ = 0;  // g(t)^2 t^2 far from 0 between columns
};

/// Weights S_v(z, r)^2 of detector rows for a height between them, those that matter: (row, weight). Of rows
/// that are correlated (LineIntegralNoise) all by what their products add.
struct RowShare {
  std::int64_t row;
  double weight;
};
std::vector<RowShare> squared_row_shares(double place, std::int64_t rows,
                                         std::span<const float> correlation = {});

/// The share of white noise's variance that a noise of this spectrum (LineIntegralNoise) has after the ramp.
double passed_share(const FieldOptions& field, std::span<const float> spectrum);

/// v of one pixel's line integral.
class PixelVariance {
 public:
  explicit PixelVariance(const LineIntegralNoise& noise) : noise_(noise) {}
  [[nodiscard]] double operator()(std::size_t pixel, double p) const;

 private:
  const LineIntegralNoise& noise_;
};

/// The variance of samples of the scan's rows, which may be longer than the detector's: those of half
/// acquisition were multiplied by a factor f, and have f^2 times the variance. Those of a series of heights
/// are sums over measured views with shares c, and have the sum of c^2 v: each view is taken to have seen
/// what their mean says. Samples that padding added are copies of others and are left out: by t columns from
/// the edge they change sigma by less than 3 % / t^2 (docs/noise.md).
class SampleVariance {
 public:
  SampleVariance(const ParallelGeometry& g, const LineIntegralNoise& noise);

  double operator()(std::int64_t view, std::int64_t row, std::int64_t column, float sample) const {
    const auto factor = static_cast<double>(factors_[at(column)]);
    if (factor == 0) return 0;
    const double measured = static_cast<double>(sample) / factor;
    if (series_) return factor * factor * of_series(view, row, column, measured);
    return factor * factor * variance_(pixel_of(row, column), measured);
  }
  /// Of a view's samples, one row after another.
  [[nodiscard]] double of_sample(std::int64_t view, std::int64_t i, float sample) const {
    return (*this)(view, i / columns_, i % columns_, sample);
  }

  /// Of a pixel of the detector as it was measured, where a line integral is 0.
  [[nodiscard]] double of_open_pixel(std::int64_t pixel) const { return variance_(at(pixel), 0); }
  [[nodiscard]] std::int64_t pixels() const { return measured_rows_ * own_; }
  /// `put(pixel, factor)` for each measured pixel that a sample is a sum of, and times what.
  template <class Put>
  void for_each_pixel(std::int64_t view, std::int64_t row, std::int64_t column, const Put& put) const {
    const auto factor = static_cast<double>(factors_[at(column)]);
    if (factor == 0) return;
    if (!series_) return put(static_cast<std::int64_t>(pixel_of(row, column)), factor);
    const std::int64_t height = first_ + row;
    for (const std::int64_t k : series_->measured(view))
      if (const double share = series_->share(k, height); share != 0)
        put(static_cast<std::int64_t>(pixel_of(nearest_row(k, height), column)), factor * share);
  }

 private:
  [[nodiscard]] std::size_t pixel_of(std::int64_t row, std::int64_t column) const {
    return at(row * own_ + column - before_);
  }
  [[nodiscard]] std::int64_t nearest_row(std::int64_t measured_view, std::int64_t height) const;
  [[nodiscard]] double of_series(std::int64_t view, std::int64_t row, std::int64_t column, double sum) const;

  PixelVariance variance_;
  std::vector<float> factors_;
  std::int64_t columns_, own_, before_, first_, measured_rows_;
  std::shared_ptr<const WeightsByHeight> series_;
};

/// float variance[z][y][x] / scale on the grid's samples, world units; scale brings them to order one.
struct FieldVariance {
  std::vector<float> samples;
  double scale = 1;
};
FieldVariance field_variance(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                             const LineIntegralNoise& noise, const Grid& grid, const Progress& progress);

}  // namespace vdvr
