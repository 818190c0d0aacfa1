// Looks for the record of every block, and asks for those that nobody has.
#include "host/certify/crew/journalled_gold.hpp"

#include <algorithm>
#include <memory>
#include <set>
#include <utility>

namespace vdvr {

void BlockRecords::begin(const JournalHead& head) {
  if (!journal_) return;
  journal_->begin(head);
  read(*journal_);
  for (Journal* part : parts_) {
    part->begin(head);
    read(*part);
  }
}

void BlockRecords::read(Journal& journal) {
  for (std::size_t number = 0; const auto record = journal.next(); ++number) {
    ByteReader in(*record);
    const BlockKey key = get_key(in);
    for (std::size_t i = 0; i < key.first.size(); ++i) places_[key.place(i)] = {&journal, number};
  }
}

std::optional<BlockRecords::Place> BlockRecords::find(const BlockPlace& block) const {
  const auto found = places_.find(block);
  if (found == places_.end()) return std::nullopt;
  return found->second;
}

void BlockRecords::add(const Bytes& record) {
  if (journal_) journal_->append(record);
}

std::vector<GoldStream::Work> JournalledGold::unknown(const BlockPass& pass,
                                                      const std::function<void(ByteReader)>& apply) {
  std::vector<GoldStream::Work> works = gold_.works(pass.selected, pass.purpose);
  if (!records_ || !records_->kept()) return works;
  std::vector<GoldStream::Work> out;
  std::set<BlockRecords::Place> applied;
  for (GoldStream::Work& w : works) {
    const BlockKey key{gold_.settings().rate, pass.number, w.z, w.size(), std::exchange(w.first, {})};
    for (std::size_t i = 0; i < key.first.size(); ++i) {
      const auto place = records_->find(key.place(i));
      if (!place) {
        w.first.push_back(key.first[i]);
      } else if (applied.insert(*place).second) {
        const Bytes record = BlockRecords::at(*place);
        ByteReader in(record);
        get_key(in);
        apply(in);
      }
    }
    if (!w.first.empty()) out.push_back(std::move(w));
  }
  return out;
}

void JournalledGold::run(BlockPass pass, const DeviceField* field,
                         const std::function<void(ByteReader)>& apply, const Progress& progress,
                         const std::string& stage) {
  pass.number = passes_++;
  pass.fine = fine_;
  pass.rate = gold_.settings().rate;
  pass.lattice = gold_.settings().lattice;
  if (std::find(pass.selected.begin(), pass.selected.end(), 1) == pass.selected.end()) return;
  const auto shared = std::make_shared<const BlockPass>(std::move(pass));
  Works works = unknown(*shared, apply);
  if (works.empty()) report(progress, stage, 1);  // all of it was in the journal
  if (crew_ && !works.empty()) crew_->look_at(gold_, gold_.bricks_of(works, shared->selected), progress);
  run_blocks(
      crew_, gold_, shared, field, std::move(works),
      [&](const Bytes& record) {
        if (records_) records_->add(record);
        ByteReader in(record);
        get_key(in);
        apply(in);
      },
      progress, stage);
}

}  // namespace vdvr
