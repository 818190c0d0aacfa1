// Boundary closing: makes the field continuous across bricks of different levels, and packs the result into
// the stored types (docs/error-bounds.md, sections on closing).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "host/certify/closing/open_bricks.hpp"
#include "vdvr/expert/comparison.hpp"
#include "vdvr/expert/mixed_volume.hpp"
#include "vdvr/expert/scratch.hpp"

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

/// The same again and again, while bricks rise: after the first time only tiles that what rose bears on are
/// made again. Each volume is that of close_boundaries() to the bit. What of the bricks is no level or sample
/// stays as it is. Memory: some 12 bytes a brick.
class CloseBoundaries {
 public:
  /// `bricks` is referred to. `room`: for the tiles of a volume.
  CloseBoundaries(const OpenBricks& bricks, Closing closing, MemoryBudget budget = {});

  MixedVolume first();
  /// `before`: what the last call gave. `moved`: bricks whose level or samples changed since.
  MixedVolume again(const MixedVolume& before, const std::vector<std::uint8_t>& moved);
  /// Of the last call: bricks of levels above 0 whose tiles were made. The other bricks that take part store
  /// what they did.
  [[nodiscard]] const std::vector<std::uint8_t>& made() const { return made_; }

 private:
  // How the tiles of a pass of find_steps() were stored, and which steps they asked for.
  struct Pass {
    std::vector<SampleType> type;
    std::vector<std::int8_t> shift, needed;
  };
  [[nodiscard]] MixedVolume volume(const MixedVolume* before);
  void find_steps();
  void update_units();
  void widen_types();
  [[nodiscard]] std::int8_t needed_shift(std::int64_t brick) const;
  [[nodiscard]] std::vector<std::uint8_t> unlike(const Pass& pass, bool other_bricks) const;
  [[nodiscard]] std::vector<std::uint8_t> with_neighbours(const std::vector<std::uint8_t>& bricks) const;
  void number_tiles(MixedVolume& v) const;
  [[nodiscard]] std::vector<float> tile_of(std::int64_t brick) const;
  void for_each_tile(const std::function<void(std::int64_t)>& visit) const;
  [[nodiscard]] std::vector<float> shared_base() const;
  void share(std::int64_t brick, std::vector<float>& base) const;

  const OpenBricks& open_;
  Closing closing_;
  MemoryBudget budget_;
  StoredAs stored_;
  std::vector<SampleType> type_;  // by brick; of those that have tiles
  std::vector<std::int8_t> shift_;
  std::vector<std::uint8_t> rim_;           // bricks beside some that take no part
  std::vector<Pass> passes_;                // of the last call
  std::vector<std::uint8_t> moved_, made_;  // of this call
};

/// Bricks whose stored values or levels differ between two closings of the same grid: of those flagged in
/// `among`, or of all where that is empty.
std::vector<std::uint8_t> changed_bricks(const MixedVolume& before, const MixedVolume& after,
                                         const std::vector<std::uint8_t>& among = {});

/// The tile of a brick as stored, before rounding inside it to its own step.
std::vector<float> tile_by_coarse(const StoredAs& stored, std::int64_t brick);
std::vector<float> tile_by_paper(const StoredAs& stored, std::int64_t brick);
/// The levels that bricks rise to under the paper's closing.
std::vector<LevelTriple> levels_by_paper(const OpenBricks& bricks);

}  // namespace vdvr
