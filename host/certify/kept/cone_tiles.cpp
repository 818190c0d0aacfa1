#include "host/certify/kept/cone_tiles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <ranges>

#include "host/base/opencl/work_groups.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fbp/back_project.hpp"
#include "host/field/fdk/region_parts.hpp"
#include "shared/upright_table.h"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrConeNodes) == 64);

namespace {

using std::numbers::pi;
// A table has room for most_views of up to 520 columns and rows: where kept nodes lie in scratch, each table
// writes them all to disk once more.
constexpr std::uint64_t most_table_bytes = std::uint64_t{1536} << 20,
                        most_view_bytes = std::uint64_t{16} << 20;
constexpr std::int64_t side = VDVR_CONE_TILE, heights = VDVR_CONE_HEIGHTS;

// What a view is about the middle of a block of nodes, as kernels/certify/kept/cone_nodes.cl reads it: places
// in the table, steps by node.
template <class Real>
struct ViewNumbers {
  Real step_u[3], part_u, step_v[3], part_v, step_lambda[3], lambda, whole_u, whole_v, unused[2];
};

template <class Real>
ViewNumbers<Real> numbers_about(const ViewMatrix& m, const Vec3& middle, const Vec3& spacing,
                                const TableAxis& columns, const TableAxis& rows) {
  const Vec3 seen = projected(m, middle);
  const double u = columns.column_of(seen[0]), v = rows.column_of(seen[1]);
  ViewNumbers<Real> out{};
  for (std::size_t a = 0; a < 3; ++a) {
    out.step_u[a] = static_cast<Real>((m[0][a] - seen[0] * m[2][a]) * spacing[a] * columns.density);
    out.step_v[a] = static_cast<Real>((m[1][a] - seen[1] * m[2][a]) * spacing[a] * rows.density);
    out.step_lambda[a] = static_cast<Real>(m[2][a] * spacing[a]);
  }
  out.lambda = static_cast<Real>(seen[2]);
  out.whole_u = static_cast<Real>(std::round(u));
  out.whole_v = static_cast<Real>(std::round(v));
  out.part_u = static_cast<Real>(u - std::round(u));
  out.part_v = static_cast<Real>(v - std::round(v));
  return out;
}

// Nodes that share a view's numbers: in double precision a whole tile's, else few enough for fp32 places.
struct Blocks {
  Blocks(bool in_double, std::int64_t all_groups)
      : across(in_double ? side : 8), groups(in_double ? std::max<std::int64_t>(1, all_groups) : 2) {
    per_side = side / across;
    layers = (all_groups + groups - 1) / groups;
  }
  [[nodiscard]] std::int64_t count() const { return per_side * per_side * layers; }
  std::int64_t across, groups, per_side = 1, layers = 1;
};

// Pixels that a node's place may lie from that of its block's middle, half a block
// away by axis, sums of magnitudes: with d_e the way there, u - u_middle = sum of X_e d_e / lambda_middle,
// and the kernel's products are X_e at the middle, X_e - (u - u_middle) lambda_e, times d_e, over lambda at
// the node.
std::array<double, 2> places_from_middle(const ViewBox& seen, const Vec3& half) {
  double u = 0, v = 0, growth = 0;
  for (std::size_t e = 0; e < 3; ++e) {
    u += seen.along_u[e] * half[e];
    v += seen.along_v[e] * half[e];
    growth += seen.growth[e] * half[e];
  }
  // Tiles reach no nearer to a source (KeptGold::room_to_sources).
  const double middle = std::max(seen.lambda_min - growth, 0.25 * seen.lambda_min);
  const double more = (1 + growth / middle) / seen.lambda_min;
  return {u * more, v * more};
}

TableAxis axis_of(const UpsampledColumns& c) {
  return {c.first, static_cast<double>(c.rate), c.pad, c.count};
}

}  // namespace

InputError source_too_close(std::size_t view) {
  return InputError(
      fmt::format("cone beam: nodes around the covered region reach the plane of the source of view {}; the "
                  "source stands "
                  "too close to what all views see: no certificate can be made",
                  view));
}

