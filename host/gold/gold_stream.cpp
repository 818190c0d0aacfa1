// Streams gold. Calls back_project.cpp and node_slack.cpp.
#include "host/gold/gold_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <utility>

#include "host/gold/gold_batch.hpp"
#include "host/fbp/reconstruct.hpp"
#include "host/gold/gold_blocks.hpp"
#include "host/system/casts.hpp"
#include "host/system/parallel.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/error.hpp"

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

GoldStream::GoldStream(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler,
                       const FieldSups& sups, const GoldSettings& settings, std::shared_ptr<CellBounds> cells)
    : state_(state),
      scan_(scan),
      upsampler_(upsampler),
      settings_(settings),
      coverage_(scan.geometry),
      columns_(
          columns_for(scan.geometry, coarsened(settings.grid, settings.coarsening), settings.upsampling)),
      cells_(std::move(cells)) {
  const std::int64_t g = settings.granularity;
  // Second differences look one node beyond a block, fits further.
  if (settings.midrange)
    fit_halo_ = settings.base_only ? base_fit_steps * settings.rate : level_fit_steps * settings.rate / 2;
  halo_ = fit_halo_;
  // About 16 x 16 x 32 base cells at once: large enough that halos are cheap, small enough for caches and
  // --max-memory.
  block_bricks_ = std::max<std::int64_t>(1, 128 / (g * settings.rate));
  slab_bricks_ = std::max<std::int64_t>(1, 256 / (g * settings.rate));
  // Tables of bounds are as large for coarse gold as for fine.
  if (!settings.base_only) slab_bricks_ = std::clamp<std::int64_t>(32 / g, 1, slab_bricks_);
  while (slab_bricks_ > 1 &&
         slab_bytes(slab_bricks_ * g) > std::min(state.memory.left() / 2, state.info.max_allocation))
    slab_bricks_ /= 2;
  const auto block_bytes = [&] {
    const std::int64_t width = block_bricks_ * g * settings.rate + 1 + 2 * halo_;
    return count(20 * width * width * (slab_bricks_ * g * settings.rate + 62 + 2 * halo_));
  };
  while (block_bricks_ > 1 && block_bytes() > state.memory.left() / 5) block_bricks_ /= 2;
  if (slab_bytes(slab_bricks_ * g) > std::min(state.memory.left() * 3 / 4, state.info.max_allocation)) {
    throw ResourceError(fmt::format(
        "gold at rate {} from {} views of {} upsampled columns needs {:.1f} MiB for its thinnest slab; raise "
        "`max_memory`, "
        "or choose a smaller `granularity`, `upsampling` or `gold`",
        settings.rate, scan.geometry.views(), columns_.count,
        static_cast<double>(slab_bytes(slab_bricks_ * g)) / (1 << 20)));
  }
  const std::int64_t side = block_bricks_ * g * settings.rate + 1 + 2 * halo_;
  const ColumnBlocks largest{
      side, side, settings.grid.spacing[0] / settings.rate, settings.grid.spacing[1] / settings.rate, {}, {}};
  arithmetic_ = arithmetic_bound(upsampler, scan, sups, columns_, largest, settings.interpolation);
  if (settings.base_only) return;
  if (!cells_) cells_ = std::make_shared<CellBounds>(state, scan, upsampler, sups, settings);
  node_slack_.emplace(state, *cells_, scan, sups, settings_, arithmetic_,
                      arithmetic_ - filter_error_bound(upsampler, scan, columns_));
}

GoldStream::~GoldStream() = default;

std::uint64_t GoldStream::slab_bytes(std::int64_t cells_z) const {
  return upsampler_.slab_bytes(columns_, cells_z * settings_.rate + 1 + 2 * halo_);
}

std::int64_t GoldStream::padded_rows(std::int64_t height) const {
  return static_cast<std::int64_t>(
      opencl::round_up(count(height * settings_.granularity * settings_.rate + 1 + 2 * halo_), 16));
}

double GoldStream::samples(std::int64_t width_x, std::int64_t width_y, std::int64_t height) const {
  const std::int64_t side = std::int64_t{settings_.granularity} * settings_.rate,
                     nz = std::min(height * settings_.granularity, settings_.grid.cells[2]) * settings_.rate;
  const std::int64_t more = 1 + 2 * halo_;
  return static_cast<double>((width_x * side + more) * (width_y * side + more)) *
         static_cast<double>(opencl::round_up(count(nz + more), 16));
}

