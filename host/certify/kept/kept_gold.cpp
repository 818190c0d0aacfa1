// Keeps tiles of back-projected columns. Calls back_project.cpp; fill_kept_gold.cpp makes gold of them.
#include "host/certify/kept/kept_gold.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <set>
#include <stdexcept>

#include "host/base/system/casts.hpp"
#include "host/field/fbp/back_project.hpp"
#include "host/field/fbp/cosine_series.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/field/fdk/region_parts.hpp"

namespace vdvr {
namespace {

// Kept nodes to a cell of the grid: their spacing is at most half a pixel.
std::int64_t rate_of(double spacing, double pitch) {
  std::int64_t rate = 1;
  while (spacing / static_cast<double>(rate) > 0.5 * pitch * (1 + 1e-9)) rate *= 2;
  return rate;
}

}  // namespace

KeptGold::KeptGold(opencl::State& state, const FilteredScan& scan, const FieldSups& sups, const Grid& grid,
                   double reach, int upsampling, Interpolation interpolation, std::uint64_t heights_bytes)
    : state_(state),
      scan_(scan),
      upsampler_(state, scan, ColumnMethod::accurate),
      sups_(sups),
      grid_(grid),
      reach_(reach),
      heights_bytes_(heights_bytes),
      interpolation_(interpolation),
      coverage_(scan.geometry, scan.views),
      common_bytes_(state) {
  const ParallelGeometry& g = scan.geometry;
  const double across = std::max(grid.spacing[0], grid.spacing[1]);
  rates_ = {rate_of(across, g.pitch_u), rate_of(across, g.pitch_u), rate_of(grid.spacing[2], g.pitch_v)};
  set_spacing();
  if (!scan.views.empty()) {
    keep_heights(reach);
    return;
  }
  // Filters read across the edge of what is kept, and nowhere may a column be clamped.
  const double margin =
      reach + (static_cast<double>(half_taps_[0]) + 1) * std::hypot(spacing_[0], spacing_[1]) + g.pitch_u;
  reach_ = margin - g.pitch_u;
  columns_ = upsampled_columns(g.columns, upsampling, margin / g.pitch_u);
  stride_ = column_stride(g.rows);
}

void KeptGold::set_spacing() {
  for (std::size_t a = 0; a < 3; ++a) spacing_[a] = grid_.spacing[a] / static_cast<double>(rates_[a]);
}

// Cone beam: where a view looks closest its frequencies are the highest, and half a pixel at the axis may be
// too far for so many taps. More of them cost less than nodes that are twice as dense. Heights are kept
// themselves: no two nodes see the same rows.
void KeptGold::keep_heights(double reach) {
  // Of the largest value that F can have, what filters along an axis may err: the remainder sees it 16 times.
  // A fifth of it where a few more taps do that.
  constexpr double most_error = 2e-5, enough = 4e-6;
  constexpr std::int64_t fewest = 10, most = 14;
  half_taps_ = {fewest, fewest, fewest};
  const auto improve = [&](std::size_t a) {  // x and y share theirs
    if (half_taps_[a] < most) half_taps_[a] += 2;
    else {
      rates_[a] *= 2;
      half_taps_[a] = fewest;
    }
    if (a > 0) return;
    rates_[1] = rates_[0];
    half_taps_[1] = half_taps_[0];
  };
  for (bool dense = false; !dense;) {
    const ConeLattice lattice = cone_lattice(reach);
    if (lattice.reach < lattice.claimed) {  // tiles whose middle reaches a source: smaller ones
      half_taps_[0] = most;
      improve(0);
      set_spacing();
      continue;
    }
    reach_ = lattice.reach;
    cone_.emplace(state_, scan_, upsampler_, sups_, coverage_, lattice);
    dense = true;
    for (const std::size_t a : {std::size_t{0}, std::size_t{2}}) {
      const double allowed = (half_taps_[a] < most ? enough : most_error) * cone_->sup();
      if (cone_->best_filter(2, a, to_int(2 * half_taps_[a]), allowed).error <= allowed) continue;
      dense = false;
      improve(a);
    }
    set_spacing();
  }
  const ConeLattice& lattice = cone_->lattice();
  run_ = Run{};
  run_->low = lattice.low;
  run_->count = 8 * lattice.groups;
  run_->stride = lattice.stride;
  run_->a_page = std::max<std::size_t>(1, page_bytes / (4 * count(side * side * run_->stride)));
}

// What tests read of gold beyond the region: a cell that meets it and what the remainder's stencils reach.
Vec3 KeptGold::claimed() const {
  constexpr double cells = 2.5;
  const double across = cells * std::hypot(grid_.spacing[0], grid_.spacing[1]);
  return {across, across, cells * grid_.spacing[2]};
}

// How much farther than `from` nodes may lie so that lambda stays positive there and at the middles of their
// tiles: the nearest source counts. Negative where tiles are too large.
double KeptGold::room_to_sources(double from, const std::pair<double, double>& heights) const {
  const double half_tile = 0.5 * static_cast<double>(side) * std::hypot(spacing_[0], spacing_[1]);
  double room = HUGE_VAL;
  const Corners all = RegionOutline(coverage_, from).whole(heights);
  for (std::size_t k = 0; k < scan_.views.size(); ++k)
    for (const Vec3& corner : all) {  // lambda is affine
      const ViewMatrix& m = scan_.views[k];
      const double lambda = projected(m, corner)[2];
      if (!(lambda > 0)) throw source_too_close(k);
      room = std::min(room, 0.75 * lambda / std::hypot(m[2][0], m[2][1]) - half_tile);
    }
  return room;
}

// Heights that cells at the covered region read, and no others: samples are fitted, and gold is filtered,
// from some way around.
ConeLattice KeptGold::cone_lattice(double reach) const {
  constexpr double cells_around = 4;
  const double around =
      cells_around * grid_.spacing[2] + (static_cast<double>(half_taps_[2]) + 1) * spacing_[2];
  const auto node = [&](double z) { return (z - grid_.origin[2]) / spacing_[2]; };
  const auto margin = static_cast<double>(2 * run_margin);
  const double low = std::clamp(node(coverage_.heights().first - around), -margin, 1e9),
               high = std::clamp(node(coverage_.heights().second + around), low,
                                 static_cast<double>(grid_.cells[2] * rates_[2]) + margin);
  ConeLattice out{grid_.origin, spacing_};
  out.low = 8 * floor_div(static_cast<std::int64_t>(std::floor(low)), 8);
  out.groups = floor_div(static_cast<std::int64_t>(std::ceil(high)) - out.low, 8) + 1;
  out.stride = column_stride(8 * out.groups + 16);
  // Filters read around nodes with bounds.
  const double diagonal = std::hypot(spacing_[0], spacing_[1]),
               read = (static_cast<double>(half_taps_[0]) + 1) * diagonal,
               claimed_z = claimed()[2] + (static_cast<double>(half_taps_[2]) + 1) * spacing_[2];
  out.claimed = claimed()[0] + read;
  // Along x filters fill gold itself, along y what those read.
  out.less = {read, read - static_cast<double>(half_taps_[0]) * spacing_[0], 0};
  out.less_z = claimed_z - claimed()[2];
  out.claimed_z = {coverage_.heights().first - claimed_z, coverage_.heights().second + claimed_z};
  out.reach = std::min(std::max(reach + read, out.claimed),
                       out.claimed + room_to_sources(out.claimed, out.claimed_z));
  return out;
}

GoldLattice KeptGold::lattice(const Grid& grid, int rate) const {
  GoldLattice out;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto coarser = std::llround(grid.spacing[a] / grid_.spacing[a]);
    if (coarser < 1 ||
        std::abs(grid.spacing[a] - static_cast<double>(coarser) * grid_.spacing[a]) > 1e-9 * grid.spacing[a])
      throw std::logic_error("KeptGold: a grid of other cells");
    const std::int64_t kept = rates_[a] * coarser;  // to a cell
    out.phases[a] = to_int(std::max<std::int64_t>(1, rate / kept));
    out.step[a] = to_int(std::max<std::int64_t>(1, kept / rate));
    if (kept * out.phases[a] != std::int64_t{rate} * out.step[a])
      throw std::logic_error("KeptGold: rates that are no powers of two");
  }
  return out;
}

