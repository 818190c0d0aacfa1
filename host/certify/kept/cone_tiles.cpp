#include "host/certify/kept/cone_tiles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <ranges>
#include <tuple>

#include "host/base/opencl/work_groups.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/certify/bounds/node_functional.hpp"
#include "host/certify/bounds/column_taps.hpp"
#include "host/field/fbp/back_project.hpp"
#include "host/field/fdk/region_parts.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

static_assert(sizeof(VdvrConeNodes) == 64);

namespace {

using std::numbers::pi;
// Values of a table to a pixel, both ways: what eight taps are made for.
constexpr int density = 6;
// Rows from which on tables are made by transforms along v.
constexpr std::int64_t fewest_rows = 16;
constexpr std::uint64_t most_table_bytes = std::uint64_t{512} << 20,
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
                                const UpsampledColumns& columns, const UpsampledColumns& rows) {
  const Vec3 seen = projected(m, middle);
  const double u = columns.column_of(seen[0]), v = rows.column_of(seen[1]);
  ViewNumbers<Real> out{};
  for (std::size_t a = 0; a < 3; ++a) {
    out.step_u[a] = static_cast<Real>((m[0][a] - seen[0] * m[2][a]) * spacing[a] * density);
    out.step_v[a] = static_cast<Real>((m[1][a] - seen[1] * m[2][a]) * spacing[a] * density);
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

// Columns and rows of the table that a node's place may lie from that of its block's middle, half a block
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
  const double more = density * (1 + growth / middle) / seen.lambda_min;
  return {u * more, v * more};
}

// A position is about x, y and z of the middle; nothing that would vary along z is left of u and lambda.
bool is_upright(const ViewMatrix& m) { return m[0][2] == 0 && m[2][2] == 0; }

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
  upright_ = std::all_of(scan.views.begin(), scan.views.end(), is_upright);
  in_runs_ = upright_ && in_double_ && opencl::lanes_of(state.info, to_int(heights)) > 1;
  look_at_views(coverage);
  if (DenseValues::suit(state, scan.geometry, fewest_rows))
    dense_.emplace(state, upsampler, scan, columns_, rows_);
  column_stride_ = column_stride(rows_.count + heights);
  views_together_ = views_together();
}

