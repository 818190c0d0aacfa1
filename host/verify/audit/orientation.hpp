// The 48 turns and mirrors of a volume's axes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "vdvr/expert/grid.hpp"

namespace vdvr {

/// The volume whose x, y, z are the axes `axes` of another, run through backwards where `mirrored`.
struct Orientation {
  std::array<int, 3> axes{0, 1, 2};
  std::array<bool, 3> mirrored{false, false, false};

  [[nodiscard]] bool is_plain() const { return *this == Orientation{}; }
  /// How much it takes to explain: what is simpler is believed first.
  [[nodiscard]] int changes() const;
  /// Whether it turns, or mirrors too.
  [[nodiscard]] bool is_turn() const;
  bool operator==(const Orientation&) const = default;
};

/// Plain first, then by changes().
const std::vector<Orientation>& orientations();

/// The middle of the box stays in place as its axes are named anew.
Grid oriented(const Grid& grid, const Orientation& orientation);
/// Where a sample of the oriented grid is in the grid itself.
Index3 source_of(const Index3& sample, const Grid& grid, const Orientation& orientation);
Volume oriented(const Volume& volume, const Orientation& orientation);

/// "mirrored along x", "turned by 180 degrees about z"; nothing where it is plain.
std::string words_of(const Orientation& orientation);

}  // namespace vdvr
