// What is done to a batch of gold blocks: fit, classify, extract, measure. Launches
// kernels/certify/gold/classify.cl and kernels/certify/gold/cell_test.cl.
#include "host/certify/gold/gold_batch.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "host/base/opencl/work_groups.hpp"
#include "host/base/opencl/write_later.hpp"
#include "host/base/system/casts.hpp"
#include "host/certify/gold/cell_test.hpp"
#include "host/certify/gold/node_slack.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {

static_assert(sizeof(VdvrGoldShape) == 48);

namespace {

// Of what rounding may move a sample: the worst node is seldom one of the samples that rounding moves most.
// Without room a brick at the tolerance is raised by repair, for twice its samples; with all of it too many
// bricks begin finer.
constexpr float rounding_share = 0.25f;
// Of second differences: what linear interpolation errs by.
constexpr float eighth = 0.125f;

}  // namespace

// Mirrors TileRequest of kernels/certify/gold/classify.cl.
struct GoldBatch::TileRequest {
  cl_int block, node_x, node_y;
  cl_int spacing_x, spacing_y;
  cl_int side_x, side_y, side_z;
  cl_int last_x, last_y, last_z;
  cl_int step_x, step_y, step_z;
  cl_ulong from, offset;
};

GoldBatch::~GoldBatch() { clFinish(state_.queue()); }

std::array<std::int64_t, 4> GoldBatch::place(std::int64_t brick) const { return place_.at(brick); }

// Equal blocks by their first bricks in x and y, and the selected bricks in them.
void GoldBatch::choose(std::vector<std::array<std::int64_t, 2>> first, std::int64_t first_z,
                       const std::vector<std::uint8_t>& selected) {
  const Bricks bricks(settings_.grid, settings_.granularity);
  first_brick_.clear();
  bricks_.clear();
  place_.clear();
  shape_.count = static_cast<std::int64_t>(first.size());
  for (std::size_t b = 0; b < first.size(); ++b) {
    const auto [bx, by] = first[b];
    first_brick_.push_back({bx, by, first_z});
    for (std::int64_t dz = 0; dz < bricks_z_; ++dz)
      for (std::int64_t dy = 0; dy < bricks_y_; ++dy)
        for (std::int64_t dx = 0; dx < bricks_x_; ++dx) {
          const std::int64_t brick = bricks.number({bx + dx, by + dy, first_z + dz});
          if (!selected[at(brick)]) continue;
          bricks_.push_back(brick);
          place_[brick] = {static_cast<std::int64_t>(b), dx, dy, dz};
        }
  }
}

Index3 GoldBatch::spacing_of(const LevelTriple& level) const {
  Index3 spacing{};
  for (std::size_t a = 0; a < 3; ++a)
    spacing[a] = std::int64_t{settings_.rate} << settings_.coarsening[2 - a] >> level[2 - a];
  return spacing;
}

std::size_t GoldBatch::slot(std::int64_t brick) const {
  const auto [b, x, y, z] = place(brick);
  return at(((b * bricks_z_ + z) * bricks_y_ + y) * bricks_x_ + x);
}

opencl::DeviceArray<cl_int4> GoldBatch::places(const std::vector<std::int64_t>& bricks) const {
  std::vector<cl_int4> out;
  for (const std::int64_t brick : bricks) {
    const auto [b, x, y, z] = place(brick);
    out.push_back({{to_int(b), to_int(x), to_int(y), to_int(z)}});
  }
  return opencl::copied<cl_int4>(state_, out, "bricks to test");
}

GoldBatch::TileRequest GoldBatch::request(std::int64_t brick, const Index3& spacing,
                                          const TileFit::Place& from, std::uint64_t offset) const {
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  const auto [b, x, y, z] = place(brick);
  const auto& first = first_brick_[at(b)];
  const Index3 node{x * side(), y * side(), z * side()},
      last{std::min(shape_.nx - 1, (settings_.grid.cells[0] - first[0] * g) * rate),
           std::min(shape_.ny - 1, (settings_.grid.cells[1] - first[1] * g) * rate), shape_.nz - 1};
  const auto samples = [&](std::size_t a) { return to_int(side() / spacing[a] + 1); };
  const auto last_sample = [&](std::size_t a) { return to_int((last[a] - node[a]) / spacing[a]); };
  return {.block = to_int(b),
          .node_x = to_int(node[0]),
          .node_y = to_int(node[1]),
          .spacing_x = to_int(spacing[0]),
          .spacing_y = to_int(spacing[1]),
          .side_x = samples(0),
          .side_y = samples(1),
          .side_z = samples(2),
          .last_x = last_sample(0),
          .last_y = last_sample(1),
          .last_z = last_sample(2),
          .step_x = to_int(from.step[0]),
          .step_y = to_int(from.step[1]),
          .step_z = to_int(from.step[2]),
          .from = from.first,
          .offset = offset};
}

