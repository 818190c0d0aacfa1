// One round of refinement for pictures: bounds of all pixels, bricks' shares in those that are above, smaller
// bounds for these bricks.
#pragma once

#include <cstdint>
#include <vector>

#include "host/picture/rays/ray_walk.hpp"
#include "host/picture/refine/spend.hpp"
#include "vdvr/expert/picture_refinement.hpp"

namespace vdvr {

class PictureRounds {
 public:
  /// `parts`: values of V a cell. Two do for volumes as built, whose cells are fine where F turns.
  explicit PictureRounds(const PictureRefinementOptions& options, int parts = 2)
      : options_(options), parts_(parts) {}

  /// Looks at a volume of that many samples, whose bricks have these bounds. What |V - F| may be at most by
  /// brick, infinite where nothing less is asked than so far; empty where pictures are within the tolerance,
  /// or nothing that is asked for would be new. Cost: as pixel_shares(), and the box steps of all pixels.
  std::vector<float> look(const RayField& field, const PictureViews& views, const std::vector<float>& bounds,
                          const Index3& bricks, std::uint64_t samples, const Progress& progress);
  [[nodiscard]] const std::vector<PictureRound>& rounds() const { return rounds_; }
  /// Whether the last volume is within the tolerance.
  [[nodiscard]] bool met() const { return !rounds_.empty() && rounds_.back().worst <= options_.levels; }

 private:
  PictureRefinementOptions options_;
  int parts_;
  std::vector<PictureRound> rounds_;
  std::vector<float> loosest_;  // bounds of bricks, of all volumes that were looked at
};

}  // namespace vdvr
