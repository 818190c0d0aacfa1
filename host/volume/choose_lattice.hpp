// The lattice of integer samples that suits a base and, beside it, the texture units that will read it
// (quantise.hpp).
#pragma once

#include "host/volume/quantise.hpp"

namespace vdvr {

/// The largest integer of u8 or u16.
std::int64_t most_code(SampleType type);

/// What a device's texture unit may err by beside its filter of float32 samples, as a share of all that the
/// type holds (filter_errors() in sampler_terms.hpp); 0 without such a unit.
struct FilterErrors {
  double u8 = 0, u16 = 0;
};

/// As choose_lattice() of quantise.hpp, but `automatic` takes no type whose filter may err by more than
/// `most_rounding`: what integers save would go into the bricks that have to make up for it.
IntegerLattice choose_lattice(std::span<const float> base, StorageChoice choice, double most_rounding,
                              int density, const FilterErrors& filters);

}  // namespace vdvr
