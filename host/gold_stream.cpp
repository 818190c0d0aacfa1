// Streams gold. Launches kernels/gold_bounds.cl, classify.cl and verify.cl.
#include "host/gold_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <utility>

#include "host/opencl/kernel.hpp"
#include "host/parallel.hpp"
#include "host/reconstruct_field.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

cl_int to_int(std::int64_t n) { return static_cast<cl_int>(n); }
std::uint64_t count(std::int64_t n) { return static_cast<std::uint64_t>(n); }
std::size_t at(std::int64_t n) { return static_cast<std::size_t>(n); }

// Room for 16-lane reads that begin at the last node of the last column.
constexpr std::int64_t gold_room = 64;

// Mirrors TileRequest of kernels/classify.cl.
struct TileRequest {
  cl_int block, node_x, node_y, node_z;
  cl_int spacing_x, spacing_y, spacing_z;
  cl_int side_x, side_y, side_z;
  cl_int last_x, last_y, last_z;
  cl_int pad;
  cl_ulong offset;
};
static_assert(sizeof(TileRequest) == 64 && offsetof(TileRequest, offset) == 56);

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
                       const FieldSups& sups, const GoldSettings& settings)
    : state_(state),
      scan_(scan),
      upsampler_(upsampler),
      sups_(sups),
      settings_(settings),
      coverage_(scan.geometry),
      columns_(columns_for(scan.geometry, settings.grid, settings.upsampling)) {
  const std::int64_t g = settings.granularity;
  // About 16 x 16 x 32 base cells at once: large enough that halos are cheap, small enough for caches and
  // --max-memory.
  block_bricks_ = std::max<std::int64_t>(1, 128 / (g * settings.rate));
  slab_bricks_ = std::max<std::int64_t>(1, 256 / (g * settings.rate));
  while (slab_bricks_ > 1 &&
         slab_bytes(slab_bricks_ * g) > std::min(state.memory.left() / 2, state.info.max_allocation))
    slab_bricks_ /= 2;
  const auto block_bytes = [&] {
    return count(12 * (block_bricks_ * g * settings.rate + 3) * (block_bricks_ * g * settings.rate + 3) *
                 (slab_bricks_ * g * settings.rate + 64));
  };
  while (block_bricks_ > 1 && block_bytes() > state.memory.left() / 5) block_bricks_ /= 2;
  if (slab_bytes(slab_bricks_ * g) > std::min(state.memory.left() * 3 / 4, state.info.max_allocation)) {
    throw ResourceError(fmt::format(
        "gold at rate {} from {} views of {} upsampled columns needs {:.1f} MiB for its thinnest slab; raise "
        "--max-memory, "
        "or choose a smaller --granularity, --upsampling or --gold",
        settings.rate, scan.geometry.views(), columns_.count,
        static_cast<double>(slab_bytes(slab_bricks_ * g)) / (1 << 20)));
  }
  const std::int64_t side = block_bricks_ * g * settings.rate + 3;
  const ColumnBlocks largest{
      side, side, settings.grid.spacing[0] / settings.rate, settings.grid.spacing[1] / settings.rate, {}, {}};
  cell_p_.assign(at(settings.grid.cells[0] * settings.grid.cells[1] * settings.grid.cells[2]), -1.0f);
  cell_addend_ = cell_p_;
  arithmetic_ = arithmetic_bound(upsampler, scan, sups, columns_, largest, settings.u_filter);
  rounding_ = arithmetic_ - filter_error_bound(upsampler, scan, columns_);
  remainder_ = gold_remainder(scan, sups, settings.grid, settings.rate);
}

GoldStream::~GoldStream() = default;

std::uint64_t GoldStream::slab_bytes(std::int64_t cells_z) const {
  return upsampler_.slab_bytes(columns_, cells_z * settings_.rate + 3);
}

