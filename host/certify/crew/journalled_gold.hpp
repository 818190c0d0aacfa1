// Passes over gold, spread over a crew, that a journal remembers: what somebody computed before is applied
// and not computed again.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/certify/crew/block_pass.hpp"
#include "host/certify/crew/crew.hpp"
#include "host/certify/crew/gold_rates.hpp"
#include "vdvr/expert/journal.hpp"

namespace vdvr {

/// The records of a build: those of its own journal, and of the journals of its parts, by their blocks.
/// Blocks end in any order, so records are found wherever they lie.
class BlockRecords {
 public:
  /// All are referred to; no journal: nullptr.
  explicit BlockRecords(Journal* journal, std::vector<Journal*> parts = {})
      : journal_(journal), parts_(std::move(parts)) {}
  void begin(const JournalHead& head);
  [[nodiscard]] bool kept() const { return journal_ != nullptr; }
  /// Where the record of a block is.
  struct Place {
    Journal* journal = nullptr;
    std::size_t number = 0;
    auto operator<=>(const Place&) const = default;
  };
  [[nodiscard]] std::optional<Place> find(const BlockPlace& block) const;
  [[nodiscard]] static Bytes at(const Place& place) { return place.journal->at(place.number); }
  void add(const Bytes& record);

 private:
  void read(Journal& journal);

  Journal* journal_;
  std::vector<Journal*> parts_;
  std::map<BlockPlace, Place> places_;
};

class JournalledGold {
 public:
  /// All are referred to. No records, no crew: nullptr.
  JournalledGold(GoldStream& gold, bool fine, BlockRecords* records, Crew* crew)
      : gold_(gold), fine_(fine), records_(records), crew_(crew) {}

  /// Applies the records of all blocks: first those that are known, then the others as they come. Passes must
  /// come in the same order in every process, those too that ask for no brick. `field`: what is measured, as
  /// the crew was told.
  void run(BlockPass pass, const DeviceField* field, const std::function<void(ByteReader)>& apply,
           const Progress& progress, const std::string& stage);

  [[nodiscard]] GoldStream& gold() { return gold_; }

 private:
  std::vector<GoldStream::Work> unknown(const BlockPass& pass, const std::function<void(ByteReader)>& apply);

  GoldStream& gold_;
  bool fine_;
  BlockRecords* records_;
  Crew* crew_;
  std::int64_t passes_ = 0;  // begun
};

/// Passes of one rate are numbered through all attempts.
struct JournalledRates {
  explicit JournalledRates(GoldRates& gold, BlockRecords* records = nullptr, Crew* crew = nullptr)
      : fine(gold.fine(), true, records, crew) {
    if (GoldStream* stream = gold.coarse()) coarse.emplace(*stream, false, records, crew);
    if (GoldStream* stream = gold.finer()) finer.emplace(*stream, true, records, crew);
  }
  JournalledGold fine;
  std::optional<JournalledGold> coarse, finer;
};

}  // namespace vdvr