ConeTiles::ConeTiles(opencl::State& state, const FilteredScan& scan, Upsampler& upsampler,
                     const FieldSups& sups, const Coverage& coverage, const ConeLattice& lattice)
    : state_(state), scan_(scan), upsampler_(upsampler), sups_(sups), lattice_(lattice) {
  in_double_ = ColumnUpsampling::is_possible(state);
  if (!std::all_of(scan.views.begin(), scan.views.end(), is_upright))
    upright_views_.emplace(scan.views, scan.geometry);
  look_at_views(coverage);
  // A strip has the rows between a run's ends, eight that a height reads, a row on either side, and begins at
  // a multiple of 16.
  in_runs_ = in_double_ && opencl::lanes_of(state.info, to_int(heights)) > 1 &&
             VDVR_CONE_RUN * row_step_ + 32 <= VDVR_CONE_STRIP;
  if (DenseValues::suit(state, scan.geometry, fewest_rows))
    dense_.emplace(state, upsampler, scan, columns_, rows_);
  column_stride_ = column_stride(table_rows_.count + heights);
  views_together_ = views_that_fit();
}

// Places, frequencies and weights of all views, part by part of the region.
void ConeTiles::look_at_views(const Coverage& coverage) {
  const ParallelGeometry& g = scan_.geometry;
  struct Seen {
    double beyond_u = 0, beyond_v = 0, weight = 0, sum = 0;
    std::optional<std::size_t> too_close{};  // a view
  };
  const std::vector<Corners> parts = RegionOutline(coverage, lattice_.claimed).parts(lattice_.claimed_z);
  std::vector<Seen> of_parts(parts.size());
  parallel_for(static_cast<std::int64_t>(parts.size()), {}, "", [&](std::int64_t i) {
    Seen& out = of_parts[at(i)];
    std::vector<ViewBox> boxes(scan_.views.size());
    view_boxes(scan_.views, parts[at(i)], boxes);
    for (std::size_t k = 0; k < scan_.views.size(); ++k) {
      const ViewBox& seen = boxes[k];
      if (!(seen.lambda_min > 0)) {
        out.too_close = k;
        return;
      }
      for (const Vec3& corner : parts[at(i)]) {
        const Vec3 place = projected(scan_.views[k], corner);
        out.beyond_u =
            std::max({out.beyond_u, -0.5 - place[0], place[0] - static_cast<double>(g.columns) + 0.5});
        out.beyond_v =
            std::max({out.beyond_v, -0.5 - place[1], place[1] - static_cast<double>(g.rows) + 0.5});
      }
      const double weight = 1 / (seen.lambda_min * seen.lambda_min);
      out.weight = std::max(out.weight, weight);
      out.sum += weight * sups_.by_view[k].value;
    }
  });
  double beyond_u = 0, beyond_v = 0;
  for (const Seen& seen : of_parts) {
    if (seen.too_close) throw source_too_close(*seen.too_close);
    beyond_u = std::max(beyond_u, seen.beyond_u);
    beyond_v = std::max(beyond_v, seen.beyond_v);
    largest_weight_ = std::max(largest_weight_, seen.weight);
    sup_ = std::max(sup_, seen.sum * (1 + 1e-12));
  }
  for (std::size_t axis = 0; axis < 3; ++axis) look_at_axis(axis, coverage);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double>& bands = bands_seen_[axis == 2 ? 1 : 0];  // x and y share theirs
    std::array<bool, ProjectiveError::bands> seen{};
    for (const double band : bands) seen[ProjectiveError::place_of(band, highest(axis))] = true;
    for (const auto& part : at_parts_[axis])
      for (const ViewAtPart& view : part)
        if (bool& known = seen[ProjectiveError::place_of(view.band, highest(axis))]; !known) {
          known = true;
          bands.push_back(view.band);
        }
  }
  const double around = upright_views_ ? 2 : 1;  // of places that a table is made of, or that are read
  columns_ = upsampled_columns(g.columns, density, std::ceil(beyond_u) + around);
  rows_ = upsampled_columns(g.rows, density, std::ceil(beyond_v) + around);
  look_at_table(parts, {beyond_u, beyond_v});
}

