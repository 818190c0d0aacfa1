// The certified upper end of |W - F| between samples, by the means of `verify`: F once more, and a bound for
// every cell of a gold on which W is trilinear (docs/error-bounds.md, "What verify does").
#pragma once

#include <optional>
#include <vector>

#include "host/base/opencl/state.hpp"
#include "host/verify/audit/audited_volume.hpp"
#include "vdvr/expert/exact_field.hpp"

namespace vdvr {

/// A box of the audited volume, in its cells, where |W - F| may be large.
struct WorstBox {
  double bound = 0;
  Vec3 low{0, 0, 0}, high{0, 0, 0};
};

struct AuditBound {
  double upper = 0;
  int finest_rate = 0;
  std::vector<WorstBox> worst;  ///< the largest bounds first, at most 32
};

/// `sharp`: a bound that is up to so many times what was found at nodes needs no finer gold. `within`: nor
/// one below it, nor any where some node is above. `density`: units_of(scan). Cost: that of an exhaustive
/// `verify`.
AuditBound bound_between(opencl::State& state, const ExactField& exact, const AuditedVolume& w, double sharp,
                         std::optional<double> within, int density, const Progress& progress);

}  // namespace vdvr
