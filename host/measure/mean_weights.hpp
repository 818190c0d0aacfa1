// What each sample of a scan adds to the mean of F over a region, which is linear in them.
//
// Of parallel beam the integral of F over R is sum_k w_k times that of a_k q_k over the detector, with a_k(u,
// v) the length of what view k's ray through (u, v) has in R, and q_k the series through the filtered rows: a
// sample p_j has the weight w_k integral a_k(u, v) H(u, j) S_v(v, r), H(u, j) = sum_i S_u(u, i) h[i - j], h
// the ramp's kernel. That is its convolution with a_k itself; with samples of a_k it errs by up to 8 %. Of
// cone beam the same, where a_k is the length in lambda over the determinant of the matrix' first three
// columns: of d^3x = lambda^2 / |det| du dv dlambda lambda^2 is cancelled by FDK's lambda^-2.
//
// a_k is taken at places close to each other, whose sum over the region's own volume, found in the same way,
// is left as it is. Layout: double weight[row][column] of the scan's own samples, as it holds them.
#pragma once

#include <optional>
#include <vector>

#include "host/field/fdk/fdk_weights.hpp"
#include "host/measure/measured_region.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/mean_of_scan.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr::measured {

class MeanWeights {
 public:
  /// Memory: tables of columns^2 and, of regions that are not upright, rows^2 numbers times the places that
  /// a_k is taken at in a pixel, at least 2; throws ResourceError where that is more than `max_memory_bytes`
  /// (0: no limit), InputError as FdkWeights.
  MeanWeights(const ProjectionSet& scan, const FieldOptions& field, const MeasuredRegion& region,
              std::uint64_t max_memory_bytes);

  /// Cost: places of a_k times columns, and rows times columns for each height.
  void of_view(std::int64_t k, std::vector<double>& weight) const;
  /// The memory that one call takes.
  [[nodiscard]] std::uint64_t bytes_of_view() const;

 private:
  struct Shadow {  ///< a_k: [height][place along columns]
    std::int64_t first_height = 0, heights = 0, first = 0, places = 0;
    std::vector<double> length;
  };
  void choose_density(std::uint64_t max_memory_bytes);
  void fill_heights();
  void fill_columns(const FieldOptions& field);
  [[nodiscard]] Shadow shadow_of(std::int64_t k) const;
  void parallel_shadow(std::int64_t k, Shadow& shadow) const;
  void cone_shadow(std::int64_t k, Shadow& shadow) const;
  [[nodiscard]] std::array<double, 4> seen_box(std::int64_t k) const;
  [[nodiscard]] double place_of(std::int64_t i) const {
    return (static_cast<double>(i) + 0.5) / density_ - 0.5;
  }

  const ProjectionSet& scan_;
  const MeasuredRegion& region_;
  ParallelGeometry detector_;  ///< with the columns that FDK pads it with
  std::optional<FdkWeights> fdk_;
  std::vector<ViewMatrix> matrices_;
  std::vector<double> of_view_;
  int density_ = 2;                     ///< places in a pixel
  double volume_ = 0;                   ///< of cone beam, the region's
  std::vector<double> heights_;         ///< of parallel beam: z in the middle of each slab
  std::vector<double> thickness_;       ///< of slabs, in rows
  std::vector<double> rows_, columns_;  ///< [height][row], [place][column] from first_place_ on
  std::int64_t first_place_ = 0, places_ = 0;
};

/// The region's volume by lines along x.
double volume_by_lines(const MeasuredRegion& region);

}  // namespace vdvr::measured

namespace vdvr {

/// In mean_of_scan.cpp. Cost: MeanWeights::of_view of every view, and a pass over the scan. Memory: its
/// tables, and what it takes for each of 16 groups of views. The same on every machine. Throws as
/// MeanWeights.
MeanOfScan mean_of_scan(const ProjectionSet& scan, const FieldOptions& field, const MeasuredRegion& region,
                        const MeanNoise& noise, std::uint64_t max_memory_bytes, const Progress& progress);

}  // namespace vdvr
