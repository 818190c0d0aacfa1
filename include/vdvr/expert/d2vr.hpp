// D2VR, the method that certified volumes are compared with: no volume at all, every sample of a ray is
// back-projected from the ramp-filtered projections when it is needed, bilinear between detector samples.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

struct D2vrOptions {
  FieldOptions field;
  /// Columns and rows per detector pixel, band-limited as F is: a power of two up to 64; 1 is the published
  /// method.
  int upsampling = 1;
};

/// F_D2VR(x) = sum over views of weight * bilinear(q_k; t_k(x), z), in fp32, and 0 where a column of
/// the detector is missed in any view; above and below its outermost rows those count. q_k are the filtered
/// projections, at the detector's samples or upsampled.
class VDVR_API D2vrField {
 public:
  /// Cost: the ramp filter, once; upsampled by N views * (N rows * columns * (rows + N columns)) more.
  /// Memory: bytes() on the device. Throws InputError (options, a detector of less than 2 columns, sizes
  /// beyond 32 bits), ResourceError. Must not outlive the device.
  D2vrField(Device& device, const ProjectionSet& scan, const D2vrOptions& options,
            const Progress& progress = {});
  ~D2vrField();
  D2vrField(D2vrField&&) noexcept;
  D2vrField& operator=(D2vrField&&) noexcept;

  /// At world points. Cost per point: 4 samples of every view.
  [[nodiscard]] std::vector<float> at(std::span<const Vec3> points, const Progress& progress = {}) const;
  /// Whether all views see the point; `at` gives 0 elsewhere.
  [[nodiscard]] bool covered(const Vec3& point) const;
  [[nodiscard]] const ParallelGeometry& geometry() const;
  /// Of the projections on the device: 4 * views * columns * rows, about N^2 times that when upsampled.
  [[nodiscard]] std::uint64_t bytes() const;

  struct Impl;
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// The field in the box of a grid, whose cells are the unit of steps and gradients, with what is known of
/// where it is empty: its values at the grid's samples.
///
/// Empty space: bricks of 4 cells whose values can be seen nowhere are leapt over. The range of a brick is
/// that of its samples and of those one cell around, widened at both ends by half its extent. That is no
/// bound: between samples the field may leave it (docs/rendering.md); `skip_empty` off is certain.
class VDVR_API D2vrScene {
 public:
  /// Cost: one evaluation of the field per sample of the grid. Throws as ResidentVolume. The field must
  /// outlive it.
  D2vrScene(Device& device, const D2vrField& field, const Grid& grid, const Progress& progress = {});
  ~D2vrScene();
  D2vrScene(D2vrScene&&) noexcept;
  D2vrScene& operator=(D2vrScene&&) noexcept;

  [[nodiscard]] const Volume& samples() const;  ///< the field on the grid
  [[nodiscard]] const D2vrField& field() const;

  struct Impl;
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// One picture by a Renderer of its own, as `raycast` draws it of a volume on the scene's grid: mode dvr,
/// every sample and six more where it is lit taken from the projections; with GradientKind::analytic one
/// more, the derivative of the bilinear sum instead of central differences. Throws InputError for another
/// mode, pre-integration, steps by level, stored gradients, the image3d sampler and bounds, which need a
/// stored volume. RenderResult::sampler is `buffer`.
VDVR_API RenderResult raycast(Device& device, const D2vrScene& scene, const RenderOptions& options);

}  // namespace vdvr
