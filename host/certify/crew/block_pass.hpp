// What a pass over gold asks of every block, in full, and the record that answers: whoever has the scan and
// the field can compute any block, here or elsewhere, and gives the same bytes.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "host/base/system/bytes.hpp"
#include "host/certify/gold/gold_batch.hpp"

namespace vdvr {

struct BlockPass {
  enum class Ask : std::uint8_t {
    fit,       ///< base samples
    test,      ///< the base's measure
    classify,  ///< levels above 0, with their tiles
    measure,   ///< a closed field's measure, and which parts of a brick are over the tolerance
    extract,   ///< tiles of the levels given
    remainder  ///< what T leaves out (brick_remainder.hpp)
  };
  Ask ask = Ask::test;
  bool fine = true;  ///< gold at the rate of the plan or a finer one, which any level suits
  int rate = 0;      ///< of the gold, but for `fit`
  GoldStream::For purpose = GoldStream::For::measuring;
  std::int64_t number = 0;  ///< of the passes at this rate
  NodeTolerance tolerance = 0.0;
  IntegerLattice lattice{};            ///< of tiles
  std::vector<std::uint8_t> selected;  ///< by brick
  std::vector<LevelTriple> level;      ///< by brick, for `extract`
  std::vector<CellBox> cells;          ///< by brick, those to test or measure; none: all
};

/// A block among those of all passes, in their order.
using BlockPlace = std::array<std::int64_t, 8>;

/// Which blocks a record is of: those of one batch.
struct BlockKey {
  std::int64_t rate = 0, pass = 0, z = 0;
  Index3 size{};                                   ///< bricks of a block
  std::vector<std::array<std::int64_t, 2>> first;  ///< brick of each block, x, y

  [[nodiscard]] BlockPlace place(std::size_t block) const {
    return {rate, pass, z, size[2], size[0], size[1], first[block][1], first[block][0]};
  }
};
void members(auto& way, Of<BlockKey> auto& k) { way(k.rate, k.pass, k.z, k.size, k.first); }
BlockKey get_key(ByteReader& in);

/// What one brick was found to be.
struct BrickLevels {
  BrickMeasure base;
  LevelTriple level{};
  bool passes = false;
  AxisErrors along{};
};

void members(auto& way, Of<BrickMeasure> auto& m) {
  way(m.brick, m.total, m.error, m.slack, m.passed, m.open, m.violated, m.rate);
}
void members(auto& way, Of<AxisErrors> auto& along) { way(along.of); }
/// Of `test` and `classify`; tiles follow.
void read_levels(ByteReader& in, const std::function<void(const BrickLevels&)>& visit);
/// Of `fit`: index into the base and sample.
void read_fit(ByteReader& in, const std::function<void(std::size_t, float)>& visit);
/// Whether `classify` takes what was found: on coarse gold only levels that it can test.
bool is_taken(const BlockPass& pass, const BrickLevels& levels);
inline bool is_above_base(const LevelTriple& level) { return level != LevelTriple{0, 0, 0}; }

/// Key and answer of one batch. `field`: what is measured; none for `fit` and `extract`. `selected`: of the
/// pass, on the device.
Bytes compute_record(GoldBatch& batch, const BlockPass& pass, const DeviceField* field,
                     const opencl::DeviceArray<std::uint8_t>& selected, int rate);

/// The same of `remainder`: blocks of bricks as works, one after another.
std::vector<GoldStream::Work> works_of(std::span<const BrickRemainder::Block> blocks);
/// Of a block that was looked at.
Bytes remainder_record(const BrickRemainder& remainder, const BrickRemainder::Block& block,
                       const BlockPass& pass, int rate);
/// Of a record, what follows the key.
void take_remainder(ByteReader& in, const BlockKey& key, BrickRemainder& remainder);

}  // namespace vdvr
