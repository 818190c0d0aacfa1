// F itself, in double precision on the host, with no FFT and no device: the definition written out
// (docs/geometry.md).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

class ConeCoverage;
class Coverage;

class VDVR_API ExactField {
 public:
  /// Cost: views * rows * columns^2 (ramp filter and cosine coefficients as direct sums), once. Memory: 8
  /// bytes a sample, in scratch where the scan lies there.
  ExactField(const ProjectionSet& scan, const FieldOptions& field, const Progress& progress = {});

  /// F at world points. Cost per point: views * columns (plus rows * columns * views once per distinct z); of
  /// cone beam views * columns * rows.
  /// Points that are not covered give the value of the mirror extension.
  [[nodiscard]] std::vector<double> at(std::span<const Vec3> points, const Progress& progress = {}) const;

  [[nodiscard]] bool covered(const Vec3& point) const;
  /// The detector, with the columns that weights pad it with.
  [[nodiscard]] const ParallelGeometry& geometry() const { return geometry_; }
  /// Of cone beam, for these columns; else none.
  [[nodiscard]] const std::vector<ViewMatrix>& views() const { return views_; }
  /// Cosine coefficients of the filtered projections times their weights: double [view][m][l], m along u, l
  /// along v.
  [[nodiscard]] std::span<const double> coefficients() const {
    return {coefficients_.get(),
            static_cast<std::size_t>(geometry_.views() * geometry_.rows * geometry_.columns)};
  }
  /// Bounds the double-precision rounding of the coefficients and of sums over them, at any point; of
  /// cone beam where lambda is 1, elsewhere times the largest lambda^-2.
  [[nodiscard]] double rounding() const { return rounding_; }

 private:
  [[nodiscard]] std::vector<double> at_cone(std::span<const Vec3> points, const Progress& progress) const;

  ParallelGeometry geometry_;
  std::vector<ViewMatrix> views_;
  std::shared_ptr<const Coverage> coverage_;           ///< of parallel beam
  std::shared_ptr<const ConeCoverage> cone_coverage_;  ///< of cone beam
  std::shared_ptr<const double[]>
      coefficients_;  ///< [view][column coefficient m][row coefficient l], weights included; copies share it
  double rounding_ = 0;
};

}  // namespace vdvr
