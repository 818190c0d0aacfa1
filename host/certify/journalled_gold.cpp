// Writes a record for each batch of a pass, and reads those of an earlier process.
#include "host/certify/journalled_gold.hpp"

#include <array>

#include "vdvr/error.hpp"

namespace vdvr {

void JournalledGold::run(const std::vector<std::uint8_t>& selected, const Pass& pass,
                         const Progress& progress, const std::string& stage, GoldStream::For purpose) {
  const std::int64_t number = passes_++;
  gold_.run_unknown(
      selected,
      [&](GoldStream::Batch& batch) {
        const Bytes payload = pass.compute(batch);
        if (journal_) journal_->append(record(number, batch, payload));
        pass.apply(ByteReader(payload));
      },
      [&](const GoldStream::Work& work, std::size_t from) -> std::size_t {
        const auto kept = journal_ ? journal_->next() : std::nullopt;
        return kept ? replay(number, work, from, *kept, pass.apply) : 0;
      },
      progress, stage, purpose);
}

// A record says which blocks of which pass it is of: how many share a batch depends on the memory left, which
// a resumed process need not have alike.
Bytes JournalledGold::record(std::int64_t pass, const GoldStream::Batch& batch, const Bytes& payload) const {
  const auto& first = batch.first_brick();
  const Index3 size = batch.block_bricks();
  ByteWriter out;
  for (const std::int64_t n :
       {std::int64_t{gold_.settings().rate}, pass, first.front()[2], size[0], size[1], size[2],
        first.front()[0], first.front()[1], static_cast<std::int64_t>(first.size())})
    out.put(n);
  Bytes bytes = out.take();
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

std::size_t JournalledGold::replay(std::int64_t pass, const GoldStream::Work& work, std::size_t from,
                                   const Bytes& record, const std::function<void(ByteReader)>& apply) {
  ByteReader in(record);
  bool same = true;
  for (const std::int64_t n : {std::int64_t{gold_.settings().rate}, pass, work.z, work.width_x, work.width_y,
                               work.height, work.first[from][0], work.first[from][1]})
    same = in.get<std::int64_t>() == n && same;
  const auto n = in.get<std::int64_t>();
  if (!same || n < 1 || static_cast<std::uint64_t>(n) > work.first.size() - from)
    throw InputError(
        "the journal's next record is of other blocks than this build asks for; start again without "
        "`resume`");
  apply(in);
  return static_cast<std::size_t>(n);
}

}  // namespace vdvr
