// Passes over gold that a journal remembers: what an earlier process computed is applied and not computed
// again. Called by classify_bricks.cpp.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host/gold/gold_batch.hpp"
#include "host/system/bytes.hpp"
#include "vdvr/journal.hpp"

namespace vdvr {

class JournalledGold {
 public:
  /// Both are referred to; no journal: nullptr.
  JournalledGold(GoldStream& gold, Journal* journal) : gold_(gold), journal_(journal) {}

  /// A pass in two steps: `compute` reads from a batch all that `apply` needs, which may be called in a later
  /// process instead, with what the journal kept.
  struct Pass {
    std::function<Bytes(GoldStream::Batch&)> compute;
    std::function<void(ByteReader)> apply;
  };
  /// Batches that the journal holds are applied and not computed, the others are added to it. Passes must
  /// come in the same order in every process.
  void run(const std::vector<std::uint8_t>& selected, const Pass& pass, const Progress& progress,
           const std::string& stage, GoldStream::For purpose = GoldStream::For::measuring);

  [[nodiscard]] GoldStream& gold() { return gold_; }

 private:
  [[nodiscard]] Bytes record(std::int64_t pass, const GoldStream::Batch& batch, const Bytes& payload) const;
  std::size_t replay(std::int64_t pass, const GoldStream::Work& work, std::size_t from, const Bytes& record,
                     const std::function<void(ByteReader)>& apply);

  GoldStream& gold_;
  Journal* journal_;
  std::int64_t passes_ = 0;  // begun
};

}  // namespace vdvr
