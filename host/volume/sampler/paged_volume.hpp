// What a PagedVolume knows of its bricks, and how the tiles of some of them become a volume on the device.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "host/volume/sampler/resident_volume.hpp"
#include "vdvr/expert/paged_volume.hpp"

namespace vdvr {

struct PagedVolume::Impl {
  Impl(Device& device, const MixedVolume& volume, std::uint64_t memory_bytes);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// Bytes on the device that a brick adds, with `lit` those of lit samples too; of bricks that read the base
  /// 0.
  [[nodiscard]] std::uint64_t bytes_of(std::size_t brick, bool lit) const;
  /// What is on the device with any part.
  [[nodiscard]] std::uint64_t fixed_bytes(bool lit) const;
  /// With a part whose bricks take so much, counting the bricks that every part has twice at most.
  [[nodiscard]] std::uint64_t device_bytes(std::uint64_t bricks_bytes, bool lit) const;
  /// Whether buffers can hold a part with so many samples, and so many bytes of them as they are stored.
  [[nodiscard]] bool is_addressable(std::uint64_t samples, std::uint64_t stored_bytes, bool lit) const;
  [[nodiscard]] std::uint64_t samples_of(std::size_t brick) const;
  [[nodiscard]] std::uint64_t stored_bytes_of(std::size_t brick) const;
  /// `here`: by brick 1 where its tile is wanted; bricks that every part has are added.
  [[nodiscard]] std::unique_ptr<ResidentVolume::Impl> load(std::vector<std::uint8_t> here, bool lit) const;
  /// No place of a sample in any part is above.
  [[nodiscard]] std::uint64_t highest_place() const;

  opencl::State* state;
  const MixedVolume* volume;
  std::shared_ptr<const FieldFacts> facts;
  VdvrGrid grid;
  std::uint64_t whole_lit = 0;  ///< samples of the whole volume
  std::uint64_t memory = 0;
  std::uint64_t asked = 0;             ///< of memory in all; 0: what the account has
  std::vector<std::uint32_t> anchors;  ///< the bricks of each kind's tile 0: with any part
  mutable PagingCounts counts;

 private:
  std::uint64_t on_host_ = 0;  ///< of the account
  struct Kind {
    TileKind name;
    const SampleBlock* block = nullptr;
    std::uint32_t first = 0;    ///< number of its first tile among its triple's
    std::uint64_t samples = 0;  ///< of a tile
    std::uint64_t tile_bytes = 0;
  };
  void find_kinds();
  [[nodiscard]] VolumePart part_of(std::vector<std::uint8_t> here) const;

  std::vector<Kind> kinds_;             ///< in the order of the sample buffer
  std::vector<std::uint16_t> kind_of_;  ///< by brick: 1 + its kind, 0 where it reads the base
};

}  // namespace vdvr