// --- what is kept ---

KeptGold::Span KeptGold::span(const GoldLattice& lattice, std::size_t axis, const GoldBox& box) const {
  const std::int64_t phases = lattice.phases[axis], step = lattice.step[axis], first = box.first[axis],
                     last = first + box.nodes[axis] - 1;
  Span s;
  const std::int64_t begin = phases > 1 ? floor_div(first, phases) : first * step;
  s.intervals = phases > 1 ? floor_div(last, phases) - begin + 1 : box.nodes[axis];
  s.skipped = phases > 1 ? first - begin * phases : 0;
  s.low = begin - half_taps_[axis] + 1;
  s.count = (s.intervals - 1) * step + 2 * half_taps_[axis];
  return s;
}

// From a multiple of a run on, by the grid's own count: a node's height is summed up alike in every box.
KeptGold::Span KeptGold::heights_span(const GoldLattice& lattice, const GoldBox& box) const {
  Span s = span(lattice, 2, box);
  const std::int64_t low = floor_div(s.low, AlongZ::run) * AlongZ::run, last = s.low + s.count;
  s.count = (last - low + AlongZ::run - 1) / AlongZ::run * AlongZ::run;
  s.low = low;
  if (cone_) {  // heights that are not kept are of nodes that nobody uses
    const std::int64_t end = run_->low + run_->count;
    s.low = std::clamp(low, run_->low, end - AlongZ::run);
    s.count = std::clamp<std::int64_t>(low + s.count - s.low, AlongZ::run, end - s.low);
  }
  return s;
}