// Where nodes lie in the tables: in those of upright detectors.
void ConeTiles::look_at_table(const std::vector<Corners>& parts, const std::array<double, 2>& beyond) {
  const Blocks blocks(in_double_, lattice_.groups);
  const Vec3 half{0.5 * static_cast<double>(blocks.across) * lattice_.spacing[0],
                  0.5 * static_cast<double>(blocks.across) * lattice_.spacing[1],
                  0.5 * static_cast<double>(blocks.groups * heights) * lattice_.spacing[2]};
  struct Seen {
    double row_step = 0, reach = 0;
    std::array<double, 2> low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
    std::optional<std::size_t> too_close{};  // a view
  };
  std::vector<Seen> of_parts(parts.size());
  parallel_for(std::ssize(parts), {}, "", [&](std::int64_t i) {
    Seen& out = of_parts[at(i)];
    std::vector<ViewBox> boxes(views().size());
    view_boxes(views(), parts[at(i)], boxes);
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      const ViewBox& seen = boxes[k];
      if (!(seen.lambda_min > 0)) {
        out.too_close = k;
        return;
      }
      const auto [places_u, places_v] = places_from_middle(seen, half);
      out.row_step = std::max(out.row_step, lattice_.spacing[2] * seen.along_v[2] / seen.lambda_min);
      out.reach = std::max({out.reach, places_u, places_v});
      if (!upright_views_) continue;
      for (const Vec3& corner : parts[at(i)]) {
        const Vec3 place = projected(views()[k], corner);
        for (std::size_t a = 0; a < 2; ++a) {
          out.low[a] = std::min(out.low[a], place[a]);
          out.high[a] = std::max(out.high[a], place[a]);
        }
      }
    }
  });
  Seen all;
  for (const Seen& seen : of_parts) {
    if (seen.too_close) throw source_too_close(*seen.too_close);
    all.row_step = std::max(all.row_step, seen.row_step);
    all.reach = std::max(all.reach, seen.reach);
    for (std::size_t a = 0; a < 2; ++a) {
      all.low[a] = std::min(all.low[a], seen.low[a]);
      all.high[a] = std::max(all.high[a], seen.high[a]);
    }
  }
  if (upright_views_) upright_views_->set_table(density, beyond, all.low, all.high);
  table_columns_ = upright_views_ ? upright_views_->columns() : axis_of(columns_);
  table_rows_ = upright_views_ ? upright_views_->rows() : axis_of(rows_);
  row_step_ = table_rows_.density * all.row_step;
  block_reach_ = std::max(table_columns_.density, table_rows_.density) * all.reach;
}

// Filters along z are first, then y, then x: the last one fills nodes that are read, those before it what it
// reads on either side.
void ConeTiles::look_at_axis(std::size_t axis, const Coverage& coverage) {
  const double spacing = lattice_.spacing[axis];
  const std::pair heights{lattice_.claimed_z.first + lattice_.less_z,
                          lattice_.claimed_z.second - lattice_.less_z};
  const std::vector<Corners> parts =
      RegionOutline(coverage, lattice_.claimed - lattice_.less[axis]).parts(heights);
  at_parts_[axis].resize(parts.size());
  parallel_for(static_cast<std::int64_t>(parts.size()), {}, "", [&](std::int64_t i) {
    std::vector<ViewBox> boxes(scan_.views.size());
    view_boxes(scan_.views, parts[at(i)], boxes);
    for (std::size_t k = 0; k < scan_.views.size(); ++k) {
      const ViewBox& seen = boxes[k];
      const double of_v = scan_.geometry.rows > 1 ? seen.along_v[axis] : 0.0;
      at_parts_[axis][at(i)].push_back({sups_.by_view[k].value / (seen.lambda_min * seen.lambda_min),
                                        pi * spacing * (seen.along_u[axis] + of_v) / seen.lambda_min,
                                        spacing * seen.growth[axis] / seen.lambda_min});
    }
  });
  for (const auto& part : at_parts_[axis])
    for (const ViewAtPart& view : part) band_[axis] = std::max(band_[axis], view.band);
  // Those that see most of the highest frequencies first: a filter errs by about the band to its taps there.
  constexpr int steep = 20;
  const auto score = [&](const std::vector<ViewAtPart>& part) {
    double sum = 0;
    for (const ViewAtPart& view : part) sum += view.weight * std::pow(view.band / band_[axis], steep);
    return sum;
  };
  std::vector<double> scores(parts.size());
  parallel_for(std::ssize(parts), {}, "",
               [&](std::int64_t i) { scores[at(i)] = score(at_parts_[axis][at(i)]); });
  std::vector<std::size_t> order(parts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater<>{}, [&](std::size_t i) { return scores[i]; });
  std::vector<std::vector<ViewAtPart>> sorted;
  for (const std::size_t i : order) sorted.push_back(std::move(at_parts_[axis][i]));
  at_parts_[axis] = std::move(sorted);
}

// --- tables ---

