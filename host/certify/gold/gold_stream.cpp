// Streams gold. Calls kept_gold.cpp and node_slack.cpp.
#include "host/certify/gold/gold_stream.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "host/base/opencl/write_later.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/certify/gold/gold_batch.hpp"
#include "host/certify/gold/gold_blocks.hpp"
#include "host/field/fbp/reconstruct.hpp"
#include "host/volume/bricks.hpp"

namespace vdvr {
namespace {

// Room for 16-lane reads that begin at the last node of the last column.
constexpr std::int64_t gold_room = 64;
// Margin of a column outside the grid: below any that is tested or kept.
constexpr float beyond_grid = -1e30f;

// Seconds of the device's work, not of its enqueueing.
class Stopwatch {
 public:
  explicit Stopwatch(opencl::State& state) : state_(state) {}
  double lap() {
    state_.queue.finish();
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  opencl::State& state_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

GoldStream::GoldStream(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                       const GoldSettings& settings, std::shared_ptr<GoldSource> source)
    : state_(state), settings_(settings), coverage_(scan.geometry, scan.views), source_(std::move(source)) {
  const std::int64_t g = settings.granularity;
  if (!source_) source_ = std::make_shared<GoldSource>(state, scan, sups, settings);
  lattice_ = source_->kept.lattice(settings.grid, settings.rate);
  errors_ = source_->kept.errors(lattice_);
  if (settings.finer_rate > settings.rate) {
    Finer finer;
    finer.lattice = source_->kept.lattice(settings.grid, settings.finer_rate);
    finer.errors = source_->kept.errors(finer.lattice);
    finer.of_curvature =
        std::pow(static_cast<float>(settings.rate) / static_cast<float>(settings.finer_rate), 2.0f);
    finer_ = std::move(finer);
  }
  // Second differences look one node beyond a block, fits further.
  if (settings.midrange)
    fit_halo_ = settings.base_only ? base_fit_steps * settings.rate : level_fit_steps * settings.rate / 2;
  halo_ = fit_halo_;
  // About 16 x 16 x 16 base cells at once: large enough that halos are cheap, small enough for caches. Never
  // by memory: fits of levels that are coarse along an axis look further than the halo, so that samples near
  // a block's rim depend on where it lies. The same scan, grid and tolerance give the same volume.
  block_bricks_ = slab_bricks_ = std::max<std::int64_t>(1, 128 / (g * settings.rate));
}

GoldStream::~GoldStream() = default;

double GoldStream::samples(std::int64_t width_x, std::int64_t width_y, std::int64_t height) const {
  const std::int64_t side = std::int64_t{settings_.granularity} * settings_.rate,
                     nz = std::min(height * settings_.granularity, settings_.grid.cells[2]) * settings_.rate;
  const std::int64_t more = 1 + 2 * halo_;
  return static_cast<double>((width_x * side + more) * (width_y * side + more)) *
         static_cast<double>(opencl::round_up(count(nz + more), 16));
}

// Equal blocks together, layer by layer.
std::vector<GoldStream::Work> GoldStream::partition(const std::vector<std::uint8_t>& selected) const {
  std::vector<Work> works;
  for (const BrickBox& box :
       cover_bricks(Bricks(settings_.grid, settings_.granularity).along(), selected, block_bricks(),
                    [&](const Index3& n) { return samples(n[0], n[1], n[2]); })) {
    if (works.empty() || works.back().z != box.first[2] || works.back().size() != box.size)
      works.push_back({box.first[2], box.size[2], box.size[0], box.size[1], {}});
    works.back().first.push_back({box.first[0], box.first[1]});
  }
  return works;
}

// The nodes of a block, its halo included.
GoldBox GoldStream::box(const Work& work, const std::array<std::int64_t, 2>& first) const {
  const std::int64_t side = std::int64_t{settings_.granularity} * settings_.rate;
  const SlabShape slab = slab_of(work);
  return {{first[0] * side - halo_, first[1] * side - halo_, work.z * side - halo_},
          {slab.cells_x * settings_.rate + 1 + 2 * halo_, slab.cells_y * settings_.rate + 1 + 2 * halo_,
           slab.cells_z * settings_.rate + 1 + 2 * halo_}};
}

std::vector<GoldBox> GoldStream::boxes(std::span<const Work> works) const {
  std::vector<GoldBox> out;
  for (const Work& w : works)
    for (const auto& first : w.first) out.push_back(box(w, first));
  return out;
}

// The share of a block's columns that may be kept, from a coarse raster: the others are not computed.
double GoldStream::kept_share(const Work& w, const std::array<std::int64_t, 2>& first) const {
  const Grid& grid = settings_.grid;
  constexpr int raster = 8;
  int kept = 0;
  for (int j = 0; j < raster; ++j)
    for (int i = 0; i < raster; ++i) {
      const double bx = static_cast<double>(first[0]) + static_cast<double>(w.width_x) * (i + 0.5) / raster,
                   by = static_cast<double>(first[1]) + static_cast<double>(w.width_y) * (j + 0.5) / raster;
      kept +=
          coverage_.margin(grid.origin[0] + bx * settings_.granularity * grid.spacing[0],
                           grid.origin[1] + by * settings_.granularity * grid.spacing[1]) >= -settings_.kept()
              ? 1
              : 0;
    }
  return static_cast<double>(kept) / (raster * raster);
}

void GoldStream::begin(For purpose) {
  purpose_ = purpose;
  if (purpose == For::proposing && !finer_)
    throw std::logic_error("GoldStream: no finer rate to propose for");
  halo_ = purpose == For::measuring ? 1 : fit_halo_;
}

double GoldStream::samples(const std::vector<std::uint8_t>& selected, For purpose) {
  begin(purpose);
  double out = 0;
  for (const Work& w : partition(selected))
    for (const auto& first : w.first) out += samples(w.width_x, w.width_y, w.height) * kept_share(w, first);
  return out;
}

std::int64_t GoldStream::missing_tiles(const std::vector<std::uint8_t>& selected, For purpose) {
  begin(purpose);
  return source_->kept.missing(lattice_, boxes(partition(selected)));
}

void GoldStream::prepare(const std::vector<std::uint8_t>& selected, For purpose, const Progress& progress) {
  begin(purpose);
  source_->kept.prepare(lattice_, boxes(partition(selected)), progress);
}

void GoldStream::will_measure(const std::vector<std::uint8_t>& selected) {
  begin(For::measuring);
  source_->kept.will_read(lattice_, boxes(partition(selected)));
  if (!settings_.base_only) source_->remainder->will_require(selected);
}

void GoldStream::run(const std::vector<std::uint8_t>& selected, const OnBatch& on_batch,
                     const Progress& progress, const std::string& stage, For purpose) {
  const Compute compute = [&](Batch& batch) {
    on_batch(batch);
    return Take([] {});
  };
  run_parts(works(selected, purpose), selected, false, compute, progress, stage);
}

std::vector<GoldStream::Work> GoldStream::works(const std::vector<std::uint8_t>& selected, For purpose) {
  begin(purpose);
  return partition(selected);
}

double GoldStream::cost(const Work& w) const {
  return static_cast<double>(w.first.size()) * samples(w.width_x, w.width_y, w.height);
}

std::vector<std::uint8_t> GoldStream::bricks_of(std::span<const Work> works,
                                                const std::vector<std::uint8_t>& selected) const {
  const Bricks bricks(settings_.grid, settings_.granularity);
  const Index3 along = bricks.along();
  std::vector<std::uint8_t> out(selected.size(), 0);
  for (const Work& w : works)
    for (const auto& [x0, y0] : w.first)
      for (std::int64_t z = w.z; z < std::min(along[2], w.z + w.height); ++z)
        for (std::int64_t y = y0; y < std::min(along[1], y0 + w.width_y); ++y)
          for (std::int64_t x = x0; x < std::min(along[0], x0 + w.width_x); ++x) {
            const std::size_t i = at(bricks.number({x, y, z}));
            out[i] = selected[i];
          }
  return out;
}

void GoldStream::run_works(std::span<const Work> works, const std::vector<std::uint8_t>& selected,
                           const Compute& compute, const Progress& progress, const std::string& stage,
                           For purpose) {
  begin(purpose);
  run_parts(works, selected, true, compute, progress, stage);
}

// Of what `begin` was called for.
void GoldStream::run_parts(std::span<const Work> works, const std::vector<std::uint8_t>& selected,
                           bool in_strands_too, const Compute& compute, const Progress& progress,
                           const std::string& stage) {
  source_->kept.prepare(lattice_, boxes(works), progress);
  if (!settings_.base_only) source_->remainder->require(bricks_of(works, selected), progress);
  // Of the memory that is left by now.
  std::int64_t strands = in_strands_too ? state_.most_strands() : 1;
  std::vector<std::int64_t> together;
  double total = 0, done = 0;
  for (const Work& w : works) {
    total += cost(w);
    together.push_back(blocks_together(w));
    strands = std::min(strands, together.back());
  }
  std::vector<Part> parts;
  for (std::size_t w = 0; w < works.size(); ++w) add_parts(parts, works[w], at(together[w] / strands));
  Stopwatch watch(state_);
  GoldSpent& spent = spent_[at(static_cast<std::int64_t>(purpose_))];
  std::vector<std::unique_ptr<Batch>> batches(at(strands));  // their arrays serve all works
  for (std::size_t l = 0; l < batches.size(); ++l)
    batches[l].reset(new Batch(strands > 1 ? state_.strand(l) : state_, settings_));
  // Host and device take turns in each: while one strand's results are looked at, the device has another's.
  std::mutex filling, one_by_one;
  in_strands(std::ssize(parts), strands, [&](std::size_t strand, std::int64_t i) -> Take {
    const Part& part = parts[at(i)];
    std::unique_lock alone(one_by_one, std::defer_lock);
    if (state_.most_strands() == 1) alone.lock();  // another device was opened since
    fill(*batches[strand], part, selected, filling);
    return [&, take = compute(*batches[strand])] {
      take();
      const Work& w = *part.work;
      const double a_block = samples(w.width_x, w.width_y, w.height);
      for (std::size_t b = 0; b < part.blocks; ++b)
        spent.samples += a_block * kept_share(w, w.first[part.first + b]);
      done += static_cast<double>(part.blocks) * a_block;
      report(progress, stage, std::min(1.0, done / total));
    };
  });
  spent.seconds += watch.lap();
}

std::vector<std::uint8_t> bricks_near(const Coverage& coverage, const Grid& grid, std::int64_t g) {
  const Bricks bricks(grid, to_int(g));
  const Index3 n = bricks.along();
  std::vector<std::uint8_t> near(at(bricks.size()), 0);
  const double reach = std::hypot(grid.spacing[0], grid.spacing[1]) * (0.5 * static_cast<double>(g) + 1);
  for (std::int64_t y = 0; y < n[1]; ++y)
    for (std::int64_t x = 0; x < n[0]; ++x) {
      const double cx =
          grid.origin[0] + (static_cast<double>(x) + 0.5) * static_cast<double>(g) * grid.spacing[0];
      const double cy =
          grid.origin[1] + (static_cast<double>(y) + 0.5) * static_cast<double>(g) * grid.spacing[1];
      if (coverage.margin(cx, cy) < -reach) continue;
      for (std::int64_t z = 0; z < n[2]; ++z) near[at(bricks.number({x, y, z}))] = 1;
    }
  return near;
}

std::vector<std::uint8_t> GoldStream::bricks_near_coverage() const {
  return bricks_near(coverage_, settings_.grid, settings_.granularity);
}

// Coverage margins of gold's columns; columns beyond the grid are nobody's. A column's place follows from its
// number on the grid alone: it has the same margin in every block.
std::vector<float> GoldStream::margins(const std::vector<std::array<std::int64_t, 3>>& first_brick,
                                       std::int64_t nx, std::int64_t ny) const {
  const Grid& grid = settings_.grid;
  const std::int64_t side = std::int64_t{settings_.granularity} * settings_.rate;
  std::vector<float> out(first_brick.size() * at(nx * ny));
  // Nobody asks for less than what is kept, or than a cell's diagonal.
  const double floor =
      -2 * std::max({settings_.kept(), kept_margin(grid, 1), std::hypot(grid.spacing[0], grid.spacing[1])});
  const auto is_inside = [&](std::int64_t node, std::size_t a) {
    return node >= 0 && node <= grid.cells[a] * settings_.rate;
  };
  const auto place = [&](std::int64_t node, std::size_t a) {
    return grid.origin[a] + static_cast<double>(node) * (grid.spacing[a] / settings_.rate);
  };
  parallel_for(static_cast<std::int64_t>(first_brick.size()) * ny, {}, "", [&](std::int64_t row) {
    const auto& first = first_brick[at(row / ny)];
    const std::int64_t y = first[1] * side - halo_ + row % ny;
    for (std::int64_t i = 0; i < nx; ++i) {
      const std::int64_t x = first[0] * side - halo_ + i;
      out[at(row * nx + i)] =
          is_inside(x, 0) && is_inside(y, 1)
              ? static_cast<float>(coverage_.margin_above(place(x, 0), place(y, 1), floor))
              : beyond_grid;
    }
  });
  return out;
}

// Sizes of a batch in a slab.
void GoldStream::begin_batch(Batch& batch, const Work& work) const {
  const SlabShape slab = slab_of(work);
  const Grid& grid = settings_.grid;
  const std::int64_t rate = settings_.rate;
  batch.slab_ = slab;
  batch.bricks_x_ = work.width_x;
  batch.bricks_y_ = work.width_y;
  batch.bricks_z_ = work.height;
  GoldBlocks& b = batch.shape_;
  b.nx = slab.cells_x * rate + 1;
  b.ny = slab.cells_y * rate + 1;
  b.nz = slab.cells_z * rate + 1;
  b.halo = halo_;
  b.gold_stride = column_stride(b.nz + 2 * halo_);
  batch.stride_ = slab.stride;
  const double hx = grid.spacing[0] / static_cast<double>(rate),
               hy = grid.spacing[1] / static_cast<double>(rate),
               hz = grid.spacing[2] / static_cast<double>(rate);
  // Nodes of gold cells that can meet the covered region: within one gold cell's diagonal of it.
  b.lowest = static_cast<float>(-std::hypot(hx, hy) * (1 + 1e-5));
  b.z_first = b.nz;
  b.z_last = -1;
  const std::int64_t before = slab.cell_z * rate;
  for (std::int64_t k = std::max(-halo_, -before); k < b.nz + halo_ && before + k <= grid.cells[2] * rate;
       ++k)
    if (coverage_.margin_z(slab.z_first + static_cast<double>(k) * hz) >= -hz * (1 + 1e-9)) {
      b.z_first = std::min(b.z_first, k);
      b.z_last = k;
    }
}

// Blocks of a work that may go together, of all strands: what fits them takes as much again. A CPU has them
// in its caches; a card runs dry between small launches.
std::int64_t GoldStream::blocks_together(const Work& work) const {
  const std::int64_t side = std::int64_t{settings_.granularity} * settings_.rate,
                     nodes = (work.width_x * side + 1) * (work.width_y * side + 1) * slab_of(work).stride,
                     per_block =
                         4 * (static_cast<std::int64_t>(samples(work.width_x, work.width_y, work.height)) +
                              4 * nodes);
  const auto left = static_cast<std::int64_t>(state_.memory.left());
  const std::int64_t large = std::int64_t{256} << (state_.info.is_cpu ? 20 : 25),
                     wanted = std::max(std::min<std::int64_t>(64 << 20, left / 3), std::min(large, left / 8)),
                     bytes = std::min(wanted, static_cast<std::int64_t>(state_.info.max_allocation));
  return std::max<std::int64_t>(1, bytes / per_block);
}

void GoldStream::add_parts(std::vector<Part>& parts, const Work& work, std::size_t most) {
  for (std::size_t first = 0; first < work.first.size(); first += most)
    parts.push_back({&work, first, std::min(most, work.first.size() - first)});
}

void GoldStream::require_room(Batch& batch, std::int64_t blocks) const {
  const GoldBlocks& b = batch.shape_;
  const std::int64_t columns = blocks * (b.nx + 2 * halo_) * (b.ny + 2 * halo_);
  const std::uint64_t samples = count(columns * b.gold_stride + gold_room);
  if (batch.gold_.size() < samples) {
    batch.gold_ = {};  // before the next one is allocated
    batch.gold_ = opencl::DeviceArray<float>(state_, samples, "gold block");
    // What lies between columns, and beyond the last, is read and not used: let it be finite.
    batch.gold_.fill(0.0f);
  }
  if (batch.margin_.size() < count(columns)) {
    batch.margin_ = {};
    batch.margin_ = opencl::DeviceArray<float>(batch.state_, count(columns), "coverage margins");
  }
}

SlabShape GoldStream::slab_of(const Work& work) const {
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity;
  SlabShape slab{work.z * g, work.width_x * g, work.width_y * g, 0, 0, 0};
  slab.cells_z = std::min(work.height * g, grid.cells[2] - slab.cell_z);
  slab.z_first = grid.origin[2] + static_cast<double>(slab.cell_z) * grid.spacing[2];
  slab.stride = column_stride(slab.cells_z * settings_.rate + 17);
  return slab;
}

void GoldStream::take_addends(Batch& batch) const {
  const Finer own{lattice_, errors_, 1}, &of = purpose_ == For::proposing ? *finer_ : own;
  batch.take_addends(brick_addends(*source_->remainder, of.lattice, of.errors, settings_,
                                   batch.block_bricks(), batch.first_brick_),
                     of.errors, of.of_curvature);
}

void GoldStream::fill(Batch& batch, const Part& part, const std::vector<std::uint8_t>& selected,
                      std::mutex& filling) {
  const Work& work = *part.work;
  const auto first = work.first.begin() + static_cast<std::ptrdiff_t>(part.first);
  opencl::finish(batch.state_, "gold blocks");  // nothing reads its gold any more
  begin_batch(batch, work);
  require_room(batch, static_cast<std::int64_t>(part.blocks));
  const std::vector<std::array<std::int64_t, 2>> blocks(first,
                                                        first + static_cast<std::ptrdiff_t>(part.blocks));
  batch.choose(blocks, work.z, selected);
  const std::int64_t nx = batch.shape_.nx + 2 * halo_, ny = batch.shape_.ny + 2 * halo_;
  batch.margins_ = margins(batch.first_brick_, nx, ny);
  opencl::write_later<float>(batch.state_, batch.margin_, batch.margins_, "coverage margins");
  std::vector<GoldBox> boxes;
  for (const auto& block : blocks) boxes.push_back(box(work, block));
  if (!settings_.base_only) take_addends(batch);
  const std::lock_guard guard(filling);
  source_->kept.fill(lattice_, boxes, batch.gold_, 0, count(nx * ny * batch.shape_.gold_stride),
                     batch.shape_.gold_stride);
  if (&batch.state_ != &state_) batch.state_.wait_for(state_);
}

namespace {

// Bricks of a coarser grid of the same cells that hold cells of selected ones.
std::vector<std::uint8_t> meeting(const Bricks& coarse, const Bricks& fine, const LevelTriple& coarsening,
                                  const std::vector<std::uint8_t>& selected) {
  const Index3 m = fine.along();
  std::vector<std::uint8_t> out(at(coarse.size()), 0);
  for (std::int64_t i = 0; i < coarse.size(); ++i) {
    const Index3 b = coarse.position(i);
    Index3 low{}, high{};
    for (std::size_t a = 0; a < 3; ++a) {
      // Cells of the finer grid, to bricks of it.
      const std::int64_t width = coarse.granularity() << coarsening[2 - a];
      low[a] = std::max<std::int64_t>(0, b[a] * width / fine.granularity());
      high[a] = std::min<std::int64_t>(m[a] - 1, ((b[a] + 1) * width - 1) / fine.granularity());
    }
    for (std::int64_t z = low[2]; z <= high[2] && !out[at(i)]; ++z)
      for (std::int64_t y = low[1]; y <= high[1] && !out[at(i)]; ++y)
        for (std::int64_t x = low[0]; x <= high[0]; ++x)
          if (selected[at(fine.number({x, y, z}))]) out[at(i)] = 1;
  }
  return out;
}

}  // namespace

GoldSettings fitting_settings(GoldSettings settings) {
  // Second differences at 2x are (rate / 2)^2 those of the gold that will be tested.
  settings.curvature *= 4.0f / static_cast<float>(settings.rate * settings.rate);
  settings.rate = 2;
  settings.grid = coarsened(settings.grid, settings.coarsening);
  settings.granularity = fitting_granularity(settings.granularity, settings.grid);
  settings.coarsening = {};
  settings.midrange = settings.base_only = true;
  return settings;
}

std::vector<std::uint8_t> bricks_to_fit(const GoldStream& fitting, const GoldSettings& settings,
                                        const std::vector<std::uint8_t>& selected) {
  std::vector<std::uint8_t> wanted = fitting.bricks_near_coverage();
  const auto read = meeting(Bricks(fitting.settings().grid, fitting.settings().granularity),
                            Bricks(settings.grid, settings.granularity), settings.coarsening, selected);
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = wanted[i] && read[i];
  return wanted;
}

void fit_base_samples(opencl::State& state, const FilteredScan& scan, const FieldSups& sups,
                      const GoldSettings& settings, const std::vector<std::uint8_t>& selected,
                      std::vector<float>& base, const Progress& progress,
                      std::shared_ptr<GoldSource> source) {
  GoldStream stream(state, scan, sups, fitting_settings(settings), std::move(source));
  stream.run(
      bricks_to_fit(stream, settings, selected),
      [&](GoldStream::Batch& batch) {
        batch.fit_base([&](std::size_t i, float sample) { base[i] = sample; });
      },
      progress, "fit", GoldStream::For::samples);
}

}  // namespace vdvr