ColumnBlocks KeptGold::blocks_of(std::span<const TileAt> tiles) const {
  ColumnBlocks blocks{side, side, spacing_[0], spacing_[1], {}, {}};
  for (const auto& [y, x] : tiles)
    blocks.first.push_back({grid_.origin[0] + static_cast<double>(x * side) * spacing_[0],
                            grid_.origin[1] + static_cast<double>(y * side) * spacing_[1]});
  return blocks;
}

// The largest that any of its nodes may have.
double KeptGold::margin_of(const TileAt& tile) const {
  const double half = 0.5 * static_cast<double>(side);
  return coverage_.margin(grid_.origin[0] + (static_cast<double>(tile.second * side) + half) * spacing_[0],
                          grid_.origin[1] + (static_cast<double>(tile.first * side) + half) * spacing_[1]) +
         half * std::hypot(spacing_[0], spacing_[1]);
}

bool KeptGold::is_kept(const TileAt& tile) const {
  if (!(margin_of(tile) >= -reach_)) return false;
  if (!part_) return true;
  const std::array<std::int64_t, 2> first{tile.second * side, tile.first * side};
  for (std::size_t a = 0; a < 2; ++a) {
    const double low = grid_.origin[a] + static_cast<double>(first[a]) * spacing_[a],
                 high = low + static_cast<double>(side - 1) * spacing_[a];
    if (high < part_->low[a] || low > part_->high[a]) return false;
  }
  return true;
}

void KeptGold::PartOfTile::add(const PartOfTile& other) {
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = std::min(low[a], other.low[a]);
    end[a] = std::max(end[a], other.end[a]);
  }
}

bool KeptGold::PartOfTile::holds(const PartOfTile& other) const {
  for (std::size_t a = 0; a < 3; ++a)
    if (other.low[a] < low[a] || other.end[a] > end[a]) return false;
  return true;
}

