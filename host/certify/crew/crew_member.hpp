// One device's part in a crew: its own kept gold, and the blocks that it is given.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "host/certify/crew/block_pass.hpp"
#include "host/certify/crew/gold_rates.hpp"
#include "vdvr/expert/progress.hpp"

namespace vdvr {

class CrewMember {
 public:
  /// The scan and its sups are referred to. `settings`: of the build, without the lattice, which passes
  /// bring.
  CrewMember(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
             const GoldSettings& settings)
      : state_(state), scan_(scan), sups_(sups), settings_(settings) {}

  void use(const MixedVolume& volume, const MemoryBudget& budget);
  /// Keeps the gold that the pass reads.
  void begin(std::shared_ptr<const BlockPass> pass, const Progress& progress);
  void compute(std::span<const GoldStream::Work> works, const std::function<void(Bytes)>& on_record,
               const Progress& progress);
  /// Gold is kept in memory that others have too, where `room` has some: asked once, for so many bytes.
  using RoomForGold = std::function<CommonMemory(std::uint64_t)>;
  void pool_gold(RoomForGold room) { room_for_gold_ = std::move(room); }
  /// Records of `remainder` that others computed.
  void learn(const std::vector<Bytes>& records);
  /// GoldRates::arithmetic of this device.
  [[nodiscard]] double arithmetic();

 private:
  GoldStream& stream();
  GoldRates& rates(const IntegerLattice& lattice);
  std::shared_ptr<GoldSource> source();

  opencl::State& state_;
  const FilteredScan& scan_;
  const FieldSups& sups_;
  GoldSettings settings_;
  RoomForGold room_for_gold_;
  std::shared_ptr<GoldSource> source_;
  std::optional<GoldStream> fitting_;
  std::optional<GoldRates> rates_;
  std::optional<DeviceField> field_;
  std::shared_ptr<const BlockPass> pass_;
  std::optional<opencl::DeviceArray<std::uint8_t>> selected_;
};

/// Works of a pass on a stream, record by record.
void compute_blocks(GoldStream& gold, const BlockPass& pass, const DeviceField* field,
                    const opencl::DeviceArray<std::uint8_t>& selected,
                    std::span<const GoldStream::Work> works, const std::function<void(Bytes)>& on_record,
                    const Progress& progress, const std::string& stage);

}  // namespace vdvr