// Work by slab, equal blocks together.
std::vector<GoldStream::Work> GoldStream::partition(const std::vector<std::uint8_t>& selected) const {
  const std::int64_t g = settings_.granularity;
  const Index3 bricks = Bricks(settings_.grid, settings_.granularity).along();
  std::map<std::int64_t, std::vector<Work>> by_slab;
  for (const BrickBox& box : cover_bricks(bricks, selected, block_bricks(),
                                          [&](const Index3& n) { return samples(n[0], n[1], n[2]); })) {
    std::vector<Work>& works = by_slab[box.first[2] / slab_bricks_];
    if (works.empty() || works.back().z != box.first[2] || works.back().size() != box.size)
      works.push_back({box.first[2], box.size[2], box.size[0], box.size[1], {}, {}});
    works.back().first.push_back({box.first[0], box.first[1]});
  }
  std::vector<Work> all;
  for (auto& [index, works] : by_slab) {
    const Slab whole{index * slab_bricks_, std::min(slab_bricks_, bricks[2] - index * slab_bricks_)};
    // Rows shared by all where that is fewer, and where a layer begins with a chunk of 16.
    std::int64_t apart = 0;
    for (const Work& w : works) apart += padded_rows(w.height);
    const bool share = apart > padded_rows(whole.height) && g * settings_.rate % 16 == 0;
    for (Work& w : works) {
      w.slab = share ? whole : Slab{w.z, w.height};
      all.push_back(std::move(w));
    }
  }
  return all;
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
  halo_ = purpose == For::samples ? fit_halo_ : 1;
}

GoldWork GoldStream::work(const std::vector<std::uint8_t>& selected, For purpose) {
  begin(purpose);
  GoldWork out;
  Slab slab;
  for (const Work& w : partition(selected)) {
    if (!(w.slab == std::exchange(slab, w.slab))) out.rows += static_cast<double>(padded_rows(w.slab.height));
    for (const auto& first : w.first)
      out.samples += samples(w.width_x, w.width_y, w.height) * kept_share(w, first);
  }
  return out;
}

void GoldStream::run(const std::vector<std::uint8_t>& selected, const OnBatch& on_batch,
                     const Progress& progress, const std::string& stage, For purpose) {
  run_unknown(
      selected, on_batch, [](const Work&, std::size_t) { return 0; }, progress, stage, purpose);
}

void GoldStream::run_unknown(const std::vector<std::uint8_t>& selected, const OnBatch& on_batch,
                             const Known& known, const Progress& progress, const std::string& stage,
                             For purpose) {
  begin(purpose);
  const std::vector<Work> all = partition(selected);
  upsampled_ = {};  // an earlier run may have ended early
  const auto cost = [&](const Work& w) { return samples(w.width_x, w.width_y, w.height); };
  double total = 0, done = 0;
  for (const Work& w : all) total += static_cast<double>(w.first.size()) * cost(w);
  for (const Work& w : all) {
    const auto tick = [&](double blocks) {
      done += blocks * cost(w);
      report(progress, stage, std::min(1.0, done / total));
    };
    std::size_t from = 0;
    while (from < w.first.size()) {
      const std::size_t n = known(w, from);
      if (n == 0) break;
      from += n;
      tick(static_cast<double>(n));
    }
    if (from < w.first.size()) run_blocks(w, from, selected, on_batch, tick);
  }
  upsampled_ = {};
  projections_ = {};
  if (cells_) cells_->end();
}

std::vector<std::uint8_t> GoldStream::bricks_near_coverage() const {
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity;
  const Bricks bricks(grid, settings_.granularity);
  const Index3 n = bricks.along();
  std::vector<std::uint8_t> near(at(bricks.size()), 0);
  const double reach = std::hypot(grid.spacing[0], grid.spacing[1]) * (0.5 * static_cast<double>(g) + 1);
  for (std::int64_t y = 0; y < n[1]; ++y)
    for (std::int64_t x = 0; x < n[0]; ++x) {
      const double cx =
          grid.origin[0] + (static_cast<double>(x) + 0.5) * static_cast<double>(g) * grid.spacing[0];
      const double cy =
          grid.origin[1] + (static_cast<double>(y) + 0.5) * static_cast<double>(g) * grid.spacing[1];
      if (coverage_.margin(cx, cy) < -reach) continue;
      for (std::int64_t z = 0; z < n[2]; ++z) near[at(bricks.number({x, y, z}))] = 1;
    }
  return near;
}