// Of cone beam the heights too.
KeptGold::PartsOfTiles KeptGold::read_by(const GoldLattice& lattice,
                                         const std::vector<GoldBox>& boxes) const {
  PartsOfTiles out;
  for (const GoldBox& box : boxes) {
    const Span x = span(lattice, 0, box), y = span(lattice, 1, box);
    PartOfTile part;
    if (cone_) {
      const Span z = heights_span(lattice, box);
      part.low[2] = z.low - run_->low;
      part.end[2] = part.low[2] + z.count;
    }
    for (std::int64_t ty = floor_div(y.low, side); ty * side < y.low + y.count; ++ty)
      for (std::int64_t tx = floor_div(x.low, side); tx * side < x.low + x.count; ++tx) {
        if (!is_kept({ty, tx})) continue;
        part.low[0] = std::max<std::int64_t>(0, x.low - tx * side);
        part.low[1] = std::max<std::int64_t>(0, y.low - ty * side);
        part.end[0] = std::min(side, x.low + x.count - tx * side);
        part.end[1] = std::min(side, y.low + y.count - ty * side);
        out[{ty, tx}].add(part);
      }
  }
  return out;
}

std::vector<KeptGold::TileAt> KeptGold::new_tiles(const GoldLattice& lattice,
                                                  const std::vector<GoldBox>& boxes) const {
  std::vector<TileAt> out;
  for (const auto& [tile, part] : read_by(lattice, boxes))
    if (!tiles_.contains(tile)) out.push_back(tile);
  return out;
}

void KeptGold::will_read(const GoldLattice& lattice, const std::vector<GoldBox>& boxes) {
  if (!sparing_) return;
  for (const auto& [tile, part] : read_by(lattice, boxes)) to_be_read_[tile].add(part);
}

// Those of which something is missing, with all of them that was made and will be read: a tile is made anew
// in another place.
std::vector<KeptGold::TileAt> KeptGold::sparing_tiles(const GoldLattice& lattice,
                                                      const std::vector<GoldBox>& boxes) {
  const auto is_made = [&](const PartsOfTiles::value_type& of) {
    const auto found = made_.find(of.first);
    return found != made_.end() && found->second.holds(of.second);
  };
  PartsOfTiles parts = read_by(lattice, boxes);
  if (std::ranges::all_of(parts, is_made)) return {};
  for (const auto& [tile, part] : std::exchange(to_be_read_, {})) parts[tile].add(part);
  std::erase_if(parts, is_made);
  std::vector<TileAt> out;
  for (const auto& [tile, part] : parts) {
    made_[tile].add(part);
    out.push_back(tile);
  }
  return out;
}

std::vector<KeptGold::TileAt> KeptGold::all_tiles() const {
  std::vector<TileAt> out;
  const auto beyond = [&](std::size_t a) {
    return static_cast<std::int64_t>(std::ceil(reach_ / spacing_[a]));
  };
  const auto last = [&](std::size_t a) { return floor_div(grid_.cells[a] * rates_[a] + beyond(a), side); };
  for (std::int64_t ty = floor_div(-beyond(1), side); ty <= last(1); ++ty)
    for (std::int64_t tx = floor_div(-beyond(0), side); tx <= last(0); ++tx)
      if (is_kept({ty, tx})) out.emplace_back(ty, tx);
  return out;
}

std::int64_t KeptGold::missing(const GoldLattice& lattice, const std::vector<GoldBox>& boxes) const {
  return static_cast<std::int64_t>(new_tiles(lattice, boxes).size());
}