double GoldStream::samples(std::int64_t width_x, std::int64_t width_y, std::int64_t height) const {
  const std::int64_t side = std::int64_t{settings_.granularity} * settings_.rate,
                     nz = std::min(height * settings_.granularity, settings_.grid.cells[2]) * settings_.rate;
  return static_cast<double>((width_x * side + 3) * (width_y * side + 3)) *
         static_cast<double>(opencl::round_up(count(nz + 3), 16));
}

// Work by slab: as large blocks, or brick by brick where few of a block's bricks are wanted: whichever
// computes fewer samples, halos included. Blocks at the grid's end are cut to it.
std::vector<GoldStream::Work> GoldStream::partition(const std::vector<std::uint8_t>& selected) const {
  const std::int64_t g = settings_.granularity;
  Index3 bricks{};
  for (std::size_t a = 0; a < 3; ++a) bricks[a] = (settings_.grid.cells[a] + g - 1) / g;
  std::vector<Work> all;
  for (std::int64_t z0 = 0; z0 < bricks[2]; z0 += slab_bricks_) {
    const std::int64_t height = std::min(slab_bricks_, bricks[2] - z0);
    std::map<std::array<std::int64_t, 2>, Work> large;
    std::vector<Work> small;
    for (std::int64_t dz = 0; dz < height; ++dz) small.push_back({z0 + dz, 1, 1, 1, {}});
    for (std::int64_t y0 = 0; y0 < bricks[1]; y0 += block_bricks_)
      for (std::int64_t x0 = 0; x0 < bricks[0]; x0 += block_bricks_) {
        const std::int64_t wx = std::min(block_bricks_, bricks[0] - x0),
                           wy = std::min(block_bricks_, bricks[1] - y0);
        std::vector<std::array<std::int64_t, 3>> wanted;
        for (std::int64_t z = z0; z < z0 + height; ++z)
          for (std::int64_t y = y0; y < y0 + wy; ++y)
            for (std::int64_t x = x0; x < x0 + wx; ++x)
              if (selected[at((z * bricks[1] + y) * bricks[0] + x)]) wanted.push_back({x, y, z});
        if (wanted.empty()) continue;
        if (static_cast<double>(wanted.size()) * samples(1, 1, 1) >= samples(wx, wy, height) ||
            block_bricks_ * slab_bricks_ == 1)
          large.try_emplace({wx, wy}, Work{z0, height, wx, wy, {}}).first->second.first.push_back({x0, y0});
        else
          for (const auto& m : wanted) small[at(m[2] - z0)].first.push_back({m[0], m[1]});
      }
    for (auto& [size, w] : large) all.push_back(std::move(w));
    for (auto& w : small)
      if (!w.first.empty()) all.push_back(std::move(w));
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
      kept += coverage_.margin(grid.origin[0] + bx * settings_.granularity * grid.spacing[0],
                               grid.origin[1] + by * settings_.granularity * grid.spacing[1]) >=
                      -kept_margin(grid, 1)
                  ? 1
                  : 0;
    }
  return static_cast<double>(kept) / (raster * raster);
}

GoldWork GoldStream::work(const std::vector<std::uint8_t>& selected) const {
  GoldWork out;
  for (const Work& w : partition(selected)) {
    out.rows += static_cast<double>(
        opencl::round_up(count(w.height * settings_.granularity * settings_.rate + 3), 16));
    for (const auto& first : w.first)
      out.samples += samples(w.width_x, w.width_y, w.height) * kept_share(w, first);
  }
  return out;
}

void GoldStream::run(const std::vector<std::uint8_t>& selected, const OnBatch& on_batch,
                     const Progress& progress, const std::string& stage) {
  const std::vector<Work> all = partition(selected);
  const auto cost = [&](const Work& w) { return samples(w.width_x, w.width_y, w.height); };
  double total = 0, done = 0;
  for (const Work& w : all) total += static_cast<double>(w.first.size()) * cost(w);
  for (const Work& w : all) {
    run_slab(w, selected, on_batch, [&](double blocks) {
      done += blocks * cost(w);
      report(progress, stage, std::min(1.0, done / total));
    });
  }
}

