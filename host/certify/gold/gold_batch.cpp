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

static_assert(sizeof(VdvrGoldShape) == 48 && sizeof(VdvrLattice) == 36);

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
  cl_int block, node_x, node_y, node_z;
  cl_int spacing_x, spacing_y, spacing_z;
  cl_int side_x, side_y, side_z;
  cl_int last_x, last_y, last_z;
  cl_int pad;
  cl_ulong offset;
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

const LevelSamples& GoldBatch::lattice(const LevelTriple& level, const std::vector<std::int64_t>& bricks) {
  const std::int64_t side = std::int64_t{settings_.granularity} * settings_.rate;
  std::vector<NodeBox> boxes;
  for (const std::int64_t brick : bricks) {
    const auto [b, x, y, z] = place(brick);
    boxes.push_back({b, {x * side, y * side, z * side}, {(x + 1) * side, (y + 1) * side, (z + 1) * side}});
  }
  const int steps = !settings_.midrange             ? 0
                    : level == LevelTriple{0, 0, 0} ? base_fit_steps
                                                    : level_fit_steps;
  return fit_(gold_, margin_, boxes, spacing_of(level), steps, of_curvature_ * settings_.curvature);
}

GoldBatch::TileRequest GoldBatch::request(std::int64_t brick, const Index3& spacing,
                                          std::uint64_t offset) const {
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  const auto side = [&](std::size_t a) { return to_int(g * rate / spacing[a] + 1); };
  const auto [b, x, y, z] = place(brick);
  const auto& first = first_brick_[at(b)];
  TileRequest r{};
  r.block = to_int(b);
  r.node_x = to_int(x * g * rate);
  r.node_y = to_int(y * g * rate);
  r.node_z = to_int(z * g * rate);
  r.spacing_x = to_int(spacing[0]);
  r.spacing_y = to_int(spacing[1]);
  r.spacing_z = to_int(spacing[2]);
  r.side_x = side(0);
  r.side_y = side(1);
  r.side_z = side(2);
  r.last_x = to_int(std::min(shape_.nx - 1, (settings_.grid.cells[0] - first[0] * g) * rate));
  r.last_y = to_int(std::min(shape_.ny - 1, (settings_.grid.cells[1] - first[1] * g) * rate));
  r.last_z = to_int(shape_.nz - 1);
  r.offset = offset;
  return r;
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
  return {{"VDVR_BRICK_NODES", std::to_string(settings_.granularity * settings_.rate)},
          {"VDVR_LANES", std::to_string(opencl::lanes_of(state_.info, 16))}};
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

// The node test of one level, fitted, on these bricks: the largest that |V - F| may be.
std::vector<float> GoldBatch::errors_at(const LevelTriple& level, const std::vector<std::int64_t>& bricks) {
  require_slack();
  const opencl::DeviceArray<cl_int4> on_device = places(bricks);
  const LevelSamples& samples = lattice(level, bricks);
  opencl::DeviceArray<cl_int> error(state_, bricks.size(), "brick errors");
  error.fill(-1);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer,
                 cl::Buffer, VdvrGoldShape, VdvrLattice>
      level_error(state_, "certify/gold/classify", "level_error", brick_nodes());
  level_error(columns_of_bricks(bricks.size()), error.buffer(), on_device.buffer(),
              to_int(static_cast<std::int64_t>(bricks.size())), nodes_each(), samples.along.buffer(),
              gold_.buffer(), above_.buffer(), below_.buffer(), margin_.buffer(), shape_on_device(),
              samples.shape);
  std::vector<float> out;
  for (const cl_int b : error.to_host()) out.push_back(b < 0 ? -1.0f : std::bit_cast<float>(b));
  return out;
}

namespace {

// Equal tiles, in the order of the bricks.
void give_tiles(const std::vector<BrickClass*>& bricks, const std::vector<float>& samples) {
  const std::size_t size = bricks.empty() ? 0 : samples.size() / bricks.size();
  for (std::size_t i = 0; i < bricks.size(); ++i)
    bricks[i]->tile.assign(samples.begin() + static_cast<std::ptrdiff_t>(i * size),
                           samples.begin() + static_cast<std::ptrdiff_t>((i + 1) * size));
}

}  // namespace

struct GoldBatch::Candidate {
  BrickClass* result;
  TripleSearch::Brick search;
};

// Every brick names its next level, and all that name the cheapest of these are tested together. What a brick
// names next is seldom cheaper: most levels are fitted once.
void GoldBatch::try_levels(std::vector<Candidate>& candidates, const TripleSearch& search,
                           const NodeTolerance& tolerances) {
  std::map<std::size_t, std::pair<LevelTriple, std::vector<Candidate>>> by_rank;
  const auto tolerance_of = [&](const Candidate& c) {
    return static_cast<float>(tolerances.of(at(c.result->base.brick)));
  };
  const auto ask = [&](Candidate&& c) {
    if (const auto level = search.next(c.search, tolerance_of(c))) {
      auto& [named, group] = by_rank[search.rank(*level)];
      named = *level;
      group.push_back(std::move(c));
    }
  };
  for (Candidate& c : candidates) ask(std::move(c));
  while (!by_rank.empty()) {
    auto [level, group] = std::move(by_rank.begin()->second);
    by_rank.erase(by_rank.begin());
    std::vector<std::int64_t> bricks, passed;
    for (const Candidate& c : group) bricks.push_back(c.result->base.brick);
    const std::vector<float> errors = errors_at(level, bricks);
    std::vector<BrickClass*> results;
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (!(errors[i] <= tolerance_of(group[i]))) continue;
      passed.push_back(bricks[i]);
      results.push_back(group[i].result);
    }
    give_tiles(results, copy_tiles(level, passed, &fit_.last()));
    for (std::size_t i = 0; i < group.size(); ++i) {
      BrickClass& result = *group[i].result;
      const float total =
          errors[i] + rounding_share * static_cast<float>(rounding_of(result.tile, settings_.lattice));
      if (total <= tolerance_of(group[i])) {
        result.level = level;
        result.passes = true;
      } else {
        result.tile.clear();
        search.fail(group[i].search, level, total);
        ask(std::move(group[i]));
      }
    }
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
  try_levels(candidates, TripleSearch(settings_, proposing()), tolerance);

  // A tile needs a level above 0, even where the base is gold.
  LevelTriple finest = settings_.finest();
  if (finest == LevelTriple{0, 0, 0}) finest = {1, 1, 1};
  std::vector<std::int64_t> bricks;
  std::vector<BrickClass*> results;
  for (BrickClass& c : out) {
    if (c.passes) continue;
    c.level = finest;
    bricks.push_back(c.base.brick);
    results.push_back(&c);
  }
  if (gold_too) give_tiles(results, copy_tiles(finest, bricks, nullptr));
  return out;
}

// Tiles of one level from its lattice, concatenated.
std::vector<float> GoldBatch::copy_tiles(const LevelTriple& level, const std::vector<std::int64_t>& bricks,
                                         const LevelSamples* lattice) {
  if (bricks.empty()) return {};
  std::vector<TileRequest> requests;
  std::uint64_t total = 0, size = 0;
  for (const std::int64_t brick : bricks) {
    requests.push_back(request(brick, spacing_of(level), total));
    size = count(std::int64_t{requests[0].side_x} * requests[0].side_y * requests[0].side_z);
    total += size;
  }
  const opencl::DeviceArray<float> out(state_, total, "tiles of a block");
  const auto on_device = opencl::copied<TileRequest>(state_, requests, "tile requests");
  // Samples at the gold rate are gold, and gold lies as its own lattice would.
  const VdvrLattice gold{1,
                         1,
                         1,
                         to_int(shape_.halo),
                         to_int(shape_.halo),
                         to_int(shape_.halo),
                         to_int(shape_.nx + 2 * shape_.halo),
                         to_int(shape_.ny + 2 * shape_.halo),
                         to_int(shape_.gold_stride)};
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, VdvrGoldShape, VdvrLattice, cl_float>
      kernel(state_, "certify/gold/classify", "extract_tiles", brick_nodes());
  kernel({{size, requests.size(), 1}, {64, 1, 1}}, out.buffer(),
         (lattice ? lattice->samples : gold_).buffer(), margin_.buffer(), on_device.buffer(),
         to_int(static_cast<std::int64_t>(requests.size())), shape_on_device(),
         lattice ? lattice->shape : gold, static_cast<cl_float>(-settings_.kept()));
  return out.to_host();
}

std::vector<float> GoldBatch::extract(const std::vector<std::pair<std::int64_t, LevelTriple>>& tiles) {
  std::map<LevelTriple, std::vector<std::size_t>> by_level;
  for (std::size_t i = 0; i < tiles.size(); ++i) by_level[tiles[i].second].push_back(i);
  std::vector<std::vector<float>> parts(tiles.size());
  for (const auto& [level, members] : by_level) {
    std::vector<std::int64_t> bricks;
    for (const std::size_t i : members) bricks.push_back(tiles[i].first);
    const bool is_gold = spacing_of(level) == Index3{1, 1, 1};
    const auto samples = copy_tiles(level, bricks, is_gold ? nullptr : &lattice(level, bricks));
    const std::size_t size = samples.size() / members.size();
    for (std::size_t i = 0; i < members.size(); ++i)
      parts[members[i]].assign(samples.begin() + static_cast<std::ptrdiff_t>(i * size),
                               samples.begin() + static_cast<std::ptrdiff_t>((i + 1) * size));
  }
  std::vector<float> out;
  for (const auto& part : parts) out.insert(out.end(), part.begin(), part.end());
  return out;
}

void GoldBatch::fit_base(const std::function<void(std::size_t, float)>& put) {
  const Grid& grid = settings_.grid;
  const Index3 n = grid.samples();
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  const LevelSamples& fitted = lattice({0, 0, 0}, bricks_);
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