// Decided once: what sums err depends on it.
std::int64_t ConeTiles::views_that_fit() const {
  const std::uint64_t table = sizeof(float) * count(columns_.count * dense_stride()),
                      upright = upright_views_ ? sizeof(float) * count(plane()) : 0,
                      each = table + (dense_ ? dense_->bytes(1) : table) + upright,
                      share =
                          std::min({state_.memory.left() / 3, most_table_bytes, state_.info.max_allocation});
  if (state_.memory.left() / 2 < each)
    throw ResourceError(
        fmt::format("a view of {} x {} pixels, eight times finer both ways, needs {:.1f} MiB; "
                    "raise `max_memory`",
                    scan_.geometry.columns, scan_.geometry.rows, static_cast<double>(each) / 0x1p20));
  const auto fit = static_cast<std::int64_t>(share / each);
  return std::clamp<std::int64_t>(fit > VDVR_CONE_VIEWS ? fit / VDVR_CONE_VIEWS * VDVR_CONE_VIEWS : fit, 1,
                                  std::min(most_views, scan_.geometry.views()));
}

ConeTiles::Table ConeTiles::table(std::int64_t first, std::int64_t views) {
  Table dense = dense_table(first, views);
  if (!upright_views_) return dense;
  return in_double_ ? upright_table<double>(dense) : upright_table<float>(dense);
}

template <class Real>
ConeTiles::Table ConeTiles::upright_table(const Table& dense) {
  std::vector<UprightRow<Real>> rows;
  for (std::int64_t k = dense.first; k < dense.first + dense.views; ++k)
    std::ranges::copy(upright_views_->rows_of<Real>(at(k), columns_, rows_), std::back_inserter(rows));
  const opencl::DeviceArray<UprightRow<Real>> on_device(state_, std::span<const UprightRow<Real>>(rows),
                                                        "rows of upright views");
  Table out{opencl::DeviceArray<float>(state_, count(dense.views * plane()), "upright views"), dense.first,
            dense.views};
  const VdvrUprightTable shape{.from_plane = count(columns_.count * dense_stride()),
                               .from_stride = to_int(dense_stride()),
                               .last_column = to_int(columns_.count - 8),
                               .columns = to_int(table_columns_.count),
                               .rows = to_int(table_rows_.count),
                               .stride = to_int(column_stride_),
                               .views = to_int(dense.views)};
  opencl::Kernel<cl::Buffer, cl::Buffer, cl::Buffer, VdvrUprightTable> kernel(
      state_, "certify/kept/upright_table", "upright_table", {{"VDVR_DOUBLE", in_double_ ? "1" : "0"}});
  const std::int64_t runs = (column_stride_ + VDVR_UPRIGHT_RUN - 1) / VDVR_UPRIGHT_RUN;
  kernel(opencl::in_groups(state_.info, {count(runs), count(table_columns_.count), count(dense.views)},
                           {1, 1, 1}, 1),
         out.values.buffer(), dense.values.buffer(), on_device.buffer(), shape);
  opencl::finish(state_, "upright views");  // before what they are made of goes
  return out;
}

ConeTiles::Table ConeTiles::dense_table(std::int64_t first, std::int64_t views) {
  const std::int64_t stride = dense_stride();
  Table out{opencl::DeviceArray<float>(state_, count(views * columns_.count * stride), "dense views"), first,
            views};
  if (dense_) {
    dense_->join(out.values, first, views, {0, rows_.count, 1, stride});
    return out;
  }
  std::vector<double> rows;
  for (std::int64_t r = 0; r < rows_.count; ++r) rows.push_back(rows_.position(r));
  const UpsampledSlab slab = upsampler_(columns_, rows, 0, 0, density, first, views);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> join(state_, "certify/kept/join_rows",
                                                                      "join_kept_rows");
  const std::int64_t lines = views * columns_.count;
  join({{count(stride), count(lines), 1}, {16, 1, 1}}, out.values.buffer(), slab.values.buffer(),
       to_int(lines), to_int(rows_.count), to_int(stride));
  opencl::finish(state_, "dense views");  // before the slab goes
  return out;
}

// --- nodes ---

// Strips are for devices whose work-items have caches of their own.
ConeTiles::NodesKernel ConeTiles::nodes_kernel(int lanes) {
  if (in_runs_) return {state_, "certify/kept/cone_runs", "cone_runs"};
  return {state_,
          "certify/kept/cone_nodes",
          "cone_nodes",
          {{"VDVR_DOUBLE", in_double_ ? "1" : "0"}, {"VDVR_LANES", std::to_string(lanes)}}};
}

