// How far the axis of rotation leans in the detector's plane, found from the data, with how sure that is
// (docs/inputs.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

struct RollEstimate {
  double roll_deg = 0;         ///< of ParallelGeometry; what is stated already is in it
  double uncertainty_deg = 0;  ///< one standard deviation, from how far bands of rows leave the line
  double center = 0;           ///< column of the axis in the middle row, of the rows as they are
  std::int64_t bands = 0;      ///< bands of rows that knew their centre
  /// Four standard deviations from what is stated, and a quarter of a column at the outermost rows.
  bool significant = false;
  std::string method;  ///< one phrase for the user
};

/// The centres of up to 16 bands of rows lie on the axis: of opposite views, else of half a turn's ends.
/// Bands are read once more along the line found, until it stands still, so that a roll of degrees is found
/// as well as one of hundredths. Nothing for cone beam, for fewer than 3 rows, and where fewer than 3 bands
/// know their centre to a column. Uses angles and data of `scan`, never its centre. Cost: three passes over
/// up to 256 rows of every view; memory: 16 rows of each.
VDVR_API std::optional<RollEstimate> find_roll(const ProjectionSet& scan);

}  // namespace vdvr
