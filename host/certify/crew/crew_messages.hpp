// What processes of a crew say to one another, as bytes and back: the scan, passes, fields, pieces of work.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/certify/crew/crew.hpp"

namespace vdvr {

enum class CrewWord : std::uint8_t {
  wake,   // leader: the device that will be opened; no answer
  warm,   // leader: a program that it has built; no answer
  open,   // leader: the device to open; answer: hello
  hello,  // what it is
  scan,   // leader: a new build; answer: ready
  ready,
  field,   // leader: the shape of a field, whose samples follow
  part,    // leader: some of these samples
  learn,   // leader: records of what all need
  pass,    // leader
  work,    // leader: a piece of the pass
  halt,    // leader: what was given and not begun is not wanted any more
  record,  // of a piece
  done,    // the piece
  alive,
  failed,  // why
  dismiss  // leader: nothing more will come
};

/// Samples of a field on their way, so many bytes at a time.
constexpr std::uint64_t part_bytes = std::uint64_t{8} << 20;

template <class... T>
Bytes message_of(CrewWord word, const T&... values) {
  ByteWriter out;
  out(word, values...);
  return out.take();
}
/// `wake` or `open`.
inline Bytes message_to_open(CrewWord word, const CrewOptions& options) {
  return message_of(word, options.device_of_others, options.memory_of_others, options.scratch_of_others);
}

// --- what is said, member by member (bytes.hpp) ---

void members(auto& way, Of<Grid> auto& g) { way(g.cells, g.origin, g.spacing, g.unit); }
void members(auto& way, Of<RowExtension> auto& e) {
  way(e.half_acquisition, e.padding, e.before, e.after, e.center, e.common_heights, e.cut);
}
void members(auto& way, Of<HeightSeries> auto& s) {
  way(s.rows, s.first, s.full_turn, s.theta_rad, s.row_shift, s.column_shift);
}
void members(auto& way, Of<ParallelGeometry> auto& g) {
  way(g.columns, g.rows, g.pitch_u, g.pitch_v, g.center, g.unit, g.theta_rad, g.extension, g.column_shift,
      g.row_shift, g.axis_roll_deg, g.series);
}
void members(auto& way, Of<IntegerLattice> auto& l) {
  way(l.step, l.base, l.least, l.base_shift, l.finest_shift);
}
/// The lattice comes with each pass.
void members(auto& way, Of<GoldSettings> auto& s) {
  way(s.grid, s.granularity, s.rate, s.upsampling, s.interpolation, s.window, s.midrange, s.of_noise,
      s.anisotropic, s.base_only, s.grid_only, s.curvature, s.coarse_rate, s.finer_rate, s.coarsening,
      s.heights_bytes, s.least_reach, s.differences, s.views_together);
}
/// Without the samples.
void members(auto& way, Of<FilteredScan> auto& s) {
  way(s.geometry, s.views, s.fft_length, s.view_max, s.ramp_error);
}
void members(auto& way, Of<DetectorSups> auto& s) {
  way(s.value, s.second_u, s.second_v, s.fourth_u, s.second_uv, s.fourth_v);
}
void members(auto& way, Of<FieldSups> auto& s) { way(s.value, s.second_u, s.second_v, s.by_view); }
/// By what devices are told apart, and what is charged for their texture units.
void members(auto& way, Of<DeviceInfo> auto& d) {
  way(d.platform, d.name, d.vendor, d.version, d.driver, d.is_gpu, d.is_cpu, d.subnormals, d.images,
      d.linear_float_image, d.linear_u16_image, d.linear_u8_image, d.image3d_max);
}
void members(auto& way, Of<FilterProbe> auto& p) {
  way(p.image3d, p.weight_error, p.delta, p.constant_error, p.by_steps);
}
void members(auto& way, Of<SamplerProbe> auto& p) {
  way(p.image3d, p.weight_error, p.delta, p.constant_error, p.by_steps, p.u16, p.u8);
}
void members(auto& way, Of<Crew::Kind> auto& k) { way(k.info, k.probe, k.arithmetic); }
void members(auto& way, Of<BlockPass> auto& p) {
  way(p.ask, p.fine, p.rate, p.purpose, p.number, p.tolerance.of_all, p.tolerance.by_brick, p.lattice,
      p.selected, p.level, p.cells);
}
void members(auto& way, Of<GoldStream::Work> auto& w) { way(w.z, w.height, w.width_x, w.width_y, w.first); }

/// A volume without its samples, and where these lie.
void put_shape(ByteWriter& out, const MixedVolume& volume);
MixedVolume get_shape(ByteReader& in, const MemoryBudget& budget);
/// All of them in one order.
std::vector<std::span<const std::byte>> samples_of(const MixedVolume& volume);
std::vector<std::span<std::byte>> samples_to(MixedVolume& volume);

}  // namespace vdvr
