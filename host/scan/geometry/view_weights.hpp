// Angular weights w_k of filtered back-projection (docs/geometry.md, "Weights of views").
#pragma once

#include <numbers>
#include <string>
#include <vector>

#include "vdvr/expert/projections.hpp"

namespace vdvr {

struct ViewWeights {
  std::vector<double> weight;      ///< per view, radians; they add to the period unless a wedge was capped
  int wedges = 0;                  ///< capped; of an open arc without that of its opening
  int grouped_views = 0;           ///< views that share their weight with one that nearly coincides
  bool one_direction = false;      ///< all views see the same
  double seen_rad = 0;             ///< the period without its wedges
  std::vector<std::string> notes;  ///< for the user: wedges, what may be one, grouped views
};

/// Whether a scan sees its directions all around, or is open on purpose: its widest wedge then is no fault.
enum class Arc { closed, open };

/// Half the gap to both neighbouring directions modulo `period`: pi, as parallel rays have it, or 2 pi, to
/// which the weights then add. Views of one direction share its weight. Wedges that nothing saw count as four
/// usual gaps. O(n log n) time.
ViewWeights view_weights(const std::vector<double>& theta_rad, double period = std::numbers::pi,
                         Arc arc = Arc::closed);

/// Those of a parallel scan, which add to pi. Of half acquisition a view's opposite one does not see the
/// same: half of what it weighs modulo 2 pi.
ViewWeights view_weights(const ParallelGeometry& geometry);

/// Throws InputError where all views see one direction, or an arc so short that its angles must be radians
/// that were read as degrees: F would be worthless.
void require_directions(const ViewWeights& weights);

}  // namespace vdvr