std::vector<std::uint8_t> GoldStream::bricks_near_coverage() const {
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity;
  Index3 n{};
  for (std::size_t a = 0; a < 3; ++a) n[a] = (grid.cells[a] + g - 1) / g;
  std::vector<std::uint8_t> near(at(n[0] * n[1] * n[2]), 0);
  const double reach = std::hypot(grid.spacing[0], grid.spacing[1]) * (0.5 * static_cast<double>(g) + 1);
  for (std::int64_t y = 0; y < n[1]; ++y)
    for (std::int64_t x = 0; x < n[0]; ++x) {
      const double cx =
          grid.origin[0] + (static_cast<double>(x) + 0.5) * static_cast<double>(g) * grid.spacing[0];
      const double cy =
          grid.origin[1] + (static_cast<double>(y) + 0.5) * static_cast<double>(g) * grid.spacing[1];
      if (coverage_.margin(cx, cy) < -reach) continue;
      for (std::int64_t z = 0; z < n[2]; ++z) near[at((z * n[1] + y) * n[0] + x)] = 1;
    }
  return near;
}

void GoldStream::run_slab(const Work& work, const std::vector<std::uint8_t>& selected,
                          const OnBatch& on_batch, const std::function<void(double)>& tick) {
  const auto& [brick_z, bricks_z, bricks_x, bricks_y, blocks] = work;
  Stopwatch watch(state_);
  const Grid& grid = settings_.grid;
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  const std::int64_t cell_z = brick_z * g, cells_z = std::min(bricks_z * g, grid.cells[2] - cell_z);
  const std::int64_t cells_x = bricks_x * g, cells_y = bricks_y * g;
  const double hx = grid.spacing[0] / static_cast<double>(rate),
               hy = grid.spacing[1] / static_cast<double>(rate);
  const double hz = grid.spacing[2] / static_cast<double>(rate),
               z_first = grid.origin[2] + static_cast<double>(cell_z) * grid.spacing[2];
  const std::int64_t nx = cells_x * rate + 1, ny = cells_y * rate + 1, nz = cells_z * rate + 1;
  const auto rows = detector_rows(scan_.geometry, z_first - hz, hz, nz + 2);
  const UpsampledSlab slab = upsampler_(columns_, rows);
  spent_.work.rows += static_cast<double>(slab.rows_padded);
  spent_.slab_seconds += watch.lap();
  // P of a base cell, and what a gold cell's slack adds for it, are computed once: later passes read them.
  std::optional<BoundTable> projection, remainder;
  const auto known = [&](const std::array<std::int64_t, 2>& first) {
    for (std::int64_t z = 0; z < cells_z; ++z)
      for (std::int64_t y = first[1] * g; y < std::min(grid.cells[1], first[1] * g + cells_y); ++y)
        for (std::int64_t x = first[0] * g; x < std::min(grid.cells[0], first[0] * g + cells_x); ++x)
          if (cell_p_[at(((cell_z + z) * grid.cells[1] + y) * grid.cells[0] + x)] < 0) return false;
    return true;
  };

  const std::int64_t gold_stride = column_stride(nz + 2), stride = column_stride(nz + 17);
  const std::int64_t per_block = 4 * ((nx + 2) * (ny + 2) * gold_stride + 2 * nx * ny * stride);
  const std::int64_t together = std::clamp<std::int64_t>(
      std::min<std::int64_t>(64 << 20, static_cast<std::int64_t>(state_.memory.left() / 3)) / per_block, 1,
      static_cast<std::int64_t>(blocks.size()));
  Batch batch(state_, settings_);
  batch.bricks_x_ = bricks_x;
  batch.bricks_y_ = bricks_y;
  batch.bricks_z_ = bricks_z;
  batch.nx_ = nx;
  batch.ny_ = ny;
  batch.nz_ = nz;
  batch.gold_stride_ = gold_stride;
  batch.stride_ = stride;
  // Nodes of gold cells that can meet the covered region: within one gold cell's diagonal of it.
  batch.lowest_ = static_cast<float>(-std::hypot(hx, hy) * (1 + 1e-5));
  batch.gold_ = opencl::DeviceArray<float>(
      state_, count(together * (nx + 2) * (ny + 2) * gold_stride + gold_room), "gold block");
  batch.slack_ = opencl::DeviceArray<float>(state_, count(together * nx * ny * stride), "node slack");
  batch.margin_ = opencl::DeviceArray<float>(state_, count(together * nx * ny), "coverage margins");
  batch.p_ = opencl::DeviceArray<float>(state_, count(together * cells_x * cells_y * cells_z),
                                        "projection bounds of cells");
  opencl::DeviceArray<float> addend(state_, batch.p_.size(), "slack of cells"),
      cell_remainder(state_, batch.p_.size(), "remainders of cells");
  opencl::DeviceArray<float> cells(state_, count(together * nx * ny * stride), "cell slack");
  opencl::DeviceArray<float> p_rows(state_, count(together * cells_x * cells_y * stride),
                                    "slack by base cell of gold cells");
  opencl::DeviceArray<cl_int2> last(state_, count(together), "block ends");
  // Columns that nobody wants keep what the buffer held: let that be finite.
  batch.gold_.fill(0.0f);

  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int> expand(
      state_, "gold_bounds", "expand_bound");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_float, cl_int, cl_float, cl_float>
      cell_slack(state_, "gold_bounds", "cell_slack");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int,
                 cl_float, cl_int, cl_int>
      node_slack(state_, "gold_bounds", "node_slack");

  std::int64_t z_low = nz, z_high = -1;
  for (std::int64_t k = 0; k < nz; ++k)
    if (coverage_.margin_z(z_first + static_cast<double>(k) * hz) >= -hz * (1 + 1e-9)) {
      z_low = std::min(z_low, k);
      z_high = k;
    }
  const float kept = static_cast<float>(-kept_margin(grid, 1));
  const Index3 all{(grid.cells[0] + g - 1) / g, (grid.cells[1] + g - 1) / g, 0};

  for (std::size_t begin = 0; begin < blocks.size(); begin += at(together)) {
    const std::size_t n = std::min(at(together), blocks.size() - begin);
    const cl_int count_n = to_int(static_cast<std::int64_t>(n));
    ColumnBlocks gold_columns{nx + 2, ny + 2, hx, hy, {}, {}}, node_columns{nx, ny, hx, hy, {}, {}};
    std::vector<cl_int2> ends(n);
    batch.first_brick_.clear();
    batch.bricks_.clear();
    batch.place_.clear();
    bool all_known = true;
    for (std::size_t b = 0; b < n; ++b) {
      const auto [bx, by] = blocks[begin + b];
      const double x = grid.origin[0] + static_cast<double>(bx * g) * grid.spacing[0],
                   y = grid.origin[1] + static_cast<double>(by * g) * grid.spacing[1];
      node_columns.first.push_back({x, y});
      gold_columns.first.push_back({x - hx, y - hy});
      ends[b] = {{to_int(std::min(cells_x, grid.cells[0] - bx * g) * rate),
                  to_int(std::min(cells_y, grid.cells[1] - by * g) * rate)}};
      batch.first_brick_.push_back({bx, by, brick_z});
      all_known = all_known && known({bx, by});
      for (std::int64_t dz = 0; dz < bricks_z; ++dz)
        for (std::int64_t dy = 0; dy < bricks_y; ++dy)
          for (std::int64_t dx = 0; dx < bricks_x; ++dx) {
            const std::int64_t brick = ((brick_z + dz) * all[1] + by + dy) * all[0] + bx + dx;
            if (!selected[at(brick)]) continue;
            batch.bricks_.push_back(brick);
            batch.place_[brick] = {static_cast<std::int64_t>(b), dx, dy, dz};
          }
    }
    last.write(ends);

    // Margins of the nodes, and from them the columns worth computing: those that may be kept, with their
    // halo.
    std::vector<float> margins(n * at(nx * ny));
    gold_columns.wanted.assign(n * at(ny + 2), {to_int(nx + 2), -1});
    parallel_for(static_cast<std::int64_t>(n) * ny, {}, "", [&](std::int64_t row) {
      const std::size_t b = at(row / ny);
      const std::int64_t j = row % ny;
      for (std::int64_t i = 0; i < nx; ++i)
        margins[at(row * nx + i)] =
            static_cast<float>(coverage_.margin(node_columns.first[b][0] + static_cast<double>(i) * hx,
                                                node_columns.first[b][1] + static_cast<double>(j) * hy));
    });
    for (std::size_t b = 0; b < n; ++b)
      for (std::int64_t j = 0; j < ny; ++j) {
        const float* m = margins.data() + (b * at(ny) + at(j)) * at(nx);
        const auto is_kept = [&](float v) { return v >= kept; };
        const float* low = std::find_if(m, m + nx, is_kept);
        if (low == m + nx) continue;
        const auto high = std::find_if(std::reverse_iterator(m + nx), std::reverse_iterator(m), is_kept);
        for (std::int64_t r = j; r <= j + 2;
             ++r) {  // rows j - 1 .. j + 1 of the nodes are j .. j + 2 of gold
          auto& w = gold_columns.wanted[b * at(ny + 2) + at(r)];
          w[0] = std::min(w[0], to_int(low - m));
          w[1] = std::max(w[1], to_int(high.base() - 1 - m + 2));
        }
      }
    batch.margin_.write(margins);

    back_project(state_, scan_.geometry, slab, gold_columns, settings_.u_filter, batch.gold_);
    std::vector<float> p(n * at(cells_x * cells_y * cells_z), 0.0f), r(p.size(), 0.0f);
    const auto each_cell =
        [&](auto&& visit) {  // (index in p, index in cell_p_) of every cell inside the grid
          for (std::size_t b = 0; b < n; ++b) {
            const auto [bx, by] = blocks[begin + b];
            for (std::int64_t z = 0; z < cells_z; ++z)
              for (std::int64_t y = 0; y < std::min(cells_y, grid.cells[1] - by * g); ++y)
                for (std::int64_t x = 0; x < std::min(cells_x, grid.cells[0] - bx * g); ++x)
                  visit(((b * at(cells_z) + at(z)) * at(cells_y) + at(y)) * at(cells_x) + at(x),
                        at(((cell_z + z) * grid.cells[1] + by * g + y) * grid.cells[0] + bx * g + x));
          }
        };
    if (!all_known) {
      if (!projection) {
        spent_.block_seconds += watch.lap();
        projection = projection_table(state_, upsampler_, scan_,
                                      columns_for(scan_.geometry, grid, std::min(8, settings_.upsampling)),
                                      settings_.upsampling, settings_.u_filter,
                                      base_cells(scan_.geometry, grid, settings_.rate, z_first, cells_z));
        remainder = remainder_table(state_, upsampler_, scan_, sups_, grid, settings_.rate, z_first, cells_z);
        spent_.table_seconds += watch.lap();
      }
      const double centre = 0.5 * static_cast<double>(rate);
      project_bound(state_, scan_, *projection, node_columns, cells_x, cells_y, settings_.rate, centre,
                    batch.p_);
      project_bound(state_, scan_, *remainder, node_columns, cells_x, cells_y, settings_.rate, centre,
                    cell_remainder);
      batch.p_.read(std::span<float>(p));
      cell_remainder.read(std::span<float>(r));
      each_cell([&](std::size_t i, std::size_t cell) {
        cell_p_[cell] = p[i];
        cell_addend_[cell] = (2.5f * p[i] + std::min(r[i], static_cast<float>(remainder_))) * (1 + 0x1p-22f);
      });
    }
    each_cell([&](std::size_t i, std::size_t cell) {
      p[i] = cell_p_[cell];
      r[i] = cell_addend_[cell];
    });
    batch.p_.write(p);
    addend.write(r);
    expand({{count(stride), count(cells_x), count(cells_y) * n}, {16, 1, 1}}, p_rows.buffer(),
           addend.buffer(), to_int(cells_x), to_int(cells_y), to_int(cells_z), settings_.rate, to_int(stride),
           count_n);
    auto window = settings_.window.value_or(std::pair{0.0, 0.0});
    window.first -= arithmetic_;
    window.second += arithmetic_;
    const std::array<std::uint64_t, 3> local = column_tuning(state_.info).local;
    cell_slack({{count((nz + 15) / 16), count(nx - 1), count(ny - 1) * n}, local}, cells.buffer(),
               batch.gold_.buffer(), p_rows.buffer(), to_int(nx), to_int(ny), to_int(nz), to_int(gold_stride),
               to_int(stride), settings_.rate, to_int(cells_x), to_int(cells_y), count_n,
               static_cast<cl_float>(1.5 * rounding_), settings_.window ? 1 : 0,
               static_cast<cl_float>(window.first), static_cast<cl_float>(window.second));
    node_slack({{count((nz + 15) / 16), count(nx), count(ny) * n}, local}, batch.slack_.buffer(),
               cells.buffer(), batch.margin_.buffer(), last.buffer(), to_int(nx), to_int(ny), to_int(nz),
               to_int(stride), count_n, batch.lowest_, to_int(z_low), to_int(z_high));
    on_batch(batch);
    for (std::size_t b = 0; b < n; ++b)
      spent_.work.samples += samples(bricks_x, bricks_y, bricks_z) * kept_share(work, blocks[begin + b]);
    tick(static_cast<double>(n));
  }
  spent_.block_seconds += watch.lap();
}

