// Parts of space where F is in a range: which must exist, which may, what surely connects and what surely
// does not (docs/measure.md, "Components").
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "vdvr/expert/measure.hpp"

namespace vdvr {

struct ComponentsOptions {
  /// Rows of components whose possible volume is less are left out; all are counted.
  double least_volume = 0;
  /// Whose components are asked for.
  std::vector<Vec3> points;
  std::uint64_t max_memory_bytes = 0;  ///< of the table and what it is made of; 0: no limit
};

enum class Answer : std::uint8_t { no, maybe, yes };
/// "no", "cannot tell", "yes".
VDVR_API const char* text_of(Answer answer);

/// A possible component: F is in the range nowhere around it, so that nothing in it connects with any other.
struct MeasuredComponent {
  Interval volume;              ///< of the points in it where F is in the range
  std::array<double, 6> box{};  ///< it lies within: x0, y0, z0, x1, y1, z1
  std::int64_t sure_parts = 0;  ///< in each F is in the range throughout, and all of a part is connected
  /// Whether a component of F reaches from the region's lower to its upper side, along x, y, z.
  std::array<Answer, 3> spans{};

  /// F is in the range somewhere in it, so that at least one component of F exists there.
  [[nodiscard]] bool certain() const { return sure_parts > 0 || volume.lo > 0; }
};

/// Where a point of the options lies.
struct ComponentOfPoint {
  Answer within = Answer::no;                  ///< whether F is in the range there
  std::optional<std::int64_t> possible, sure;  ///< numbers of its possible component and its sure part
  bool certain = false;                        ///< MeasuredComponent::certain() of the former
};
/// Whether two points are connected in what lies in the range.
VDVR_API Answer connected(const ComponentOfPoint& a, const ComponentOfPoint& b);

struct ComponentTable {
  std::vector<MeasuredComponent> rows;   ///< by possible volume, the largest first
  std::vector<ComponentOfPoint> points;  ///< as asked for
  std::int64_t possible = 0;             ///< possible components, rows or not
  std::int64_t certain = 0;              ///< F has at least so many components
  std::int64_t sure_parts = 0;
  Interval volume;  ///< of all
  double uncertain_volume = 0,
         largest_uncertain = 0;  ///< of those that may not exist: of all, of the largest
};

}  // namespace vdvr