VdvrGoldShape GoldBatch::shape_on_device() const {
  return {to_int(shape_.nx),
          to_int(shape_.ny),
          to_int(shape_.nz),
          to_int(shape_.halo),
          to_int(shape_.gold_stride),
          to_int(stride_),
          settings_.rate,
          to_int(bricks_x_),
          to_int(bricks_y_),
          to_int(bricks_z_),
          to_int(static_cast<std::int64_t>(blocks())),
          shape_.lowest};
}

opencl::Defines GoldBatch::brick_nodes() const {
  opencl::Defines defines = opencl::height_defines(state_.info, 16);
  defines.emplace_back("VDVR_BRICK_NODES", std::to_string(side()));
  return defines;
}

void GoldBatch::take_addends(const std::vector<float>& addends, const GoldErrors& errors,
                             float of_curvature) {
  addend_ = opencl::copied<float>(state_, addends, "what bricks add");
  errors_ = errors;
  of_curvature_ = of_curvature;
  has_slack_ = false;
}

void GoldBatch::require_slack() {
  if (std::exchange(has_slack_, true)) return;
  const std::uint64_t nodes = count(shape_.count * shape_.nx * shape_.ny * stride_);
  if (above_.size() < nodes) {
    above_ = {};  // before the next ones are allocated
    below_ = {};
    above_ = opencl::DeviceArray<float>(state_, nodes, "node slack above");
    below_ = opencl::DeviceArray<float>(state_, nodes, "node slack below");
  }
  node_slack(state_, settings_, {slab_, block_bricks(), errors_, eighth * of_curvature_}, shape_,
             first_brick_, gold_, margin_, addend_, above_, below_);
}

std::vector<BrickMeasure> GoldBatch::measure(const DeviceField& field, const NodeTolerance& tolerance,
                                             const opencl::DeviceArray<std::uint8_t>& selected, bool parts,
                                             std::span<const CellBox> cells) {
  std::vector<cl_int4> firsts;
  for (const auto& f : first_brick_) firsts.push_back({{to_int(f[0]), to_int(f[1]), to_int(f[2]), 0}});
  const auto first = opencl::copied<cl_int4>(state_, firsts, "first bricks");
  std::vector<float> tolerances(addend_.size(), static_cast<float>(tolerance.of_all));
  std::vector<CellBox> boxes(addend_.size());
  for (const std::int64_t brick : bricks_) {
    tolerances[slot(brick)] = static_cast<float>(tolerance.of(at(brick)));
    if (!cells.empty()) boxes[slot(brick)] = cells[at(brick)];
  }
  const auto on_device = opencl::copied<float>(state_, tolerances, "tolerances of bricks");
  const auto window = widened_window(errors_, settings_);
  const VdvrCellTest test{.z_first = to_int(shape_.z_first),
                          .z_last = to_int(shape_.z_last),
                          .counted = settings_.grid_only ? 0 : 1,
                          .windowed = settings_.window ? 1 : 0,
                          .window_low = static_cast<float>(window.first),
                          .window_high = static_cast<float>(window.second),
                          .parts = parts ? 1 : 0,
                          .curvature = eighth * of_curvature_};
  const CellTestResults found =
      cell_test(state_, field, {gold_, margin_, addend_, on_device, first, shape_on_device()}, test, selected,
                boxes, std::int64_t{settings_.granularity} * settings_.rate);
  std::vector<BrickMeasure> out;
  for (const std::int64_t brick : bricks_) {
    const std::size_t i = slot(brick);
    BrickMeasure m;
    m.brick = brick;
    m.rate = settings_.rate;
    if (found.total[i] >= 0) {
      m.total = found.total[i];
      m.error = std::max(0.0f, found.error[i]);
      m.slack = found.slack[i];
      m.passed = found.passed[i];
      m.open = found.open[i];
      m.violated = found.violated[i];
    }
    out.push_back(m);
  }
  return out;
}

// On a CPU a work-item walks along a column, on a GPU it does a node of it.
cl_int GoldBatch::nodes_each() const {
  return opencl::items_along(state_.info) > 1
             ? opencl::lanes_of(state_.info, 16)
             : to_int(std::int64_t{settings_.granularity} * settings_.rate + 1);
}

