// Integrals of F along all measured rays of one detector row, with proved errors.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "host/verify/residual/covered_chords.hpp"
#include "vdvr/expert/field_options.hpp"
#include "vdvr/expert/projections.hpp"

namespace vdvr {

/// double [view][column]; 0 where the chord is empty.
struct RowIntegrals {
  std::vector<double> integral;  ///< of F over the chord
  std::vector<double> error;     ///< |integral - its exact value| at most
};

/// `row` is a parallel scan of one row, `chords` its own. Tables of as many views as `table_bytes` hold are
/// made at a time, one at least. Cost: views^2 * columns means of Primitive, views * columns^2 sums.
RowIntegrals row_integrals(const ProjectionSet& row, const FieldOptions& field, const CoveredChords& chords,
                           std::uint64_t table_bytes, const std::function<void(double)>& progress = {});

}  // namespace vdvr
