// Convex parts that cover what is certified of a cone-beam scan, for bounds that hold part by part.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "host/field/fbp/coverage.hpp"
#include "host/field/fdk/view_derivatives.hpp"

namespace vdvr {

/// What lies at most `reach` outside the covered region, across z.
class RegionOutline {
 public:
  RegionOutline(const Coverage& coverage, double reach);

  /// Corners of an upright prism that holds all of it in a box. None where none of it is there.
  [[nodiscard]] Corners part(const Vec3& low, const Vec3& high) const;
  /// The same between two heights: all of it.
  [[nodiscard]] Corners whole(const std::pair<double, double>& heights) const;
  /// Prisms that hold all of it between two heights: some 16 across, four along z.
  [[nodiscard]] std::vector<Corners> parts(const std::pair<double, double>& heights) const;

 private:
  std::vector<std::array<double, 2>> outline_;
};

}  // namespace vdvr
