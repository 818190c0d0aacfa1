// Re-projection residuals: what was measured less the integral of F along the measured ray, as an interval
// that is proved (docs/residual.md). What no interpolation explains lies in views, truncation, noise or
// physics.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

struct ResidualOptions {
  std::int64_t first_row = 0;
  std::int64_t rows = -1;  ///< -1: to the last one
  std::uint64_t max_memory_bytes = 0;
};

/// float [view][row][column], of rows first_row and on; NaN where a ray misses the covered region.
struct Residual {
  ParallelGeometry geometry;  ///< of the whole scan, with the centre in use
  std::int64_t first_row = 0, rows = 0;
  std::vector<float> lo, hi;  ///< hold measured - integral of F over the covered part of the ray
  std::vector<float> reach;   ///< integral of the certificate's bounds over the same part

  [[nodiscard]] std::size_t index(std::int64_t view, std::int64_t row, std::int64_t column) const {
    return static_cast<std::size_t>((view * rows + row - first_row) * geometry.columns + column);
  }
  [[nodiscard]] double middle(std::size_t i) const {
    return 0.5 * (static_cast<double>(lo[i]) + static_cast<double>(hi[i]));
  }
  /// No field within the certificate's bounds of F has the measured integral.
  [[nodiscard]] bool beyond_interpolation(std::size_t i) const {
    return lo[i] > reach[i] || hi[i] < -reach[i];
  }
  /// F itself has not.
  [[nodiscard]] bool beyond_field(std::size_t i) const { return lo[i] > 0 || hi[i] < 0; }
};

/// Of `volume` only the grid counts, and of the certificate the field options and the bounds by brick: V is
/// not read. Cost: views^2 * columns * rows evaluations of a polynomial at both ends of each ray, and views *
/// columns^2 * rows sums. Memory: 12 bytes a ray of the wanted rows, and a row's tables. Throws InputError
/// for cone beam, a window, rows that are not there, and a certificate without bounds by brick;
/// ResourceError.
VDVR_API Residual residual(const ProjectionSet& scan, const MixedVolume& volume,
                           const Certificate& certificate, const ResidualOptions& options,
                           const Progress& progress = {});

/// Of a view or a column: all its rays that were compared.
struct ResidualLine {
  std::int64_t index = 0, rays = 0, beyond = 0;  ///< beyond: that no interpolation explains
  double rms = 0, mean = 0;                      ///< of the middles
};

struct ResidualSummary {
  std::int64_t rays = 0, compared = 0, beyond_field = 0, beyond_interpolation = 0;
  double rms = 0;             ///< of the middles
  double measured_rms = 0;    ///< of the measured values of the same rays
  double width = 0;           ///< largest hi - lo
  double largest_excess = 0;  ///< how far the residual lies outside what interpolation explains, at most
  std::array<std::int64_t, 3> worst{-1, -1, -1};  ///< view, row, column there; -1: nowhere
  std::vector<ResidualLine> views, columns;
  ResidualLine worst_view, worst_column;  ///< of the largest rms
  double median_view_rms = 0, median_column_rms = 0;
  /// Largest magnitude in the outermost columns over the largest of all: much of it means that the object
  /// reaches beyond the detector, and that its parts there are in the residual.
  double at_edge = 0;
};
VDVR_API ResidualSummary summary_of(const Residual& residual, const ProjectionSet& scan);

/// By the ending: .h5/.hdf5 (`lo`, `hi`, `reach`, float32 [view][row][column], and the geometry as
/// attributes), .npy (float32, shape (views, rows, columns, 3)), .mha/.nrrd (the middles; x column, y row, z
/// view). Whole or not at all.
VDVR_API void write_residual(const std::filesystem::path& path, const Residual& residual);
/// Whether write_residual takes it.
VDVR_API bool is_residual_path(const std::filesystem::path& path);

}  // namespace vdvr
