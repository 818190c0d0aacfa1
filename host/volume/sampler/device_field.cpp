// Uploads a stored field as it is stored: integers stay integers.
#include "host/volume/sampler/device_field.hpp"

#include <algorithm>

#include "host/base/system/scratch_pass.hpp"

namespace vdvr {

opencl::Defines field_defines(const MixedVolume& v, RecordKind records) {
  return {{"VDVR_SAMPLE_TYPES", std::to_string(sample_types(v))},
          {"VDVR_RECORDS", std::to_string(static_cast<int>(records))}};
}

std::uint64_t highest_place(const MixedVolume& v) {
  const int types = sample_types(v);
  const std::uint64_t smallest = (types & 1 << VDVR_U8) != 0 ? 1 : (types & 1 << VDVR_U16) != 0 ? 2 : 4;
  return sample_buffer_bytes(v) / smallest;
}

DeviceField::DeviceField(opencl::State& state, const MixedVolume& v, const std::shared_ptr<Scratch>& scratch)
    : DeviceField(state, v, PackedRecords(v, tile_offsets(v), record_kind(v)), scratch) {}

DeviceField::DeviceField(opencl::State& state, const MixedVolume& v, const PackedRecords& records,
                         const std::shared_ptr<Scratch>& scratch)
    : samples(state, state.info.is_gpu ? nullptr : scratch, sample_buffer_bytes(v), "certified samples"),
      bricks(state, std::span<const std::uint32_t>(records.words()), "brick records"),
      grid(sampler_grid(v)),
      defines(field_defines(v, records.kind())),
      highest_place(vdvr::highest_place(v)) {
  ScratchPass pass;
  pass.add_all(v);
  const auto put = [&](const SampleBlock& block, std::uint64_t first) {
    const auto* from = static_cast<const std::uint8_t*>(block.data());
    for (std::uint64_t at = 0; at < block.bytes(); at += ScratchPass::at_once) {
      const std::uint64_t n = std::min(ScratchPass::at_once, block.bytes() - at);
      samples.write({from + at, n}, first + at);
      pass.touched(n);
    }
  };
  put(v.base, 0);
  const auto offsets = tile_offsets(v);
  for (const auto& [triple, block] : v.tiles) put(block, offsets.at(triple));
}

DeviceField::DeviceField(opencl::State& state, const MixedVolume& v, const PackedRecords& records,
                         const std::function<void(std::span<std::uint8_t>)>& fill)
    : samples(state, sample_buffer_bytes(v), "certified samples"),
      bricks(state, std::span<const std::uint32_t>(records.words()), "brick records"),
      grid(sampler_grid(v)),
      defines(field_defines(v, records.kind())),
      highest_place(vdvr::highest_place(v)) {
  samples.write_mapped(fill);
}

opencl::Defines coarse_defines(const VdvrGrid& grid) {
  return {{"VDVR_COARSE_X", std::to_string(grid.coarse_x)},
          {"VDVR_COARSE_Y", std::to_string(grid.coarse_y)},
          {"VDVR_COARSE_Z", std::to_string(grid.coarse_z)}};
}

}  // namespace vdvr
