#include "host/certify/crew/crew_member.hpp"

#include <utility>

namespace vdvr {

void compute_blocks(GoldStream& gold, const BlockPass& pass, const DeviceField* field,
                    const opencl::DeviceArray<std::uint8_t>& selected,
                    std::span<const GoldStream::Work> works, const std::function<void(Bytes)>& on_record,
                    const Progress& progress, const std::string& stage) {
  if (pass.ask == BlockPass::Ask::remainder) {
    for (const GoldStream::Work& work : works)
      for (const auto& [x, y] : work.first) {
        BrickRemainder& remainder = *gold.source()->remainder;
        const BrickRemainder::Block block{{x, y, work.z}, work.size()};
        remainder.look_at(std::span(&block, 1), progress);
        on_record(remainder_record(remainder, block, pass, gold.settings().rate));
      }
    return;
  }
  gold.run_works(
      works, pass.selected,
      [&](GoldBatch& batch) -> Take {
        return [&on_record, record = compute_record(batch, pass, field, selected, gold.settings().rate)] {
          on_record(record);
        };
      },
      progress, stage, pass.purpose);
}

std::shared_ptr<GoldSource> CrewMember::source() {
  if (source_) return source_;
  source_ = std::make_shared<GoldSource>(state_, scan_, sups_, settings_);
  if (const auto shape = room_for_gold_ ? source_->kept.common_shape() : std::nullopt)
    source_->kept.share(room_for_gold_(CommonGold::bytes_of(*shape)), false);
  return source_;
}

void CrewMember::learn(const std::vector<Bytes>& records) {
  for (const Bytes& record : records) {
    ByteReader in(record);
    const BlockKey key = get_key(in);
    take_remainder(in, key, *source()->remainder);
  }
}

// Passes of one build bring one lattice.
GoldRates& CrewMember::rates(const IntegerLattice& lattice) {
  if (!rates_) {
    fitting_.reset();
    settings_.lattice = lattice;
    rates_.emplace(state_, scan_, sups_, settings_, source());
  }
  return *rates_;
}

GoldStream& CrewMember::stream() {
  if (pass_->ask == BlockPass::Ask::fit) {
    if (!fitting_) fitting_.emplace(state_, scan_, sups_, fitting_settings(settings_), source());
    return *fitting_;
  }
  return rates(pass_->lattice).of(pass_->rate);
}

double CrewMember::arithmetic() { return GoldRates(state_, scan_, sups_, settings_, source()).arithmetic(); }

void CrewMember::use(const MixedVolume& volume, const MemoryBudget& budget) {
  field_.reset();
  field_.emplace(state_, volume, budget.for_bytes(sample_buffer_bytes(volume)));
}

void CrewMember::begin(std::shared_ptr<const BlockPass> pass, const Progress& progress) {
  selected_.reset();
  pass_ = std::move(pass);
  selected_.emplace(state_, std::span<const std::uint8_t>(pass_->selected), "bricks of a pass");
  stream().prepare(pass_->selected, pass_->purpose, progress);
}

void CrewMember::compute(std::span<const GoldStream::Work> works, const std::function<void(Bytes)>& on_record,
                         const Progress& progress) {
  compute_blocks(stream(), *pass_, field_ ? &*field_ : nullptr, *selected_, works, on_record, progress,
                 "blocks");
}

}  // namespace vdvr
