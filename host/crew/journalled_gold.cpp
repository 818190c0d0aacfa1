// Looks for the record of every block, and asks for those that nobody has.
#include "host/crew/journalled_gold.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "vdvr/error.hpp"

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
    places_[get_key(in).place()] = {&journal, number};
  }
}

std::optional<Bytes> BlockRecords::find(const BlockKey& key) const {
  const auto found = places_.find(key.place());
  if (found == places_.end()) return std::nullopt;
  return found->second.journal->at(found->second.number);
}

void BlockRecords::add(const Bytes& record) {
  if (journal_) journal_->append(record);
}

std::vector<GoldStream::Work> JournalledGold::unknown(const BlockPass& pass,
                                                      const std::function<void(ByteReader)>& apply) {
  std::vector<GoldStream::Work> works = gold_.works(pass.selected, pass.purpose);
  if (!records_ || !records_->kept()) return works;
  std::vector<GoldStream::Work> out;
  for (GoldStream::Work& w : works) {
    const auto all = std::exchange(w.first, {});
    for (std::size_t i = 0; i < all.size();) {
      const auto record = records_->find({gold_.settings().rate, pass.number, w.z, w.size(), all[i], 0});
      if (!record) {
        w.first.push_back(all[i++]);
        continue;
      }
      ByteReader in(*record);
      const std::int64_t n = get_key(in).blocks;
      if (n < 1 || static_cast<std::uint64_t>(n) > all.size() - i)
        throw InputError(
            "a record of the journal is of other blocks than this build asks for; start again without "
            "`resume`");
      apply(in);
      i += static_cast<std::size_t>(n);
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
  pass.lattice = gold_.settings().lattice;
  if (std::find(pass.selected.begin(), pass.selected.end(), 1) == pass.selected.end()) return;
  const auto shared = std::make_shared<const BlockPass>(std::move(pass));
  run_blocks(crew_, gold_, shared, field, unknown(*shared, apply),
             [&](const Bytes& record) {
               if (records_) records_->add(record);
               ByteReader in(record);
               get_key(in);
               apply(in);
             },
             progress, stage);
}

}  // namespace vdvr
