// Deterministic damage: mutant number `index` of a seed list is the same bytes everywhere.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/fuzz/target.hpp"

namespace vdvr::fuzz {

/// Bit flips, truncation, blocks moved, copied, cleared, removed or doubled, sizes overwritten with numbers
/// at the edges of their types, a tail of another seed; text: numbers and words changed as text; HDF5: the
/// numbers, flags and parameters of filters changed.
std::string mutant(const std::vector<std::string>& seeds, Contents contents, std::uint64_t seed,
                   std::uint64_t index);

}  // namespace vdvr::fuzz
