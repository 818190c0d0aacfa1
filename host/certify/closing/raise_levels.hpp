// Which levels rise where a closed brick violates the node test (docs/error-bounds.md, sections on closing).
#pragma once

#include <cstdint>
#include <vector>

#include "host/certify/closing/open_bricks.hpp"
#include "host/certify/gold/search_triples.hpp"

namespace vdvr {

/// `violated`: one bit per part of the brick, as in BrickMeasure. A violation on a shared part raises the
/// bricks there that are coarser along it, by one level in the axes where they are. At a corner, where all
/// store what the coarsest of them does, it raises the coarsest. Any other raises the brick itself, along the
/// axis that errs most by `along`, or its coarsest axes where that tells nothing; one of gold raises all who
/// share the part. One inside waits where a border raises others, since what it forces shows inside. Where
/// bricks have tolerances of their own, a part whose samples are those of a looser brick raises that one, and
/// one waits for corners and edges of it that raise others. Without `along` levels are isotropic, and all
/// axes rise. `to` holds the levels after all raises of this round, from `bricks.level` on: no axis rises by
/// more than one in a round. False where all are gold already.
bool raise_levels(const OpenBricks& bricks, std::int64_t brick, std::uint32_t violated,
                  const AxisErrors* along, std::vector<LevelTriple>& to);

}  // namespace vdvr
