// A ray through the cells of a volume, whatever their level: piece by piece, with V as a cubic in Bernstein
// form and the bound of |V - F| in its brick (docs/pixel-bounds.md). Double precision on the host; the
// reference for certified pictures, and what draws those of surfaces and maxima.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "host/field/fbp/coverage.hpp"
#include "host/volume/brick_layout.hpp"
#include "vdvr/expert/camera.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/raycast.hpp"

namespace vdvr {

/// Coefficients of a cubic over a piece: it lies between the least and the largest, and has b[0] and b[3] at
/// the piece's ends.
using Cubic = std::array<double, 4>;

inline double least(const Cubic& b) { return std::min({b[0], b[1], b[2], b[3]}); }
inline double largest(const Cubic& b) { return std::max({b[0], b[1], b[2], b[3]}); }
inline Cubic part_of(const Cubic& b, double from, double to) {
  const auto blossom = [&](double r, double s, double t) {
    const auto mix = [](double x, double y, double f) { return (1 - f) * x + f * y; };
    const double p = mix(b[0], b[1], r), q = mix(b[1], b[2], r), o = mix(b[2], b[3], r);
    return mix(mix(p, q, s), mix(q, o, s), t);
  };
  return {blossom(from, from, from), blossom(from, from, to), blossom(from, to, to), blossom(to, to, to)};
}

struct RayPiece {
  double first = 0, last = 0;  ///< along the ray, world units
  Cubic value{};
  std::size_t brick = 0;
  double bound = 0;  ///< of |V - F|, with the rounding of `value`; infinite where nothing was tested
};

struct WorldRay {
  Vec3 origin{}, direction{};  ///< the direction has length 1

  [[nodiscard]] Vec3 at(double t) const {
    return {origin[0] + t * direction[0], origin[1] + t * direction[1], origin[2] + t * direction[2]};
  }
};
/// Through the middle of pixel (x, y), row 0 on top.
WorldRay pixel_ray(const Camera& camera, std::int64_t width, std::int64_t height, std::int64_t x,
                   std::int64_t y);

class RayField {
 public:
  /// `bounds` by brick; `coverage`: beside it F is not defined. Refers to all of them.
  RayField(const MixedVolume& volume, const std::vector<float>& bounds, const Coverage& coverage,
           const std::optional<std::array<double, 6>>& roi = {});
  /// The same within the grid and a clip.
  RayField(const MixedVolume& volume, const std::vector<float>& bounds, const Clip& clip);

  /// The part of the ray within the covered cylinder, the grid and the region of interest, from the eye on,
  /// rounded inward; empty (first >= last) where it misses them.
  [[nodiscard]] std::pair<double, double> clipped(const WorldRay& ray) const;

  /// Calls visit(piece) from front to back until it gives false.
  template <class Visit>
  void walk(const WorldRay& ray, Visit&& visit) const {
    const auto [first, last] = clipped(ray);
    walk_between(ray, first, last, visit);
  }
  /// The same of a part of the ray that lies within the grid, up to rounding.
  template <class Visit>
  void walk_between(const WorldRay& ray, double first, double last, Visit&& visit) const {
    if (!(first < last)) return;
    Steps bricks(*this, ray, first, last);
    for (;;) {
      const double end = bricks.end();
      if (!walk_brick(ray, bricks.index(), bricks.begin(), end, visit) || !bricks.next()) return;
    }
  }
  /// Smallest spacing of the grid.
  [[nodiscard]] double cell() const { return cell_; }

 private:
  // A walk over equal boxes: bricks of the grid, or a brick's cells.
  class Steps {
   public:
    Steps(const RayField& field, const WorldRay& ray, double first, double last);
    Steps(const std::array<double, 3>& low, const std::array<double, 3>& side, const Index3& count,
          const WorldRay& ray, double first, double last);
    [[nodiscard]] const Index3& index() const { return index_; }
    [[nodiscard]] double begin() const { return begin_; }
    [[nodiscard]] double end() const {
      return std::max(begin_, std::min({last_, exit_[0], exit_[1], exit_[2]}));
    }
    bool next();

   private:
    Index3 index_{}, count_{};
    std::array<double, 3> exit_{}, low_{}, side_{};
    WorldRay ray_;
    double begin_, last_;
    void set_exit(std::size_t axis);
  };

  template <class Visit>
  bool walk_brick(const WorldRay& ray, const Index3& brick, double first, double last, Visit&& visit) const {
    if (!(first < last)) return true;
    const BrickSamples samples(volume_, brick);
    std::array<double, 3> low{}, side{};
    Index3 count{};
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = volume_.grid.origin[a] +
               static_cast<double>(brick[a] * volume_.granularity) * volume_.grid.spacing[a];
      side[a] = std::ldexp(volume_.grid.spacing[a], -samples.per_cell()[a]);
      count[a] = std::max<std::int64_t>(1, samples.end()[a]);
    }
    const std::size_t number = number_of(brick);
    Steps cells(low, side, count, ray, first, last);
    for (;;) {
      const double end = cells.end();
      if (end > cells.begin() &&
          !visit(piece_of(samples, cells.index(), low, side, ray, cells.begin(), end, number)))
        return false;
      if (!cells.next()) return true;
    }
  }
  [[nodiscard]] std::size_t number_of(const Index3& brick) const;
  [[nodiscard]] RayPiece piece_of(const BrickSamples& samples, const Index3& cell,
                                  const std::array<double, 3>& low, const std::array<double, 3>& side,
                                  const WorldRay& ray, double first, double last, std::size_t brick) const;

  const MixedVolume& volume_;
  const std::vector<float>& bounds_;
  Index3 bricks_{};
  std::array<double, 6> box_{};
  std::array<double, 2> axis_{0, 0};
  double radius_ = 0, cell_ = 1;
};

}  // namespace vdvr