opencl::Range GoldBatch::columns_of_bricks(std::uint64_t bricks) const {
  const std::uint64_t nodes = count(std::int64_t{settings_.granularity} * settings_.rate + 1),
                      each = count(std::int64_t{nodes_each()});
  return opencl::in_groups(state_.info, {nodes * nodes * ((nodes + each - 1) / each), bricks, 1},
                           {nodes, 1, 1});
}

std::vector<AxisErrors> GoldBatch::axis_errors(const std::vector<std::int64_t>& bricks) {
  constexpr int most = AxisErrors::most_levels;
  Index3 levels{};
  for (std::size_t a = 0; a < 3; ++a) levels[a] = std::min<int>(settings_.finest()[2 - a], most);
  if (!settings_.anisotropic || *std::max_element(levels.begin(), levels.end()) == 0 || bricks.empty())
    return std::vector<AxisErrors>(bricks.size());
  const opencl::DeviceArray<cl_int4> on_device = places(bricks);
  opencl::DeviceArray<cl_int> errors(state_, bricks.size() * count(std::int64_t{6} * most),
                                     "errors along axes");
  errors.fill(0);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl::Buffer, cl::Buffer, VdvrGoldShape, cl_int,
                 cl_int, cl_int, cl_int>
      kernel(state_, "certify/gold/classify", "axis_errors", brick_nodes());
  kernel(columns_of_bricks(bricks.size()), errors.buffer(), on_device.buffer(),
         to_int(static_cast<std::int64_t>(bricks.size())), nodes_each(), gold_.buffer(), margin_.buffer(),
         shape_on_device(), to_int(levels[0]), to_int(levels[1]), to_int(levels[2]), most);
  const auto bits = errors.to_host();
  std::vector<AxisErrors> out(bricks.size());
  for (std::size_t i = 0; i < bricks.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t l = 0; l < at(most); ++l)
        for (std::size_t sign = 0; sign < 2; ++sign)
          out[i].of[a][l][sign] = std::bit_cast<float>(bits[((i * 3 + a) * at(most) + l) * 2 + sign]);
  return out;
}

// No more room than gold itself takes.
void GoldBatch::fit_tiles(Tiles tiles, bool tested, const OnFitted& visit) {
  if (tiles.empty()) return;
  if (tested) require_slack();
  const TestedGold gold{
      gold_,          margin_,      tested ? above_ : gold_, tested ? below_ : gold_, shape_on_device(),
      shape_.z_first, shape_.z_last};
  std::vector<TileToFit> asked;
  for (const auto& [brick, level] : tiles) {
    const auto [b, x, y, z] = place(brick);
    asked.push_back({b, {x * side(), y * side(), z * side()}, spacing_of(level)});
  }
  const FitSteps steps{settings_.midrange ? level_fit_steps : 0,
                       settings_.of_noise ? noise_fit_share : smooth_fit_share,
                       of_curvature_ * settings_.curvature};
  std::span<const TileToFit> rest(asked);
  while (!rest.empty()) {
    const auto part = rest.first(TileFit::together(gold, rest, side(), steps.count, gold_.size()));
    const auto first = asked.size() - rest.size();
    const auto errors = tile_fit_(gold, part, side(), steps, tested);
    visit(first, part.size(), errors);
    rest = rest.subspan(part.size());
  }
}

struct GoldBatch::Candidate {
  BrickClass* result;
  TripleSearch::Brick search;
};

// Every brick names its next level, and all that are named are fitted and tested together.
void GoldBatch::try_levels(std::vector<Candidate> open, const TripleSearch& search,
                           const NodeTolerance& tolerances) {
  while (!open.empty()) {
    std::vector<Candidate> asking, failed;
    std::vector<std::pair<std::int64_t, LevelTriple>> tiles;
    for (Candidate& c : open) {
      const auto tolerance = static_cast<float>(tolerances.of(at(c.result->base.brick)));
      if (const auto level = search.next(c.search, tolerance)) {
        tiles.emplace_back(c.result->base.brick, *level);
        asking.push_back(std::move(c));
      }
    }
    fit_tiles(tiles, true, [&](std::size_t first, std::size_t n, const std::vector<float>& errors) {
      take_passed(Tiles(tiles).subspan(first, n), errors, std::span(asking).subspan(first, n), search,
                  tolerances, failed);
    });
    open = std::move(failed);
  }
}

