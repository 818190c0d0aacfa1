#include "host/certify/crew/crew_messages.hpp"

#include "host/base/system/casts.hpp"
namespace vdvr {
namespace {

void before_samples(auto& way, Of<MixedVolume> auto& v) {
  way(v.grid, v.granularity, v.rate, v.coarsening, v.level, v.tile, v.step);
}

void put_shape(ByteWriter& out, const SampleBlock& block) {
  out(block.type, std::uint64_t{block.size()}, block.offset, block.shift);
}
SampleBlock get_block(ByteReader& in, const MemoryBudget& budget) {
  SampleBlock block;
  std::uint64_t n = 0;
  in(block.type, n);
  const auto scratch = budget.for_bytes(n * block.sample_bytes());
  if (block.type == SampleType::f32) block.f32 = {n, scratch, "a field to measure"};
  else if (block.type == SampleType::u16) block.u16 = {n, scratch, "a field to measure"};
  else block.u8 = {n, scratch, "a field to measure"};
  in(block.offset, block.shift);
  return block;
}

}  // namespace

void put_shape(ByteWriter& out, const MixedVolume& v) {
  before_samples(out, v);
  put_shape(out, v.base);
  out.put(std::uint64_t{v.tiles.size()});
  for (const auto& [kind, block] : v.tiles) {
    out(kind.level, kind.part);
    put_shape(out, block);
  }
}

MixedVolume get_shape(ByteReader& in, const MemoryBudget& budget) {
  MixedVolume v;
  before_samples(in, v);
  v.base = get_block(in, budget);
  const auto kinds = in.get<std::uint64_t>();
  for (std::uint64_t i = 0; i < kinds; ++i) {
    const auto level = in.get<LevelTriple>();
    const auto part = in.get<std::uint8_t>();
    v.tiles.emplace(TileKind(level, part), get_block(in, budget));
  }
  return v;
}

std::vector<std::span<const std::byte>> samples_of(const MixedVolume& volume) {
  std::vector<std::span<const std::byte>> out;
  for_each_block(volume, [&](const SampleBlock& b) {
    out.emplace_back(static_cast<const std::byte*>(b.data()), b.bytes());
  });
  return out;
}

std::vector<std::span<std::byte>> samples_to(MixedVolume& volume) {
  std::vector<std::span<std::byte>> out;
  for_each_block(volume, [&](SampleBlock& b) {
    void* first = b.type == SampleType::f32   ? static_cast<void*>(b.f32.data())
                  : b.type == SampleType::u16 ? static_cast<void*>(b.u16.data())
                                              : b.u8.data();
    out.emplace_back(static_cast<std::byte*>(first), b.bytes());
  });
  return out;
}

}  // namespace vdvr
