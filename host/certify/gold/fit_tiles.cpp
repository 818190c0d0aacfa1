// Launches kernels/certify/gold/fit_tiles.cl.
#include "host/certify/gold/fit_tiles.hpp"

#include <algorithm>
#include <string>

#include "host/base/opencl/work_groups.hpp"
#include "host/base/opencl/write_later.hpp"
#include "host/base/system/casts.hpp"

namespace vdvr {

static_assert(sizeof(VdvrTileFit) == 80);

namespace {

// Heights that vectors touch beyond a column: one below it, and a vector's from its last sample on.
constexpr std::uint64_t beyond = 18;

// The brick's own samples, and of those around it, which steps read one after the other, what gold there is.
// Along an axis with a sample at every node no step looks around.
VdvrTileFit shape_of(const VdvrGoldShape& s, const TileToFit& tile, std::int64_t side, int steps) {
  const Index3 nodes{s.nx, s.ny, s.nz};
  Index3 before{}, own{}, samples{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t spacing = tile.spacing[a], around = spacing > 1 ? steps : 0,
                       last = std::min(side, nodes[a] - 1 - tile.node[a]) / spacing,
                       ahead = (tile.node[a] + s.halo) / spacing,
                       behind = (nodes[a] - 1 + s.halo - tile.node[a]) / spacing - last;
    before[a] = std::min(around, ahead);
    own[a] = last + 1;
    samples[a] = before[a] + own[a] + std::min(around, behind);
  }
  VdvrTileFit out{};
  out.block = to_int(tile.block);
  out.node_x = to_int(tile.node[0]);
  out.node_y = to_int(tile.node[1]);
  out.node_z = to_int(tile.node[2]);
  out.spacing_x = to_int(tile.spacing[0]);
  out.spacing_y = to_int(tile.spacing[1]);
  out.spacing_z = to_int(tile.spacing[2]);
  out.before_x = to_int(before[0]);
  out.before_y = to_int(before[1]);
  out.before_z = to_int(before[2]);
  out.side_x = to_int(own[0]);
  out.side_y = to_int(own[1]);
  out.side_z = to_int(own[2]);
  out.cx = to_int(samples[0]);
  out.cy = to_int(samples[1]);
  out.cz = to_int(samples[2]);
  out.stride = to_int(static_cast<std::int64_t>(opencl::round_up(count(samples[2]) + beyond, 16)));
  return out;
}

std::uint64_t lattice_of(const VdvrTileFit& t) {
  return count(std::int64_t{t.cy} * t.cx) * count(std::int64_t{t.stride});
}

// Floats of all arrays of a tile (fit_tiles.cl).
std::uint64_t room_of(const VdvrTileFit& t, std::int64_t side) {
  const auto targets = [](int samples, int spacing) { return spacing > 1 ? 2 * samples - 1 : samples; };
  const std::uint64_t along =
      count(std::int64_t{t.side_y} * t.side_x) * opencl::round_up(count(side) + 1, 16);
  const auto columns = std::int64_t{targets(t.cy, t.spacing_y)} * targets(t.cx, t.spacing_x);
  const std::uint64_t of_targets = count(columns * (t.spacing_z > 1 ? 2 : 1)) * count(std::int64_t{t.stride});
  const std::uint64_t line = count(std::int64_t{t.cz - 1} * t.spacing_z) + 16;
  return 2 * lattice_of(t) + of_targets + along + line;
}

}  // namespace

std::size_t TileFit::together(const TestedGold& gold, std::span<const TileToFit> tiles, std::int64_t side,
                              int steps, std::uint64_t floats) {
  std::uint64_t room = 0;
  std::size_t n = 0;
  for (; n < tiles.size(); ++n) {
    room += room_of(shape_of(gold.shape, tiles[n], side, steps), side);
    if (n > 0 && room > floats) break;
  }
  return n;
}

std::vector<float> TileFit::operator()(const TestedGold& gold, std::span<const TileToFit> tiles,
                                       std::int64_t side, const FitSteps& steps, bool tested) {
  tiles_.clear();
  steps_ = steps.count;
  std::uint64_t room = 0;
  for (const TileToFit& tile : tiles) {
    tiles_.push_back(shape_of(gold.shape, tile, side, steps.count));
    tiles_.back().room = room;
    room += room_of(tiles_.back(), side);
  }
  if (tiles.empty()) return {};
  if (room_.size() < room + beyond) {
    room_ = {};  // before the next one is allocated
    room_ = opencl::DeviceArray<float>(state_, room + beyond, "tiles that are fitted");
  }
  const auto on_device = opencl::copied<VdvrTileFit>(state_, tiles_, "tiles to fit");
  const opencl::DeviceArray<float> errors(state_, tiles.size(), "errors of tiles");
  opencl::Defines defines = opencl::height_defines(state_.info, 16);
  defines.emplace_back("VDVR_BRICK_NODES", std::to_string(side));
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer,
                 VdvrGoldShape, cl_int, cl_int, cl_int, cl_int, cl_float, cl_float, cl::LocalSpaceArg>
      kernel(state_, "certify/gold/fit_tiles", "fit_tiles", defines);
  kernel(opencl::shared_groups(state_.info, {tiles.size(), 1, 1}), errors.buffer(), room_.buffer(),
         on_device.buffer(), to_int(static_cast<std::int64_t>(tiles.size())), gold.gold.buffer(),
         gold.above.buffer(), gold.below.buffer(), gold.margin.buffer(), gold.shape, to_int(gold.z_first),
         to_int(gold.z_last), steps.count, tested ? 1 : 0, steps.curvature, steps.share,
         opencl::shared_room(state_.info));
  return tested ? errors.to_host() : std::vector<float>{};
}

TileFit::Place TileFit::place(std::size_t i) const {
  const VdvrTileFit& t = tiles_.at(i);
  const std::int64_t stride = t.stride, row = stride * t.cx;
  const std::uint64_t fitted = t.room + (steps_ % 2 != 0 ? lattice_of(t) : 0);
  return {fitted + count(t.before_y * row + t.before_x * stride + t.before_z + 1), {stride, row, 1}};
}

}  // namespace vdvr
