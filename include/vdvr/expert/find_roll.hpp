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
  double uncertainty_deg = 0;  ///< one standard deviation, by the jackknife over sixteen blocks of heights
  double center = 0;           ///< column of the axis, across it from the middle of the rows as they are
  std::int64_t pairs = 0;      ///< of views that look from either side
  /// Four standard deviations from what is stated, and a quarter of a column at the detector's edges.
  bool significant = false;
  std::string method;  ///< one phrase for the user
};

/// Opposite views, up to 32 pairs, are mirror images about the axis: its place and roll are those under which
/// their pictures differ least, from coarse ones to those of up to 256 columns. Half a turn without its end
/// has two pairs, of its ends and what the line through the two views before them says. Nothing for cone
/// beam, for samples that moved along columns, for fewer than 4 rows, where views are more than 15 degrees
/// apart, and where find_center() finds none. Uses angles and data of `scan`, never its centre. Cost: about
/// 100 passes over pictures of 64 columns, some 10 over each finer size; memory: the pictures, in double.
VDVR_API std::optional<RollEstimate> find_roll(const ProjectionSet& scan);

}  // namespace vdvr