// What passes gets its tile; what does not, or would not once its tile is rounded, names another level.
void GoldBatch::take_passed(Tiles tiles, const std::vector<float>& errors, std::span<Candidate> candidates,
                            const TripleSearch& search, const NodeTolerance& tolerances,
                            std::vector<Candidate>& failed) {
  const auto tolerance_of = [&](std::size_t i) {
    return static_cast<float>(tolerances.of(at(tiles[i].first)));
  };
  std::vector<std::pair<std::int64_t, LevelTriple>> passed;
  std::vector<TileFit::Place> places;
  for (std::size_t i = 0; i < tiles.size(); ++i)
    if (errors[i] <= tolerance_of(i)) {
      passed.push_back(tiles[i]);
      places.push_back(tile_fit_.place(i));
    }
  auto found = copy_tiles(passed, places, tile_fit_.samples());
  auto next = found.begin();
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    float total = errors[i];
    if (errors[i] <= tolerance_of(i)) {
      std::vector<float>& tile = *next++;
      total += rounding_share * static_cast<float>(rounding_of(tile, settings_.lattice));
      if (total <= tolerance_of(i)) {
        BrickClass& result = *candidates[i].result;
        result.tile = std::move(tile);
        result.level = tiles[i].second;
        result.passes = true;
        continue;
      }
    }
    search.fail(candidates[i].search, tiles[i].second, total);
    failed.push_back(std::move(candidates[i]));
  }
}

std::vector<BrickClass> GoldBatch::classify(const DeviceField& base, const NodeTolerance& tolerance,
                                            const opencl::DeviceArray<std::uint8_t>& selected,
                                            bool gold_too) {
  std::vector<BrickClass> out;
  for (const BrickMeasure& m : measure(base, tolerance, selected)) {
    BrickClass c;
    c.base = m;
    c.base.violated = 0;
    c.passes = m.total < 0 || m.total <= static_cast<float>(tolerance.of(at(m.brick)));
    out.push_back(std::move(c));
  }
  std::vector<std::int64_t> open;
  for (const BrickClass& c : out)
    if (!c.passes) open.push_back(c.base.brick);
  const auto errors = axis_errors(open);
  std::vector<Candidate> candidates;
  for (BrickClass& c : out)
    if (!c.passes) {
      c.along = errors[candidates.size()];
      candidates.push_back({&c, {c.along, c.base.slack}});
    }
  try_levels(std::move(candidates), TripleSearch(settings_, proposing()), tolerance);

  // A tile needs a level above 0, even where the base is gold.
  LevelTriple finest = settings_.finest();
  if (finest == LevelTriple{0, 0, 0}) finest = {1, 1, 1};
  std::vector<std::pair<std::int64_t, LevelTriple>> tiles;
  for (BrickClass& c : out) {
    if (c.passes) continue;
    c.level = finest;
    tiles.emplace_back(c.base.brick, finest);
  }
  if (!gold_too) return out;
  std::vector<std::vector<float>> samples = tiles_of_gold(tiles);
  auto next = samples.begin();
  for (BrickClass& c : out)
    if (!c.passes) c.tile = std::move(*next++);
  return out;
}

// Samples at the gold rate are gold.
std::vector<std::vector<float>> GoldBatch::tiles_of_gold(Tiles tiles) {
  std::vector<TileFit::Place> places;
  const std::int64_t h = shape_.halo, wide = shape_.nx + 2 * h, deep = shape_.ny + 2 * h;
  for (const auto& [brick, level] : tiles) {
    const auto [b, x, y, z] = place(brick);
    const std::int64_t column = (b * deep + y * side() + h) * wide + x * side() + h;
    places.push_back({count(column * shape_.gold_stride + z * side() + h),
                      {shape_.gold_stride, wide * shape_.gold_stride, 1}});
  }
  return copy_tiles(tiles, places, gold_);
}

// Samples of tiles from where they lie.
std::vector<std::vector<float>> GoldBatch::copy_tiles(Tiles tiles, const std::vector<TileFit::Place>& places,
                                                      const opencl::DeviceArray<float>& samples) {
  if (tiles.empty()) return {};
  std::vector<TileRequest> requests;
  std::uint64_t total = 0;
  const auto size = [](const TileRequest& r) { return count(std::int64_t{r.side_x} * r.side_y * r.side_z); };
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    requests.push_back(request(tiles[i].first, spacing_of(tiles[i].second), places[i], total));
    total += size(requests.back());
  }
  const opencl::DeviceArray<float> out(state_, total, "tiles of a block");
  const auto on_device = opencl::copied<TileRequest>(state_, requests, "tile requests");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, VdvrGoldShape, cl_float> kernel(
      state_, "certify/gold/classify", "extract_tiles", brick_nodes());
  kernel(opencl::shared_groups(state_.info, {requests.size(), 1, 1}), out.buffer(), samples.buffer(),
         margin_.buffer(), on_device.buffer(), to_int(static_cast<std::int64_t>(requests.size())),
         shape_on_device(), static_cast<cl_float>(-settings_.kept()));
  const std::vector<float> found = out.to_host();
  std::vector<std::vector<float>> split;
  auto from = found.begin();
  for (const TileRequest& r : requests) {
    const auto end = from + static_cast<std::ptrdiff_t>(size(r));
    split.emplace_back(from, end);
    from = end;
  }
  return split;
}

