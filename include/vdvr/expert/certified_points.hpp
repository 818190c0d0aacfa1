// A certified volume at points and on lattices of points: what V is there, and what its certificate promises.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/certified_region.hpp"
#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

/// Equally spaced points: number i of an axis lies at `origin` + (first + i) * spacing of it.
struct Lattice {
  Vec3 origin{}, spacing{1, 1, 1};  ///< origin: the grid's
  Index3 first{}, count{};          ///< x, y, z

  [[nodiscard]] Vec3 position(const Index3& i) const {
    Vec3 p{};
    for (std::size_t a = 0; a < 3; ++a) p[a] = origin[a] + static_cast<double>(first[a] + i[a]) * spacing[a];
    return p;
  }
  [[nodiscard]] std::int64_t size() const { return count[0] * count[1] * count[2]; }
};
/// The points of a lattice through the grid's first sample that lie in the closed box {x0, y0, z0, x1, y1,
/// z1} and in the grid's; by default all of these, a cell apart. A face that a point misses by less than a
/// millionth of the spacing holds it. Throws InputError: numbers that are not finite, a spacing that is not
/// positive, a box without a point, more than 2^31 points an axis.
VDVR_API Lattice lattice_in(const Grid& grid, const std::optional<Vec3>& spacing,
                            const std::optional<std::array<double, 6>>& box);

/// float out[z][y][x]: V on the lattice, by the sampler `buffer`. With spacings of the grid's cells over
/// powers of two these are the samples that `vdvr export --oversampling` writes, to the bit. On all cores;
/// throws InputError unless `out` fits, Interrupted.
VDVR_API void values_on(const MixedVolume& volume, const Lattice& lattice, std::span<float> out,
                        const Progress& progress = {});

class VDVR_API CertifiedPoints {
 public:
  /// Must not outlive volume and certificate. `geometry`: of the scan where the certificate does not note it.
  /// Throws InputError where neither says which points are covered.
  CertifiedPoints(const MixedVolume& volume, const Certificate& certificate,
                  const std::optional<ProjectionSet>& geometry = {});

  /// In the grid's box and seen by all views: where V means something.
  [[nodiscard]] bool covered(const Vec3& point) const;
  /// Covered, in the region of interest, and no window: where the certificate promises something. With a
  /// window what is promised depends on F, which V alone does not tell.
  [[nodiscard]] bool promised(const Vec3& point) const;
  [[nodiscard]] LevelTriple level(const Vec3& point) const;  ///< z, y, x of the brick
  /// What |V - F| is at most at a promised point, V by the sampler `buffer`: of its brick, or where the file
  /// has none by brick the certificate's total. Infinite where nothing was tested.
  [[nodiscard]] float bound(const Vec3& point) const;

  /// What the scan's noise is worth at a covered point, sigma of F in its brick: an estimate. NaN where the
  /// certificate knows no noise.
  [[nodiscard]] float sigma(const Vec3& point) const;

  /// V; NaN at points that are not covered. On all cores; throws InputError unless `out` fits, Interrupted.
  void values(std::span<const Vec3> points, std::span<float> out, const Progress& progress = {}) const;
  /// What bound() says; NaN where nothing is promised. The same of a lattice, out[z][y][x].
  void bounds(std::span<const Vec3> points, std::span<float> out, const Progress& progress = {}) const;
  void bounds(const Lattice& lattice, std::span<float> out, const Progress& progress = {}) const;
  /// What sigma() says; NaN at points that are not covered.
  void sigmas(std::span<const Vec3> points, std::span<float> out, const Progress& progress = {}) const;

 private:
  [[nodiscard]] float bound_or_nan(const Vec3& point) const;
  [[nodiscard]] std::size_t brick_of(const Vec3& point) const;

  const MixedVolume* volume_;
  const Certificate* certificate_;
  std::optional<CertifiedRegion> region_;
  std::vector<float> brick_bounds_;  // empty: the total everywhere
};

}  // namespace vdvr