// Places, frequencies and weights of all views, part by part of the region.
void ConeTiles::look_at_views(const Coverage& coverage) {
  const ParallelGeometry& g = scan_.geometry;
  const Blocks blocks(in_double_, lattice_.groups);
  const Vec3 half{0.5 * static_cast<double>(blocks.across) * lattice_.spacing[0],
                  0.5 * static_cast<double>(blocks.across) * lattice_.spacing[1],
                  0.5 * static_cast<double>(blocks.groups * heights) * lattice_.spacing[2]};
  struct Seen {
    double beyond_u = 0, beyond_v = 0, row_step = 0, reach = 0, weight = 0, sum = 0;
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
      const auto [places_u, places_v] = places_from_middle(seen, half);
      out.row_step =
          std::max(out.row_step, density * lattice_.spacing[2] * seen.along_v[2] / seen.lambda_min);
      out.reach = std::max({out.reach, places_u, places_v});
      out.weight = std::max(out.weight, weight);
      out.sum += weight * sups_.by_view[k].value;
    }
  });
  double beyond_u = 0, beyond_v = 0;
  for (const Seen& seen : of_parts) {
    if (seen.too_close) throw source_too_close(*seen.too_close);
    beyond_u = std::max(beyond_u, seen.beyond_u);
    beyond_v = std::max(beyond_v, seen.beyond_v);
    row_step_ = std::max(row_step_, seen.row_step);
    block_reach_ = std::max(block_reach_, seen.reach);
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
  columns_ = upsampled_columns(g.columns, density, std::ceil(beyond_u) + 1);
  rows_ = upsampled_columns(g.rows, density, std::ceil(beyond_v) + 1);
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
std::int64_t ConeTiles::views_together() const {
  const std::uint64_t table = sizeof(float) * count(columns_.count * column_stride_),
                      each = table + (dense_ ? dense_->bytes(1) : table),
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
  Table out{opencl::DeviceArray<float>(state_, count(views * columns_.count * column_stride_), "dense views"),
            first, views};
  if (dense_) {
    const opencl::DeviceArray<float>& values = (*dense_)(first, views);
    opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int> join(
        state_, "certify/kept/join_columns", "join_columns");
    join({{count(column_stride_), count(columns_.count), count(views)}, {16, 1, 1}}, out.values.buffer(),
         values.buffer(), to_int(views), to_int(columns_.count), to_int(rows_.count), to_int(column_stride_));
    return out;
  }
  std::vector<double> rows;
  for (std::int64_t r = 0; r < rows_.count; ++r) rows.push_back(rows_.position(r));
  const UpsampledSlab slab = upsampler_(columns_, rows, 0, 0, density, first, views);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> join(state_, "certify/kept/join_rows",
                                                                      "join_kept_rows");
  const std::int64_t lines = views * columns_.count;
  join({{count(column_stride_), count(lines), 1}, {16, 1, 1}}, out.values.buffer(), slab.values.buffer(),
       to_int(lines), to_int(rows_.count), to_int(column_stride_));
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
          {{"VDVR_DOUBLE", in_double_ ? "1" : "0"},
           {"VDVR_UPRIGHT", upright_ ? "1" : "0"},
           {"VDVR_LANES", std::to_string(lanes)}}};
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
            numbers_about<Real>(scan_.views[at(table.first + k)], place, h, columns_, rows_);
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
    shape.plane = count(columns_.count * column_stride_);
    shape.tile = count(side * side * lattice_.stride);
    shape.views = to_int(views_of_chunk.views);
    shape.column_stride = to_int(column_stride_);
    shape.last_column = to_int(columns_.count - 8);
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

// --- bounds ---

double ConeTiles::roundings_of_sum(std::int64_t views, std::int64_t together) {
  const std::int64_t at_once = std::min<std::int64_t>(together, VDVR_CONE_VIEWS),
                     sums = (together + at_once - 1) / at_once, tables = (views + together - 1) / together;
  return static_cast<double>(at_once + sums + tables);
}

ConeTiles::Errors ConeTiles::errors(std::int64_t together, Fp64 fp64, Interpolation of) {
  const ParallelGeometry& g = scan_.geometry;
  const bool eight = of == Interpolation::eight_taps;
  const ColumnTaps& taps = eight ? eight_tap_facts() : six_tap_facts();
  const double rate = eight ? density : 8, finer = rate / density;  // columns and rows to a pixel
  const double square = taps.norm * taps.norm, views = static_cast<double>(g.views());
  Errors out;
  // I_u I_v - 1 = (I_u - 1) + I_u (I_v - 1).
  out.interpolation = taps.sup * (1 + taps.norm) * sup_;
  const bool here = fp64 == Fp64::as_here, in_double = here ? in_double_ : fp64 == Fp64::present,
             dense = here ? dense_.has_value() : in_double && g.rows >= fewest_rows;
  double entries = 0;
  if (dense) entries = dense_rounding(upsampler_, scan_, columns_, rows_, sup_, sup_, fp64);
  else {
    const double gain = upsampler_.gain_u(), largest = lebesgue_constant(g.rows) * sup_;
    entries = unit_roundoff * (product_error(g.rows, row_run) + 2) * gain * largest +
              column_error(upsampler_, g.columns, columns_, largest, gain * largest, fp64);
  }
  // Places: numerator, lambda, quotient and sum; relative to what they move the values by, pi / 6 a column.
  // Blocks are this device's: in double precision they do not matter, and those of single are smaller.
  const double unit = in_double ? 0x1p-53 : unit_roundoff;
  // Of a run of heights, places of eight are floats about their middle: a step three and a half times, what
  // they add up to, and the fractions of the middle and of each.
  const double apart = in_double ? unit_roundoff * (7 * finer * row_step_ + 3) : 0.0;
  const double position = (2 * unit * (16 * finer * block_reach_ + 4) + apart) * pi / rate * sup_;
  // Twice four products along u and what they add up to, one along v, their sum over views, eight lanes;
  // lambda^-2, which a float place makes err more.
  const double roundings = 5 + 1 + 3 + roundings_of_sum(g.views(), together) + (in_double ? 3 : 24);
  out.rounding = square * entries + position + 2 * taps.norm * taps.rounding * sup_ +
                 1.01 * unit_roundoff * roundings * square * sup_ +
                 views * largest_weight_ * (2 * product_underflow(g, upsampler_.gain_u()) + 16 * 0x1p-126);
  return out;
}

// By its weights: the best filter is asked for again by those who keep it.
ConeTiles::Known& ConeTiles::known(std::size_t axis, const GoldFilter& filter) {
  const std::tuple key{axis == 2, filter.rate, filter.weights};
  if (const auto found = filters_.find(key); found != filters_.end()) return found->second;
  Known now{{filter, highest(axis), bands_seen_[axis == 2 ? 1 : 0], most_moments}, {}};
  return filters_.emplace(key, std::move(now)).first->second;
}

double ConeTiles::largest(std::size_t axis, const GoldFilter& filter) {
  Known& of_filter = known(axis, filter);
  std::optional<double>& found = of_filter.largest[axis];
  if (!found) found = largest_of_errors(at_parts_[axis], of_filter.error);
  return *found;
}

// At most what a filter errs along an axis: of some parts, as if no view grew, without views that
// see less than `fewest` radians a node.
double ConeTiles::least_of(std::size_t axis, const ProjectiveError& error, double fewest) const {
  constexpr std::size_t some = 8;
  double largest = 0;
  for (const auto& part : at_parts_[axis] | std::views::take(some)) {
    double sum = 0;
    for (const ViewAtPart& view : part)
      if (view.band >= fewest) sum += view.weight * error.at(view.band, 0);
    largest = std::max(largest, sum);
  }
  return largest;
}

// Designed for the band with which it errs least, most views being below the highest.
ConeTiles::BestFilter ConeTiles::best_filter(int phases, std::size_t axis, int taps, double most) {
  BestFilter best{std::nullopt, HUGE_VAL};
  if (highest(axis) > highest_gold_band) return best;
  if (phases == 1) return {design_gold_filter(1, highest(axis), taps), 0};
  const std::tuple key{axis == 2, phases, taps};
  if (const auto found = best_.find(key); found != best_.end()) return found->second;
  const auto along = [&](const auto& of_axis) {
    return axis == 2 ? of_axis(2) : std::max(of_axis(0), of_axis(1));
  };
  // What they err at least orders them: it takes a twentieth of the whole, which few then need.
  struct Proposal {
    double least = 0;
    std::size_t number = 0;
    GoldFilter filter;
    bool operator<(const Proposal& other) const {
      return std::tie(least, number) < std::tie(other.least, other.number);
    }
  };
  constexpr std::array shares{0.8, 0.85, 0.9, 0.95, 1.0};
  std::vector<Proposal> proposals(shares.size());
  // What is lower errs little.
  const double fewest = 0.7 * highest(axis);
  std::vector<double> bands = bands_seen_[axis == 2 ? 1 : 0];
  std::erase_if(bands, [&](double band) {
    return ProjectiveError::place_of(band, highest(axis)) < ProjectiveError::place_of(fewest, highest(axis));
  });
  parallel_for(std::ssize(shares), {}, "", [&](std::int64_t i) {
    GoldFilter filter = design_gold_filter(phases, shares[at(i)] * highest(axis), taps);
    const ProjectiveError of_parallel(filter, highest(axis), bands, 1);
    const double least = along([&](std::size_t a) { return least_of(a, of_parallel, fewest); });
    proposals[at(i)] = {least, at(i), std::move(filter)};
  });
  std::ranges::sort(proposals, std::less<>{});
  for (Proposal& proposal : proposals) {
    if (proposal.least > std::min(best.error, most)) break;
    const double errs = along([&](std::size_t a) { return largest(a, proposal.filter); });
    if (!(errs < best.error)) continue;
    best = {std::move(proposal.filter), errs};
  }
  if (best.error <= most) best_.emplace(key, best);  // others may err less that were not looked at
  return best;
}

// I_x I_y I_z - 1 = (I_x - 1) + I_x (I_y - 1) + I_x I_y (I_z - 1).
double ConeTiles::filter_error(const GoldFilter& x, const GoldFilter& y, const GoldFilter& z) {
  return largest(0, x) + x.norm * (largest(1, y) + y.norm * largest(2, z));
}

}  // namespace vdvr