// Coverage margins of gold's columns; columns beyond the grid are nobody's.
std::vector<float> GoldStream::margins(const ColumnBlocks& columns) const {
  const Grid& grid = settings_.grid;
  std::vector<float> out(columns.first.size() * at(columns.nx * columns.ny));
  std::array<double, 2> low{}, high{};
  for (std::size_t a = 0; a < 2; ++a) {
    const double rounding = 1e-6 * grid.spacing[a];
    low[a] = grid.origin[a] - rounding;
    high[a] = grid.origin[a] + static_cast<double>(grid.cells[a]) * grid.spacing[a] + rounding;
  }
  parallel_for(static_cast<std::int64_t>(columns.first.size()) * columns.ny, {}, "", [&](std::int64_t row) {
    const auto& first = columns.first[at(row / columns.ny)];
    const double y = first[1] + static_cast<double>(row % columns.ny) * columns.step_y;
    for (std::int64_t i = 0; i < columns.nx; ++i) {
      const double x = first[0] + static_cast<double>(i) * columns.step_x;
      const bool inside = x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1];
      out[at(row * columns.nx + i)] = inside ? static_cast<float>(coverage_.margin(x, y)) : beyond_grid;
    }
  });
  return out;
}

// Columns worth computing: those that may be kept, and those around them, for second differences.
std::vector<std::array<std::int32_t, 2>> GoldStream::wanted(const std::vector<float>& margins,
                                                            std::int64_t nx, std::int64_t ny) const {
  const float kept = static_cast<float>(-settings_.kept());
  const auto is_kept = [&](float v) { return v >= kept; };
  const std::int64_t rows = static_cast<std::int64_t>(margins.size()) / nx;
  std::vector<std::array<std::int32_t, 2>> out(at(rows), {to_int(nx), -1});
  for (std::int64_t row = 0; row < rows; ++row) {
    const float* m = margins.data() + row * nx;
    const float* low = std::find_if(m, m + nx, is_kept);
    if (low == m + nx) continue;
    const auto high = std::find_if(std::reverse_iterator(m + nx), std::reverse_iterator(m), is_kept);
    const std::int64_t block = row / ny * ny;
    for (std::int64_t r = std::max(block, row - 1); r <= std::min(block + ny - 1, row + 1); ++r) {
      auto& w = out[at(r)];
      w[0] = std::min(w[0], to_int(std::max<std::int64_t>(0, low - m - 1)));
      w[1] = std::max(w[1], to_int(std::min<std::int64_t>(nx - 1, high.base() - m)));
    }
  }
  return out;
}

// Sizes of a batch in a slab, and room for `together` blocks of it.
std::int64_t GoldStream::begin_batch(Batch& batch, const Work& work, const SlabShape& slab) {
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

  const std::int64_t gold = (b.nx + 2 * halo_) * (b.ny + 2 * halo_), nodes = b.nx * b.ny * slab.stride;
  const std::int64_t per_block = 4 * (gold * b.gold_stride + 4 * nodes);
  const std::int64_t together = std::clamp<std::int64_t>(
      std::min<std::int64_t>(64 << 20, static_cast<std::int64_t>(state_.memory.left() / 3)) / per_block, 1,
      static_cast<std::int64_t>(work.first.size()));
  batch.gold_ =
      opencl::DeviceArray<float>(state_, count(together * gold * b.gold_stride + gold_room), "gold block");
  batch.margin_ = opencl::DeviceArray<float>(state_, count(together * gold), "coverage margins");
  if (node_slack_) {
    batch.above_ = opencl::DeviceArray<float>(state_, count(together * nodes), "node slack above");
    batch.below_ = opencl::DeviceArray<float>(state_, count(together * nodes), "node slack below");
    batch.p_ = opencl::DeviceArray<float>(
        state_, count(together * slab.cells_x * slab.cells_y * slab.cells_z), "projection bounds of cells");
    node_slack_->begin(slab, together);
  }
  // Columns that nobody wants keep what the buffer held: let that be finite.
  batch.gold_.fill(0.0f);
  return together;
}

SlabShape GoldStream::slab_of(const Work& work) const {
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity;
  SlabShape slab{work.z * g, work.width_x * g, work.width_y * g, 0, 0, 0, {}};
  slab.cells_z = std::min(work.height * g, grid.cells[2] - slab.cell_z);
  slab.z_first = grid.origin[2] + static_cast<double>(slab.cell_z) * grid.spacing[2];
  slab.stride = column_stride(slab.cells_z * settings_.rate + 17);
  slab.slab = {work.slab.z * g, std::min(work.slab.height * g, grid.cells[2] - work.slab.z * g)};
  return slab;
}