std::vector<float> GoldBatch::extract(const std::vector<std::pair<std::int64_t, LevelTriple>>& tiles) {
  std::vector<std::pair<std::int64_t, LevelTriple>> fitted, gold;
  const auto is_gold = [&](const auto& tile) { return spacing_of(tile.second) == Index3{1, 1, 1}; };
  for (const auto& tile : tiles) (is_gold(tile) ? gold : fitted).push_back(tile);
  std::vector<std::vector<float>> of_gold = tiles_of_gold(gold), of_fits;
  fit_tiles(fitted, false, [&](std::size_t first, std::size_t n, const std::vector<float>&) {
    std::vector<TileFit::Place> places;
    for (std::size_t i = 0; i < n; ++i) places.push_back(tile_fit_.place(i));
    for (auto& tile : copy_tiles(Tiles(fitted).subspan(first, n), places, tile_fit_.samples()))
      of_fits.push_back(std::move(tile));
  });
  std::vector<float> out;
  auto next_gold = of_gold.begin(), next_fit = of_fits.begin();
  for (const auto& tile : tiles) {
    const std::vector<float>& samples = is_gold(tile) ? *next_gold++ : *next_fit++;
    out.insert(out.end(), samples.begin(), samples.end());
  }
  return out;
}

void GoldBatch::fit_base(const std::function<void(std::size_t, float)>& put) {
  const Grid& grid = settings_.grid;
  const Index3 n = grid.samples();
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  std::vector<NodeBox> boxes;
  for (const std::int64_t brick : bricks_) {
    const auto [b, x, y, z] = place(brick);
    boxes.push_back(
        {b, {x * side(), y * side(), z * side()}, {(x + 1) * side(), (y + 1) * side(), (z + 1) * side()}});
  }
  const BaseLattice& fitted =
      base_fit_(gold_, margin_, boxes, settings_.midrange ? base_fit_steps : 0, settings_.curvature);
  const VdvrLattice& l = fitted.shape;
  const std::vector<float> samples = fitted.samples.to_host(), &margins = margins_;
  const auto kept = static_cast<float>(-kept_margin(grid, 1));
  // Brick by brick: beside those that are wanted nothing is fitted.
  for (const std::int64_t brick : bricks_) {
    const auto [b, bx, by, bz] = place(brick);
    const auto& first = first_brick_[at(b)];
    const auto end = [&](std::int64_t in_block, std::size_t a) {
      return std::min((in_block + 1) * g, grid.cells[a] - first[a] * g);
    };
    for (std::int64_t z = bz * g; z <= end(bz, 2); ++z)
      for (std::int64_t y = by * g; y <= end(by, 1); ++y)
        for (std::int64_t x = bx * g; x <= end(bx, 0); ++x) {
          const std::int64_t column =
              (b * (shape_.ny + 2 * shape_.halo) + y * rate + shape_.halo) * (shape_.nx + 2 * shape_.halo) +
              x * rate + shape_.halo;
          if (!(margins[at(column)] >= kept)) continue;
          const std::int64_t from =
              ((b * l.cy + y + l.reach_y) * l.cx + x + l.reach_x) * l.cz + z + l.reach_z;
          put(at(((first[2] * g + z) * n[1] + first[1] * g + y) * n[0] + first[0] * g + x),
              samples[at(from)]);
        }
  }
}

float GoldBatch::largest_value() const {
  const std::vector<float> gold = gold_.to_host(), margins = margin_.to_host();
  const std::int64_t h = shape_.halo, wide = shape_.nx + 2 * h, deep = shape_.ny + 2 * h;
  float largest = 0;
  for (std::int64_t column = 0; column < shape_.count * wide * deep; ++column) {
    if (!(margins[at(column)] >= 0)) continue;
    for (std::int64_t z = std::max(-h, shape_.z_first); z <= std::min(shape_.nz - 1 + h, shape_.z_last); ++z)
      largest = std::max(largest, std::fabs(gold[at(column * shape_.gold_stride + z + h)]));
  }
  return largest;
}

}  // namespace vdvr
