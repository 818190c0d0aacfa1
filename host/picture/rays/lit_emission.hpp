// The interval that holds an ideal pixel's colour where light is F's own: box steps as emission.cpp takes
// them, with colours under all light that the differences of F over one base cell can give
// (docs/pixel-bounds.md, section 7). Double precision on the host.
#pragma once

#include "host/picture/rays/emission.hpp"
#include "host/picture/rays/light_range.hpp"

namespace vdvr {

struct LitRay {
  ColourInterval colours;
  std::size_t parts = 0;
  bool untested = false;  ///< a brick without a bound was seen
};

class LitEmission {
 public:
  /// Rays are clipped to `drawn`; half a base cell beside them the bounds hold where `known` says. Refers to
  /// both.
  LitEmission(const RayField& drawn, const RayField& known, const Grid& grid, const RenderOptions& options,
              double gradient_full, const EmissionOptions& emission);
  [[nodiscard]] LitRay along(const WorldRay& ray, const std::array<double, 3>& background) const;

 private:
  // The pieces of the ray and of its six neighbours, all within [first, last].
  using Pieces = std::vector<RayPiece>;
  struct Step;
  [[nodiscard]] std::array<Pieces, 6> neighbours(const WorldRay& ray, double first, double last) const;
  void take_steps(const WorldRay& ray, const Pieces& pieces, LitRay& seen) const;
  void pass(const Step& step, LitRay& seen) const;

  const RayField &drawn_, &known_;
  Vec3 half_{}, per_length_{};  // half a base cell, world units; differences over one to gradients
  MediumRanges ranges_;
  Lights lights_;
  EmissionOptions emission_;
  double colour_low_ = 0, colour_high_ = 0;  // of all that may show
};

}  // namespace vdvr