void GoldStream::upsample(const Slab& slab) {
  if (slab == upsampled_) return;
  projections_ = {};  // before the next one is allocated
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  const double hz = grid.spacing[2] / static_cast<double>(rate);
  const double first = grid.origin[2] + static_cast<double>(slab.z * g) * grid.spacing[2];
  const std::int64_t cells = std::min(slab.height * g, grid.cells[2] - slab.z * g);
  projections_ = upsampler_(columns_, detector_rows(scan_.geometry, first - static_cast<double>(halo_) * hz,
                                                    hz, cells * rate + 1 + 2 * halo_));
  upsampled_ = slab;
  spent_[at(static_cast<std::int64_t>(purpose_))].work.rows += static_cast<double>(projections_.rows_padded);
}

void GoldStream::run_blocks(const Work& work, std::size_t from, const std::vector<std::uint8_t>& selected,
                            const OnBatch& on_batch, const std::function<void(double)>& tick) {
  Stopwatch watch(state_);
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity;
  const SlabShape slab = slab_of(work);
  const double hx = grid.spacing[0] / static_cast<double>(settings_.rate),
               hy = grid.spacing[1] / static_cast<double>(settings_.rate);
  upsample(work.slab);
  spent_[at(static_cast<std::int64_t>(purpose_))].slab_seconds += watch.lap();

  Batch batch(state_, settings_);
  const std::int64_t together = begin_batch(batch, work, slab);
  ColumnBlocks columns{batch.shape_.nx + 2 * halo_, batch.shape_.ny + 2 * halo_, hx, hy, {}, {}};
  columns.first_row = (work.z - work.slab.z) * g * settings_.rate;
  columns.rows = batch.shape_.nz + 2 * halo_;
  for (std::size_t begin = from; begin < work.first.size(); begin += at(together)) {
    const std::size_t n = std::min(at(together), work.first.size() - begin);
    batch.choose({work.first.begin() + static_cast<std::ptrdiff_t>(begin),
                  work.first.begin() + static_cast<std::ptrdiff_t>(begin + n)},
                 work.z, selected);
    columns.first.clear();
    for (const auto& f : batch.first_brick_)
      columns.first.push_back(
          {grid.origin[0] + static_cast<double>(f[0] * g) * grid.spacing[0] - static_cast<double>(halo_) * hx,
           grid.origin[1] + static_cast<double>(f[1] * g) * grid.spacing[1] -
               static_cast<double>(halo_) * hy});
    const std::vector<float> margins = this->margins(columns);
    columns.wanted = wanted(margins, columns.nx, columns.ny);
    batch.margin_.write(margins);
    batch.margins_ = margins;
    back_project(state_, scan_.geometry, projections_, columns, settings_.interpolation, batch.gold_);
    if (node_slack_)
      (*node_slack_)(batch.shape_, batch.first_brick_, batch.gold_, batch.margin_, batch.above_, batch.below_,
                     batch.p_);
    on_batch(batch);
    for (std::size_t b = 0; b < n; ++b)
      spent_[at(static_cast<std::int64_t>(purpose_))].work.samples +=
          samples(work.width_x, work.width_y, work.height) * kept_share(work, work.first[begin + b]);
    tick(static_cast<double>(n));
  }
  spent_[at(static_cast<std::int64_t>(purpose_))].block_seconds += watch.lap();
  if (node_slack_) {
    node_slack_->end();
    const double tables = cells_->take_table_seconds();
    spent_[at(static_cast<std::int64_t>(purpose_))].table_seconds += tables;
    spent_[at(static_cast<std::int64_t>(purpose_))].block_seconds -= tables;
  }
}

void fit_base_samples(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler,
                      const FieldSups& sups, GoldSettings settings, std::vector<float>& base,
                      const Progress& progress) {
  // Second differences at 2x are (rate / 2)^2 those of the gold that will be tested.
  settings.curvature *= 4.0f / static_cast<float>(settings.rate * settings.rate);
  settings.rate = 2;
  settings.grid = coarsened(settings.grid, settings.coarsening);
  settings.granularity = fitting_granularity(settings.granularity, settings.grid);
  settings.coarsening = {};
  settings.midrange = settings.base_only = true;
  GoldStream stream(state, scan, upsampler, sups, settings);
  stream.run(
      stream.bricks_near_coverage(), [&](GoldStream::Batch& batch) { batch.fit_base(base); }, progress, "fit",
      GoldStream::For::samples);
}

}  // namespace vdvr