template <class Real>
void ConeTiles::launch(const Table& table, const ConePage& page, VdvrConeNodes shape) {
  const Blocks blocks(in_double_, lattice_.groups);
  const std::int64_t of_tile = blocks.count() * table.views;
  const auto together = static_cast<std::size_t>(std::max<std::int64_t>(
      1, static_cast<std::int64_t>(most_view_bytes / sizeof(ViewNumbers<Real>)) / of_tile));
  const int lanes = opencl::lanes_of(state_.info, to_int(heights)), along = in_runs_ ? VDVR_CONE_RUN : lanes;
  const std::array<std::uint64_t, 2> items{count(in_runs_ ? side / VDVR_CONE_ROWS : side),
                                           count((lattice_.groups * heights + along - 1) / along)};
  NodesKernel kernel = nodes_kernel(lanes);
  for (std::size_t first = 0; first < page.first.size(); first += together) {
    const std::size_t n = std::min(together, page.first.size() - first);
    std::vector<ViewNumbers<Real>> numbers(n * at(of_tile));
    parallel_for(static_cast<std::int64_t>(n) * blocks.count(), {}, "", [&](std::int64_t i) {
      const auto& [x0, y0] = page.first[first + at(i / blocks.count())];
      const std::int64_t b = i % blocks.count(), x = b % blocks.per_side,
                         y = b / blocks.per_side % blocks.per_side,
                         z = b / (blocks.per_side * blocks.per_side);
      const auto middle = [&](std::int64_t block, std::int64_t nodes) {
        return static_cast<double>(block * nodes) + 0.5 * static_cast<double>(nodes - 1);
      };
      const Vec3& h = lattice_.spacing;
      const double height = static_cast<double>(lattice_.low) + middle(z, blocks.groups * heights);
      const Vec3 place{x0 + middle(x, blocks.across) * h[0], y0 + middle(y, blocks.across) * h[1],
                       lattice_.origin[2] + height * h[2]};
      for (std::int64_t k = 0; k < table.views; ++k)
        numbers[at(i * table.views + k)] =
            numbers_about<Real>(views()[at(table.first + k)], place, h, table_columns_, table_rows_);
    });
    std::vector<cl_int4> wanted;
    for (std::size_t i = first * at(side); i < (first + n) * at(side); ++i) {
      const auto& [left, right, low, end] = page.wanted[i];
      wanted.push_back({{left, right, low, end}});
    }
    const opencl::DeviceArray<ViewNumbers<Real>> views(state_, std::span<const ViewNumbers<Real>>(numbers),
                                                       "views about blocks");
    const opencl::DeviceArray<cl_int4> ranges(state_, std::span<const cl_int4>(wanted), "wanted columns");
    shape.tiles = to_int(static_cast<std::int64_t>(n));
    // On a CPU neighbours in y, which read the same columns and rows, follow one another.
    kernel(opencl::in_groups(state_.info, {items[0], items[1], n}, {1, 1, 1}, 1), page.out->buffer(),
           table.values.buffer(), views.buffer(), ranges.buffer(), static_cast<cl_ulong>(first) * shape.tile,
           shape);
    opencl::finish(state_, "kept nodes");  // before the views' numbers go
  }
}

void ConeTiles::back_project(std::span<const ConePage> pages, const Progress& progress) {
  const std::int64_t views = scan_.geometry.views(), chunk = views_together_;
  const Blocks blocks(in_double_, lattice_.groups);
  table_seconds_ = 0;
  for (std::int64_t first = 0; first < views; first += chunk) {
    const auto start = std::chrono::steady_clock::now();
    const Table views_of_chunk = table(first, std::min(chunk, views - first));
    opencl::finish(state_, "dense views");
    table_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    VdvrConeNodes shape{};
    shape.plane = count(plane());
    shape.tile = count(side * side * lattice_.stride);
    shape.views = to_int(views_of_chunk.views);
    shape.column_stride = to_int(column_stride_);
    shape.last_column = to_int(table_columns_.count - 8);
    shape.last_row = to_int(column_stride_ - heights);
    shape.stride = to_int(lattice_.stride);
    shape.groups = to_int(lattice_.groups);
    shape.block_side = to_int(blocks.across);
    shape.block_groups = to_int(blocks.groups);
    shape.blocks_across = to_int(blocks.per_side);
    shape.blocks = to_int(blocks.count());
    for (std::size_t p = 0; p < pages.size(); ++p) {
      if (in_double_) launch<double>(views_of_chunk, pages[p], shape);
      else launch<float>(views_of_chunk, pages[p], shape);
      const double share = static_cast<double>(p + 1) / static_cast<double>(pages.size());
      report(progress, "gold",
             (static_cast<double>(first) + share * static_cast<double>(views_of_chunk.views)) /
                 static_cast<double>(views));
    }
  }
}

}  // namespace vdvr