std::array<std::int64_t, 4> GoldStream::Batch::place(std::int64_t brick) const { return place_.at(brick); }

// Per brick of the blocks, [block][z][y][x].
struct GoldStream::Batch::Results {
  opencl::DeviceArray<cl_int> total, error, slack, violated;
};

GoldStream::Batch::Results GoldStream::Batch::run_measure(const DeviceField& field, float tolerance,
                                                          const opencl::DeviceArray<std::uint8_t>& selected) {
  const std::uint64_t n = blocks(), size = n * count(bricks_x_ * bricks_y_ * bricks_z_);
  Results r{{state_, size, "brick totals"},
            {state_, size, "brick errors"},
            {state_, size, "brick slack"},
            {state_, size, "violations"}};
  r.total.fill(-1);
  r.error.fill(0);
  r.slack.fill(-1);
  r.violated.fill(0);
  std::vector<cl_int4> firsts;
  for (const auto& f : first_brick_) firsts.push_back({{to_int(f[0]), to_int(f[1]), to_int(f[2]), 0}});
  const opencl::DeviceArray<cl_int4> first(state_, std::span<const cl_int4>(firsts), "first bricks");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrGrid, cl::Buffer,
                 cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_float, cl_int, cl_int, cl_int, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_int, cl_float>
      kernel(state_, "verify", "verify_nodes", field.defines);
  const std::uint64_t side = count(std::int64_t{settings_.granularity} * settings_.rate + 1);
  kernel({{count(bricks_x_) * side, count(bricks_y_) * side, n}, {side, 1, 1}}, r.total.buffer(),
         r.error.buffer(), r.slack.buffer(), r.violated.buffer(), field.samples.buffer(),
         field.bricks.buffer(), field.grid, gold_.buffer(), slack_.buffer(), margin_.buffer(), first.buffer(),
         selected.buffer(), lowest_, to_int(nx_), to_int(ny_), to_int(gold_stride_), to_int(stride_),
         settings_.rate, to_int(bricks_x_), to_int(bricks_y_), to_int(bricks_z_),
         to_int(static_cast<std::int64_t>(n)), tolerance);
  return r;
}

std::vector<BrickMeasure> GoldStream::Batch::measure(const DeviceField& field, float tolerance,
                                                     const opencl::DeviceArray<std::uint8_t>& selected) {
  const Results r = run_measure(field, tolerance, selected);
  const auto totals = r.total.to_host(), errors = r.error.to_host(), slacks = r.slack.to_host(),
             bits = r.violated.to_host();
  std::vector<BrickMeasure> out;
  for (const std::int64_t brick : bricks_) {
    const auto [b, x, y, z] = place(brick);
    const std::size_t i = at(((b * bricks_z_ + z) * bricks_y_ + y) * bricks_x_ + x);
    BrickMeasure m;
    m.brick = brick;
    if (totals[i] >= 0)
      m = {brick, std::bit_cast<float>(totals[i]), std::bit_cast<float>(errors[i]),
           std::bit_cast<float>(slacks[i]), static_cast<std::uint32_t>(bits[i])};
    out.push_back(m);
  }
  return out;
}

std::vector<BrickClass> GoldStream::Batch::classify(const DeviceField& base, float tolerance,
                                                    const opencl::DeviceArray<std::uint8_t>& selected) {
  const std::int64_t rate = settings_.rate, n = static_cast<std::int64_t>(blocks());
  const int top = std::countr_zero(static_cast<unsigned>(rate));
  Results level0 = run_measure(base, tolerance, selected);
  const auto totals = level0.total.to_host(), errors0 = level0.error.to_host(),
             slacks = level0.slack.to_host();
  const auto fails = [&](cl_int bits) { return bits >= 0 && !(std::bit_cast<float>(bits) <= tolerance); };

  const opencl::Defines defines{{"VDVR_BRICK_NODES", std::to_string(settings_.granularity * settings_.rate)}};
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int> interpolate(
      state_, "classify", "interpolate_columns", defines);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_float, cl_int,
                 cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int, cl_float>
      level_error(state_, "classify", "level_error", defines);
  opencl::DeviceArray<cl_int> before = std::move(level0.total), error(state_, before.size(), "brick errors");
  std::vector<std::vector<cl_int>> by_level{totals};
  for (int level = 1; level < top && std::any_of(by_level.back().begin(), by_level.back().end(), fails);
       ++level) {
    const std::int64_t spacing = rate >> level, cx = (nx_ - 1) / spacing + 1, cy = (ny_ - 1) / spacing + 1;
    const opencl::DeviceArray<float> along(state_, count(n * cx * cy * stride_ + gold_room),
                                           "interpolated columns");
    error.fill(-1);
    interpolate({{count(cx), count(cy), count(n)}, {8, 8, 1}}, along.buffer(), gold_.buffer(), to_int(nx_),
                to_int(ny_), to_int(nz_), to_int(gold_stride_), to_int(stride_), to_int(spacing), to_int(n));
    level_error({{count(nx_), count(ny_), count(bricks_z_ * n)}, {16, 4, 1}}, error.buffer(), before.buffer(),
                along.buffer(), gold_.buffer(), slack_.buffer(), margin_.buffer(), lowest_, to_int(nx_),
                to_int(ny_), to_int(nz_), to_int(gold_stride_), to_int(stride_), to_int(spacing),
                to_int(bricks_x_), to_int(bricks_y_), to_int(bricks_z_), to_int(n), tolerance);
    by_level.push_back(error.to_host());
    std::swap(error, before);
  }
  std::vector<BrickClass> out;
  for (const std::int64_t brick : bricks_) {
    const auto [b, x, y, z] = place(brick);
    const std::size_t i = at(((b * bricks_z_ + z) * bricks_y_ + y) * bricks_x_ + x);
    BrickClass c;
    c.base.brick = brick;
    if (totals[i] >= 0) {
      c.base = {brick, std::bit_cast<float>(totals[i]), std::bit_cast<float>(errors0[i]),
                std::bit_cast<float>(slacks[i]), 0};
      while (c.level < static_cast<int>(by_level.size()) && fails(by_level[at(c.level)][i])) ++c.level;
    }
    out.push_back(c);
  }
  return out;
}

std::vector<std::pair<float, float>> GoldStream::Batch::largest_p() {
  const auto p = p_.to_host();
  const std::int64_t g = settings_.granularity, rate = settings_.rate, cells_x = bricks_x_ * g,
                     cells_y = bricks_y_ * g, cells_z = (nz_ - 1) / rate;
  std::vector<std::pair<float, float>> out;
  for (const std::int64_t brick : bricks_) {
    const auto [b, x, y, z] = place(brick);
    std::pair<float, float> range{0.0f, INFINITY};
    for (std::int64_t k = z * g; k < std::min((z + 1) * g, cells_z); ++k)
      for (std::int64_t j = y * g; j < (y + 1) * g; ++j)
        for (std::int64_t i = x * g; i < (x + 1) * g; ++i) {
          const float v = p[at(((b * cells_z + k) * cells_y + j) * cells_x + i)];
          range = {std::max(range.first, v), std::min(range.second, v)};
        }
    out.push_back(range);
  }
  return out;
}

std::vector<float> GoldStream::Batch::extract(
    const std::vector<std::pair<std::int64_t, LevelTriple>>& tiles) {
  if (tiles.empty()) return {};
  const std::int64_t g = settings_.granularity, rate = settings_.rate;
  std::vector<TileRequest> requests;
  std::uint64_t total = 0;
  std::int64_t largest = 0;
  for (const auto& [brick, level] : tiles) {
    const auto [b, x, y, z] = place(brick);
    const auto& first = first_brick_[at(b)];
    TileRequest r{};
    r.block = to_int(b);
    r.node_x = to_int(x * g * rate);
    r.node_y = to_int(y * g * rate);
    r.node_z = to_int(z * g * rate);
    r.spacing_x = to_int(rate >> level[2]);
    r.spacing_y = to_int(rate >> level[1]);
    r.spacing_z = to_int(rate >> level[0]);
    r.side_x = to_int((g << level[2]) + 1);
    r.side_y = to_int((g << level[1]) + 1);
    r.side_z = to_int((g << level[0]) + 1);
    r.last_x = to_int(std::min(nx_ - 1, (settings_.grid.cells[0] - first[0] * g) * rate));
    r.last_y = to_int(std::min(ny_ - 1, (settings_.grid.cells[1] - first[1] * g) * rate));
    r.last_z = to_int(nz_ - 1);
    r.offset = total;
    const std::int64_t size = std::int64_t{r.side_x} * r.side_y * r.side_z;
    total += count(size);
    largest = std::max(largest, size);
    requests.push_back(r);
  }
  const opencl::DeviceArray<TileRequest> device_requests(state_, std::span<const TileRequest>(requests),
                                                         "tile requests");
  const opencl::DeviceArray<float> out(state_, total, "tiles of a block");
  const opencl::Defines defines{{"VDVR_BRICK_NODES", std::to_string(settings_.granularity * settings_.rate)}};
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_float>
      kernel(state_, "classify", "extract_tiles", defines);
  kernel({{count(largest), requests.size(), 1}, {64, 1, 1}}, out.buffer(), gold_.buffer(), margin_.buffer(),
         device_requests.buffer(), to_int(static_cast<std::int64_t>(requests.size())), to_int(nx_),
         to_int(ny_), to_int(gold_stride_), static_cast<cl_float>(-kept_margin(settings_.grid, 1)));
  return out.to_host();
}

}  // namespace vdvr
