// Boundary closing: makes the field continuous across bricks of different levels, and packs the result into
// the stored types (docs/error-bounds.md, sections on closing). Called by build.cpp.
#pragma once

#include <vector>

#include "host/certify/open_bricks.hpp"
#include "vdvr/build.hpp"

namespace vdvr {

/// Closes and packs.
///
/// coarse: each shared face, edge and corner takes, per axis, the lowest level of its incident bricks; the
/// samples of finer bricks on it are interpolated from that one's, corners before edges before faces.
/// paper: a brick rises to the highest level of its neighbours; shared parts hold the own samples of their
/// finest brick, what is new inside is interpolated. Sampled coefficients and isotropic levels only, else
/// InputError. none: every brick keeps its own samples.
///
/// With coarse and paper, samples that several bricks store are computed from one source and rounded to the
/// coarsest of their steps, so that they hold the same bits. A base sample that only bricks which take no
/// part read may take a tile's value; every other base sample stays. Cost: the tiles once, over all cores;
/// with integer samples two or three times.
MixedVolume close_boundaries(const OpenBricks& bricks, Closing closing = Closing::coarse);

/// Bricks whose stored values or levels differ between two closings of the same grid.
std::vector<std::uint8_t> changed_bricks(const MixedVolume& before, const MixedVolume& after);

/// The tile of a brick as stored, before rounding inside it to its own step. Called by close_boundaries.
std::vector<float> tile_by_coarse(const StoredAs& stored, std::int64_t brick);
std::vector<float> tile_by_paper(const StoredAs& stored, std::int64_t brick);
/// The levels that bricks rise to under the paper's closing.
std::vector<LevelTriple> levels_by_paper(const OpenBricks& bricks);

}  // namespace vdvr
