// The column onto which the rotation axis projects, found from the data, with how sure that is
// (docs/inputs.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vdvr/api.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// What one method says.
struct CenterWitness {
  double center = 0;       ///< column of the projections as they are prepared
  double uncertainty = 0;  ///< columns; one standard deviation, from what the data leave unexplained
  double quality = 0;      ///< in [0, 1]: share of variance, energy or motion that a centre explains
  std::string method;      ///< one phrase for the user
};

/// Methods whose centres differ by at most that many columns agree.
inline constexpr double center_agreement = 0.25;

struct CenterEstimate : CenterWitness {
  bool sure = false;
  std::string doubt;                  ///< why not, in one phrase; empty where it is sure
  std::vector<CenterWitness> others;  ///< what the other methods say
};

/// Uses angles and data of `scan`, never its `center`. Parallel beam: opposite views over the whole detector,
/// so that the axis of a half acquisition near the edge is found too; a half turn's mirror symmetry and its
/// ends; centroids. Cone beam of a full turn: opposite rays of the row nearest to the orbit's plane. It is
/// sure where two methods agree within `center_agreement`; an estimate that is not may be off by any number
/// of columns. Nothing where no method applies. Memory: a band of up to 16 rows of up to 64 views, 4 rows of
/// a half turn. Cost: the scan is read once; about columns * 512 * 512 for opposite views; 8 * views *
/// columns * 48 + 768 * views^2 for a half turn. Throws InputError for a scan without samples.
VDVR_API std::optional<CenterEstimate> find_center(const ProjectionSet& scan);

}  // namespace vdvr
