// Pictures of the ideal field F, as far as a certificate tells them: intervals of the depth of a surface, of
// a maximum, of a line integral (docs/pixel-bounds.md, docs/surfaces.md). Double precision on the host, ray
// by ray.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/camera.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// Of an iso-surface, [y][x].
struct SurfaceBounds {
  /// 0: F does not pass the value on that ray. 1: it may. 2: it does.
  std::vector<std::uint8_t> hit;
  /// Distances from the eye, world units: where F passes first lies between; `last` only where it is sure;
  /// NaN where there is none. Where a ray begins within the bound of the value, `first` is where it begins,
  /// and it is sure where F is surely on both sides of the value further on.
  FloatImage first, last;

  [[nodiscard]] VDVR_API double share(std::uint8_t kind) const;
};

/// The largest F along rays, and where it lies: [y][x], NaN where a ray misses the covered region. `high` is
/// infinite where a ray passes a brick that was not tested.
struct MaximumBounds {
  FloatImage low, high, first, last;
};

/// The integral of F along rays inside the covered region, density times world unit: [y][x], 0 and 0 where a
/// ray misses it. Infinite ends where a ray passes a brick that was not tested.
struct IntegralBounds {
  FloatImage low, high;
  std::vector<std::uint8_t> met;  ///< 1 where a ray meets the region
};

class VDVR_API CertifiedRays {
 public:
  /// Rays are those within the covered cylinder, the grid and the region of interest. Refers to the volume.
  /// `scan`: the geometry, its projections are not looked at. Throws InputError where the certificate has no
  /// bounds by brick, or a window. `image3d`: of samples by the texture unit of the device that `certificate`
  /// speaks of (safe_sampler.hpp).
  CertifiedRays(const MixedVolume& volume, const Certificate& certificate, const ProjectionSet& scan,
                bool image3d = false);
  /// The same with the geometry that the certificate notes, and of what lies in `box` ({x0, y0, z0, x1, y1,
  /// z1}) alone. Throws InputError where it notes none.
  CertifiedRays(const MixedVolume& volume, const Certificate& certificate, bool image3d = false,
                const std::optional<std::array<double, 6>>& box = {});
  ~CertifiedRays();
  CertifiedRays(const CertifiedRays&) = delete;
  CertifiedRays& operator=(const CertifiedRays&) = delete;

  /// Cost: some ten to a hundred cells and parts a ray, 0.1 us each.
  [[nodiscard]] SurfaceBounds surface(const Camera& camera, std::int64_t width, std::int64_t height,
                                      double value, const Progress& progress = {}) const;
  [[nodiscard]] MaximumBounds maximum(const Camera& camera, std::int64_t width, std::int64_t height,
                                      const Progress& progress = {}) const;
  [[nodiscard]] IntegralBounds integral(const Camera& camera, std::int64_t width, std::int64_t height,
                                        const Progress& progress = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdvr
