// Launcher of kernels/field/fdk/cone_back_project.cl, and the tables it reads.
#include "host/field/fdk/cone_back_project.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/opencl/kernel.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fbp/back_project.hpp"
#include "shared/cone_back_project.h"

namespace vdvr {

static_assert(sizeof(VdvrConeBand) == 48);
static_assert(sizeof(VdvrConeView) == 64);

namespace {

constexpr std::int64_t longest_vector = 16;
// Pixels that a vector may lie between, beyond which single lanes are faster.
constexpr int most_spans = 10;
// Rows beyond those on either side: a vector with a lane that is wanted begins as many rows below, and
// ends as many above.
constexpr std::int64_t rows_of_vectors = longest_vector + most_spans + 4;
// Alike of a single lane, which reads two.
constexpr std::int64_t rows_of_lane = 2;
constexpr int views_together = 8;
// Of the detector, from which on tables are made by transforms along v.
constexpr std::int64_t fewest_rows = 16;
// Of fewer planes most lanes would be idle.
constexpr std::int64_t fewest_planes = 4;

std::int64_t rows_around(const ConeReach& reach) { return reach.vectors ? rows_of_vectors : rows_of_lane; }

std::int64_t mirrored(std::int64_t i, std::int64_t n) {
  const std::int64_t period = 2 * n, m = ((i % period) + period) % period;
  return m < n ? m : period - 1 - m;
}

// Values straight from the detector's own pixels.
void copy_pixels(const FilteredScan& scan, ConeTable& table) {
  const ParallelGeometry& g = scan.geometry;
  const auto first = static_cast<std::int64_t>(table.first_column),
             first_row = static_cast<std::int64_t>(table.first_row);
  table.values.write_mapped([&](std::span<float> mapped) {
    parallel_for(table.views, {}, "", [&](std::int64_t k) {
      for (std::int64_t c = 0; c < table.columns; ++c) {
        const float* column = scan.samples.data() +
                              ((table.first_view + k) * g.columns + mirrored(first + c, g.columns)) * g.rows;
        float* to = mapped.data() + (k * table.columns + c) * table.row_stride;
        for (std::int64_t r = 0; r < table.rows; ++r) {
          const std::int64_t row = r + first_row;
          to[r] = column[row >= 0 && row < g.rows ? row : mirrored(row, g.rows)];
        }
        std::fill(to + table.rows, to + table.row_stride, 0.0f);
      }
    });
  });
}

// Of a view about the middle of a block of columns.
VdvrConeView view_about(const ViewMatrix& m, const ConeTable& table, const Grid& grid,
                        const std::array<double, 3>& middle) {
  Vec3 place{};
  for (std::size_t a = 0; a < 3; ++a) place[a] = grid.origin[a] + middle[a] * grid.spacing[a];
  const Vec3 seen = projected(m, place);
  const double u = (seen[0] - table.first_column) * table.rate, v = (seen[1] - table.first_row) * table.rate;
  VdvrConeView out{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double h = grid.spacing[a];
    out.step_u[a] = static_cast<float>((m[0][a] - seen[0] * m[2][a]) * h * table.rate);
    out.step_v[a] = static_cast<float>((m[1][a] - seen[1] * m[2][a]) * h * table.rate);
    out.step_lambda[a] = static_cast<float>(m[2][a] * h);
  }
  out.lambda = static_cast<float>(seen[2]);
  out.whole_u = static_cast<float>(std::round(u));
  out.whole_v = static_cast<float>(std::round(v));
  out.part_u = static_cast<float>(u - std::round(u));
  out.part_v = static_cast<float>(v - std::round(v));
  return out;
}

bool is_upright(const ViewMatrix& m) {
  const auto small = [&](std::size_t row) {
    return std::abs(m[row][2]) <= 1e-14 * std::hypot(m[row][0], m[row][1], m[row][2]);
  };
  return small(0) && small(2);
}

// What the lanes of a vector see of a view, at most.
struct Spread {
  double rows = 0, columns = 0;  // from the first lane to the last, beyond a pixel a lane
  double bend = 0;               // of a run of rows between its ends
  bool upright = true;
};

// Of lambda at the ends of the wanted columns: it is affine, so that these are its extremes.
struct LambdaRange {
  double least = INFINITY, most = -INFINITY;
};

LambdaRange lambda_range(const ViewMatrix& m, const ConeBand& band) {
  LambdaRange range;
  const std::int64_t nx = band.nx();
  for (std::int64_t y = 0; y < band.ny; ++y) {
    std::int64_t first = 0, last = nx - 1;
    const auto is_wanted = [&](std::int64_t x) {
      const auto& w = band.wanted[at(y * nx + x)];
      return w[0] <= w[1];
    };
    while (first <= last && !is_wanted(first)) ++first;
    while (last > first && !is_wanted(last)) --last;
    if (first > last) continue;
    for (const std::int64_t x : {first, last})
      for (const std::int64_t z : {std::int64_t{0}, band.nz - 1}) {
        const double lambda = projected(m, band.grid->position({x, band.first_y + y, band.first_z + z}))[2];
        range.least = std::min(range.least, lambda);
        range.most = std::max(range.most, lambda);
      }
  }
  return range;
}

Spread spread_of(const FilteredScan& scan, const ConeTable& table, const ConeBand& band) {
  Spread out;
  const double h = band.grid->spacing[2], lanes = longest_vector - 1;
  for (std::int64_t k = 0; k < table.views; ++k) {
    const ViewMatrix& m = scan.views[at(table.first_view + k)];
    const LambdaRange range = lambda_range(m, band);
    if (range.least > range.most) continue;
    const double least = std::max(range.least, 1e-3);
    const bool upright = is_upright(m);
    const double sheared = std::abs(m[2][2]) * h * table.rate / least, rows = m[1][2] * h * table.rate,
                 near = rows / least, far = rows / std::max(range.most, least),
                 reach = static_cast<double>(std::max(table.rows, table.columns)) / table.rate;
    out.upright = out.upright && upright;
    out.rows = std::max(out.rows, lanes * (std::max(std::abs(near - table.rate), std::abs(far - table.rate)) +
                                           sheared * reach));
    out.columns =
        std::max(out.columns, lanes * (std::abs(m[0][2]) * h * table.rate / least + sheared * reach));
    out.bend = std::max(
        out.bend, lanes * lanes / 4 * std::abs(m[2][2]) * h / least * (std::abs(near) + sheared * reach));
  }
  return out;
}

}  // namespace

bool planes_suit_vectors(const FilteredScan& scan, const Grid& grid) {
  if (grid.samples()[2] < fewest_planes) return false;
  // Of a plane at the axis, where lambda is 1: beyond what vectors may lie between, single lanes are taken.
  return std::ranges::all_of(scan.views, [&](const ViewMatrix& m) {
    const double beyond = std::abs(std::abs(m[1][2]) * grid.spacing[2] - 1);
    return static_cast<double>(longest_vector - 1) * beyond < most_spans;
  });
}

ConeTables::ConeTables(opencl::State& state, const FilteredScan& scan, int rate, const ConeReach& reach)
    : state_(state),
      scan_(scan),
      rate_(rate),
      vectors_(reach.vectors),
      columns_(upsampled_columns(scan.geometry.columns, rate, static_cast<double>(reach.columns))),
      first_row_(reach.first_row - rows_around(reach)),
      rows_((reach.last_row - reach.first_row + 2 * rows_around(reach)) * rate + 1),
      // Of each phase; vectors read past the last row.
      row_stride_(rate * column_stride((rows_ + rate - 1) / rate + longest_vector)),
      upsampler_(state, scan, ColumnMethod::accurate) {
  const std::int64_t V = scan.geometry.rows, last_row = reach.last_row + rows_around(reach),
                     beyond = std::max({std::int64_t{0}, -first_row_, last_row - V + 1});
  if (rate > 1 && 2 * (reach.last_row - reach.first_row) >= V &&
      DenseValues::suit(state, scan.geometry, fewest_rows))
    dense_.emplace(state, upsampler_, scan, columns_,
                   upsampled_columns(V, rate, static_cast<double>(beyond)));
}

std::uint64_t ConeTables::bytes(std::int64_t views) const {
  const std::uint64_t table = sizeof(float) * count(views * columns_.count * row_stride_);
  if (rate_ == 1) return table;
  return table + (dense_ ? dense_->bytes(views) : table);
}

ConeTable ConeTables::operator()(std::int64_t first, std::int64_t views) {
  ConeTable table{
      {},    rate_, columns_.count, rows_, row_stride_, columns_.position(0), static_cast<double>(first_row_),
      first, views, vectors_};
  table.values =
      opencl::DeviceArray<float>(state_, count(views * columns_.count * row_stride_), "filtered views");
  if (rate_ == 1) copy_pixels(scan_, table);
  else if (dense_)
    dense_->join(
        table.values, first, views,
        {std::llround(dense_->rows().column_of(table.first_row)), rows_, rate_, row_stride_ / rate_});
  else upsample(table);
  return table;
}

// From chunks of 16 rows to whole columns.
void ConeTables::upsample(ConeTable& table) {
  std::vector<double> rows(at(rows_));
  for (std::size_t r = 0; r < rows.size(); ++r) rows[r] = table.first_row + static_cast<double>(r) / rate_;
  const UpsampledSlab slab = upsampler_(columns_, rows, 0, 0, rate_, table.first_view, table.views);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> kernel(
      state_, "field/fdk/join_rows", "join_rows", {{"VDVR_RATE", std::to_string(rate_)}});
  const std::int64_t all = table.views * columns_.count, of_phase = row_stride_ / rate_;
  kernel({{count(of_phase), count(rate_), count(all)}, {16, 1, 1}}, table.values.buffer(),
         slab.values.buffer(), to_int(all), to_int(rows_), to_int(of_phase));
  opencl::finish(state_, "upsampled rows");  // before the slab goes
}

void cone_back_project(opencl::State& state, const FilteredScan& scan, const ConeTable& table,
                       const ConeBand& band, opencl::DeviceArray<float>& out) {
  cone_back_project(state, scan, table, band, out, table.vectors ? column_tuning(state.info).lanes : 1);
}

void cone_back_project(opencl::State& state, const FilteredScan& scan, const ConeTable& table,
                       const ConeBand& band, opencl::DeviceArray<float>& out, int lanes) {
  const std::int64_t nx = band.nx(), blocks_x = (nx + VDVR_CONE_BLOCK - 1) / VDVR_CONE_BLOCK,
                     blocks_y = (band.ny + VDVR_CONE_BLOCK - 1) / VDVR_CONE_BLOCK;
  std::vector<VdvrConeView> views(at(blocks_x * blocks_y * table.views));
  parallel_for(blocks_x * blocks_y, {}, "", [&](std::int64_t b) {
    const auto middle = [](std::int64_t block) {
      return static_cast<double>(block * VDVR_CONE_BLOCK) + 0.5 * (VDVR_CONE_BLOCK - 1);
    };
    const std::array<double, 3> place{
        middle(b % blocks_x), static_cast<double>(band.first_y) + middle(b / blocks_x),
        static_cast<double>(band.first_z) + 0.5 * static_cast<double>(band.nz - 1)};
    for (std::int64_t k = 0; k < table.views; ++k)
      views[at(b * table.views + k)] =
          view_about(scan.views[at(table.first_view + k)], table, *band.grid, place);
  });
  const Spread spread = spread_of(scan, table, band);
  const double widest = most_spans * table.rate;
  if (spread.rows + 2 > widest || spread.columns + 2 > widest || spread.bend >= 1) lanes = 1;
  const auto spans = [&](double beyond, std::int64_t most) {
    const double wide = lanes == 1 ? 1 : beyond + (spread.upright ? 2 : 4);
    return to_int(std::clamp<std::int64_t>(static_cast<std::int64_t>(std::ceil(wide)), 1, most));
  };
  std::vector<cl_int2> wanted(band.wanted.size());
  std::transform(band.wanted.begin(), band.wanted.end(), wanted.begin(), [](const auto& w) {
    return cl_int2{{w[0], w[1]}};
  });
  const opencl::DeviceArray<VdvrConeView> on_device(state, std::span<const VdvrConeView>(views),
                                                    "views about blocks");
  const opencl::DeviceArray<cl_int2> ranges(state, std::span<const cl_int2>(wanted), "wanted planes");
  const bool wide = lanes > 1;
  const int tile = wide ? 4 : 1, vectors_each = wide && band.nz > lanes ? 4 : 1;
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, cl::Buffer, VdvrConeBand> kernel(
      state, "field/fdk/cone_back_project", "cone_back_project",
      {{"VDVR_LANES", std::to_string(lanes)},
       {"VDVR_RATE", std::to_string(table.rate)},
       {"VDVR_UPRIGHT", spread.upright ? "1" : "0"},
       {"VDVR_RUN", std::to_string(views_together)},
       {"VDVR_DEPTH_POWER", std::to_string(band.depth_power)},
       {"VDVR_VECTORS", std::to_string(vectors_each)},
       {"VDVR_TILE_X", std::to_string(tile)},
       {"VDVR_TILE_Y", std::to_string(tile)}});
  const VdvrConeBand shape{.views = to_int(table.views),
                           .columns = to_int(table.columns),
                           .rows = to_int(table.rows),
                           .row_stride = to_int(table.row_stride),
                           .nx = to_int(nx),
                           .ny = to_int(band.ny),
                           .nz = to_int(band.nz),
                           .out_stride = to_int(column_stride(band.nz)),
                           .blocks_x = to_int(blocks_x),
                           .adds = band.adds ? 1 : 0,
                           .spans_v = spans(spread.rows, table.rows - 1),
                           .spans_u = spans(spread.columns, table.columns - 1)};
  const std::int64_t carried = std::int64_t{lanes} * vectors_each;
  const std::uint64_t vectors = count((band.nz + carried - 1) / carried);
  const auto tiles = [&](std::int64_t n) { return count((n + tile - 1) / tile); };
  kernel({{vectors, tiles(nx), tiles(band.ny)},
          wide ? std::array<std::uint64_t, 3>{1, 1, 1} : std::array<std::uint64_t, 3>{16, 4, 1}},
         out.buffer(), table.values.buffer(), on_device.buffer(), ranges.buffer(), shape);
}

}  // namespace vdvr