void KeptGold::prepare(const GoldLattice& lattice, const std::vector<GoldBox>& boxes,
                       const Progress& progress) {
  if (common_) make_common(progress);
  const PartsOfTiles made_before = made_;
  std::vector<TileAt> tiles = sparing_ ? sparing_tiles(lattice, boxes) : new_tiles(lattice, boxes);
  if (tiles.empty()) return;
  std::vector<TileAt> all = all_tiles();
  std::erase_if(all, [&](const TileAt& tile) { return tiles_.contains(tile); });
  if (!sparing_ && (part_ || 2 * tiles.size() > all.size())) {
    std::set<TileAt> both(tiles.begin(), tiles.end());
    both.insert(all.begin(), all.end());
    tiles.assign(both.begin(), both.end());
  }
  const auto start = std::chrono::steady_clock::now();
  try {
    if (cone_) back_project_heights(tiles, progress);
    else back_project_tiles(tiles, progress);
  } catch (...) {  // crews end what they prepare when others have done the work, and go on
    made_ = made_before;
    throw;
  }
  prepare_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void KeptGold::back_project_heights(std::span<const TileAt> tiles, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t tile = count(side * side * run_->stride);
  std::vector<opencl::DeviceArray<float>> made;
  std::vector<ConePage> pages;
  for (std::size_t i = 0; i < tiles.size(); i += run_->a_page) {
    const std::size_t n = std::min(run_->a_page, tiles.size() - i);
    made.emplace_back(state_, scratch(), n * tile, "gold that is kept");
    if (!scratch()) made.back().fill(0.0f);
    const ColumnBlocks blocks = blocks_of(tiles.subspan(i, n));
    pages.push_back({nullptr, blocks.first, wanted(tiles.subspan(i, n), blocks)});
  }
  for (std::size_t i = 0; i < pages.size(); ++i) pages[i].out = &made[i];
  cone_->back_project(pages, progress);
  // Only now: what was ended half-way is not kept.
  for (std::size_t i = 0; i < tiles.size(); ++i)
    tiles_[tiles[i]] =
        run_->tiles[tiles[i]] = {run_->pages.size() + i / run_->a_page, i % run_->a_page * tile};
  std::ranges::move(made, std::back_inserter(run_->pages));
  const double all = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  // Tables are made anew each time; who makes everything at once makes them once.
  column_seconds_ = std::max(column_seconds_, cone_->table_seconds());
  tile_seconds_ += all - cone_->table_seconds();
}

// The detector's rows [first, end), upsampled along columns, and the time that takes.
UpsampledSlab KeptGold::upsampled(std::int64_t first, std::int64_t end) {
  std::vector<double> heights;
  for (std::int64_t r = first; r < end; ++r) heights.push_back(static_cast<double>(r));
  const auto start = std::chrono::steady_clock::now();
  UpsampledSlab slab = upsampler_(columns_, heights);
  state_.queue.finish();
  column_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return slab;
}

// Rows in runs whose upsampled columns fit beside the tiles; every run serves all tiles.
void KeptGold::back_project_tiles(std::span<const TileAt> tiles, const Progress& progress) {
  const ParallelGeometry& g = scan_.geometry;
  const std::uint64_t tile = count(side * side * stride_);
  const auto each = at(std::max<std::int64_t>(1, static_cast<std::int64_t>(page_bytes / (4 * tile))));
  std::vector<opencl::DeviceArray<float>> made;
  for (std::size_t i = 0; i < tiles.size(); i += each) {
    const std::size_t n = std::min(each, tiles.size() - i);
    made.emplace_back(state_, scratch(), n * tile, "gold that is kept");
    // Columns that nobody reads are not computed: let them be finite.
    if (!scratch()) made.back().fill(0.0f);
  }
  std::int64_t rows = static_cast<std::int64_t>(opencl::round_up(count(g.rows), 16));
  while (rows > 16 && upsampler_.slab_bytes(columns_, rows) >
                          std::min(state_.memory.left() / 3, state_.info.max_allocation))
    rows = static_cast<std::int64_t>(opencl::round_up(count(rows / 2), 16));
  for (std::int64_t first = 0; first < g.rows; first += rows) {
    const std::int64_t end = std::min(g.rows, first + rows);
    const UpsampledSlab slab = upsampled(first, end);
    const auto begun = std::chrono::steady_clock::now();
    for (std::size_t page = 0; page < made.size(); ++page) {
      const std::size_t begin = page * each, n = std::min(each, tiles.size() - begin);
      ColumnBlocks blocks = blocks_of(tiles.subspan(begin, n));
      blocks.wanted = wanted(blocks);
      blocks.out_stride = stride_;
      blocks.out_row = first;
      back_project(state_, g, slab, blocks, interpolation_, made[page]);
      report(progress, "gold",
             (static_cast<double>(first) + static_cast<double>(end - first) * static_cast<double>(page + 1) /
                                               static_cast<double>(made.size())) /
                 static_cast<double>(g.rows));
    }
    state_.queue.finish();  // before the next rows are allocated
    tile_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }
  for (std::size_t i = 0; i < tiles.size(); ++i)
    tiles_[tiles[i]] = {pages_.size() + i / each, i % each * tile};
  std::ranges::move(made, std::back_inserter(pages_));
}

KeptGold::Shares KeptGold::all_over_part() {
  const auto sizes = [&] {
    const std::vector<TileAt> tiles = all_tiles();
    Shares s{0, static_cast<double>(tiles.size())};
    for (const auto& [first, last] : wanted(blocks_of(tiles))) s.columns += std::max(0, last - first + 1);
    return s;
  };
  const Shares of_part = sizes();
  const std::optional<PlanePart> part = std::exchange(part_, std::nullopt);
  const Shares all = sizes();
  part_ = part;
  return {all.columns / std::max(1.0, of_part.columns), all.tiles / std::max(1.0, of_part.tiles)};
}

// By row of each tile the first and last node that is kept: the region is convex, so that all between them
// are.
std::vector<std::array<std::int32_t, 2>> KeptGold::wanted(const ColumnBlocks& blocks) const {
  std::vector<std::array<std::int32_t, 2>> out;
  const auto in_part = [&](double x, double y) {
    return !part_ || (x >= part_->low[0] && x <= part_->high[0] && y >= part_->low[1] && y <= part_->high[1]);
  };
  for (const auto& [x0, y0] : blocks.first)
    for (std::int64_t y = 0; y < side; ++y) {
      std::array<std::int32_t, 2> row{to_int(side), -1};
      for (std::int64_t x = 0; x < side; ++x)
        if (const double at_x = x0 + static_cast<double>(x) * spacing_[0],
            at_y = y0 + static_cast<double>(y) * spacing_[1];
            in_part(at_x, at_y) && coverage_.margin_above(at_x, at_y, -reach_) >= -reach_) {
          row[0] = std::min(row[0], to_int(x));
          row[1] = to_int(x);
        }
      out.push_back(row);
    }
  return out;
}

// Of cone beam: whole tiles, or what of them is read.
std::vector<std::array<std::int32_t, 4>> KeptGold::wanted(std::span<const TileAt> tiles,
                                                          const ColumnBlocks& blocks) const {
  std::vector<std::array<std::int32_t, 4>> out;
  for (const auto& [first, last] : wanted(blocks)) {
    const std::int64_t y = std::ssize(out) % side;
    PartOfTile part{{0, 0, 0}, {side, side, run_->count}};
    if (sparing_) part = made_.at(tiles[out.size() / at(side)]);
    const bool none = y < part.low[1] || y >= part.end[1];
    out.push_back({std::max(first, to_int(part.low[0])), none ? -1 : std::min(last, to_int(part.end[0] - 1)),
                   to_int(part.low[2]), to_int(part.end[2])});
  }
  return out;
}

std::shared_ptr<Scratch> KeptGold::scratch() const {
  return state_.info.is_gpu ? nullptr : scan_.samples.scratch();
}

std::uint64_t KeptGold::bytes() const {
  return (cone_ ? 0 : 4 * count(side * side * stride_) * tiles_.size()) + run_bytes();
}

}  // namespace vdvr
