// Tolerances brick by brick, as whoever looks at a volume asks for them (Refinement of
// vdvr/expert/build.hpp).
#pragma once

#include <vector>

#include "host/certify/gold/node_tolerance.hpp"
#include "host/scan/units.hpp"
#include "vdvr/expert/build.hpp"

namespace vdvr {

class BrickRefinement {
 public:
  /// Refers to `wanted`. All but what `ask` is given is in `units`.
  BrickRefinement(const Refinement& wanted, const Units& units);
  /// What |V - F| may be everywhere.
  [[nodiscard]] double everywhere() const { return everywhere_; }
  /// Whether each brick's tolerance is known from the start.
  [[nodiscard]] bool knows_bricks() const { return !wanted_.by_brick.empty(); }
  /// What |V - F| may be in each brick, where that is known; else empty.
  [[nodiscard]] std::vector<double> bounds() const;
  /// Bricks begin at what is known of them. `rest` and `least` as below, before anything was measured.
  void begin(double rest, double least);
  /// Asks. `rest` is what a brick's bound holds beside what is measured at nodes, `least` the least tolerance
  /// of a node. Tolerances only fall: false where `ask` is content, or asks for nothing that bricks do not
  /// have.
  bool asks(const MixedVolume& volume, const Certificate& certificate, double rest, double least);
  /// With those asked for so far.
  [[nodiscard]] NodeTolerance with_bricks(double all) const { return {all, by_brick_}; }

 private:
  bool take(const std::vector<float>& asked, double rest, double least, const std::vector<float>& totals);

  const Refinement& wanted_;
  Units units_;
  double everywhere_;
  std::vector<float> by_brick_;
};

}  // namespace vdvr
