// Ramp filter (filter_rows.cpp) and upsampling: rows by dense cosine-series products (batched_product.cpp),
// columns alike or by transforms (upsample_columns.cpp).
#include "host/field/fbp/filter_projections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/base/opencl/fft.hpp"
#include "host/base/opencl/host_memory.hpp"
#include "host/base/system/huge_pages.hpp"
#include "host/base/system/parallel.hpp"
#include "host/field/fbp/batched_product.hpp"
#include "host/field/fbp/ramp_kernel.hpp"
#include "host/scan/geometry/view_weights.hpp"

namespace vdvr {
namespace {

// Products of more columns take longer than transforms; they are the less exact anyway. Cards may have few
// units of double precision.
constexpr std::int64_t fast_product_columns = 128, fast_product_columns_of_cards = 768;

// The detector row or column at which a position lies, mirrored about the outer edges; -1 where it lies
// between two. A position is taken for a whole one when it misses it by no more than its own rounding.
std::int64_t pixel_at(double position, std::int64_t n) {
  const double nearest = std::round(position);
  if (!(std::abs(position - nearest) <= 0x1p-50 * (std::abs(position) + static_cast<double>(n)))) return -1;
  const std::int64_t period = 2 * n, i = static_cast<std::int64_t>(nearest),
                     m = ((i % period) + period) % period;
  return m < n ? m : period - 1 - m;
}

// The pixels of all positions, or nothing unless all are whole: the series passes through its samples, so
// that no product is needed.
std::vector<std::int64_t> pixels_at(std::span<const double> positions, std::int64_t n, int order) {
  std::vector<std::int64_t> pixels;
  for (const double x : positions) {
    const std::int64_t pixel = order == 0 ? pixel_at(x, n) : -1;
    if (pixel < 0) return {};
    pixels.push_back(pixel);
  }
  return pixels;
}

std::vector<double> positions_of(const UpsampledColumns& columns) {
  std::vector<double> positions(static_cast<std::size_t>(columns.count));
  for (std::size_t j = 0; j < positions.size(); ++j)
    positions[j] = columns.position(static_cast<std::int64_t>(j));
  return positions;
}

// Whether the rows z0 .. z0 + 15 follow one another on the detector, as they do unless mirrored or skipped.
bool consecutive(std::span<const std::int64_t> rows, std::size_t z0) {
  if (rows.size() - z0 < 16) return false;
  for (std::size_t z = z0 + 1; z < z0 + 16; ++z)
    if (rows[z] != rows[z - 1] + 1) return false;
  return true;
}

// target[16] = the rows z0 .. z0 + 15 of one detector column; zero beyond the last.
void copy_rows(const float* column, std::span<const std::int64_t> rows, std::size_t z0, float* target) {
  for (std::size_t z = 0; z < 16; ++z) target[z] = z0 + z < rows.size() ? column[rows[z0 + z]] : 0.0f;
}

// What every view's error is bounded by, and the largest filtered samples; refuses what is not finite.
void measure_views(FilteredScan& out, std::span<const float> data, const ViewWeights& weights,
                   const RowFilter& filter) {
  const ParallelGeometry& g = out.geometry;
  const std::size_t per_view = static_cast<std::size_t>(g.rows * g.columns);
  std::vector<double> norms(static_cast<std::size_t>(g.views()));
  parallel_for(g.views(), {}, "", [&](std::int64_t view) {
    const std::size_t k = static_cast<std::size_t>(view);
    for (std::int64_t v = 0; v < g.rows; ++v) {
      double norm = 0;
      for (std::int64_t u = 0; u < g.columns; ++u) {
        const double p = data[k * per_view + static_cast<std::size_t>(v * g.columns + u)];
        norm += p * p;
      }
      if (!(std::sqrt(norm) <= norms[k])) norms[k] = std::sqrt(norm);  // NaN stays
      if (std::isnan(norm)) break;
    }
    for (std::size_t i = 0; i < per_view; ++i) {
      const double m = std::abs(static_cast<double>(out.samples[k * per_view + i]));
      if (!(m <= out.view_max[k])) out.view_max[k] = m;  // NaN stays
      if (std::isnan(m)) break;
    }
  });
  for (std::size_t k = 0; k < norms.size(); ++k) {
    if (!std::isfinite(out.view_max[k]) || !std::isfinite(norms[k]))
      throw not_finite(static_cast<std::int64_t>(k));
    out.ramp_error += filter.error(weights.weight[k], norms[k], out.view_max[k]) +
                      0x1p-126;  // the weighted sample may be flushed
  }
}

// The scan's geometry with the centre in use.
ParallelGeometry used_geometry(const ProjectionSet& scan, const FieldOptions& field, const Units& units) {
  require_parallel(scan, "filter_projections");
  ParallelGeometry geometry = from_world(scan.geometry, units);
  geometry.center = center_of(field, geometry);
  return geometry;
}

UpsampledSlab empty_slab(opencl::State& state, const UpsampledColumns& columns, std::size_t rows,
                         std::int64_t first_view, std::int64_t views) {
  UpsampledSlab slab;
  slab.columns = columns;
  slab.first_view = first_view;
  slab.views = views;
  slab.rows = static_cast<std::int64_t>(rows);
  slab.rows_padded = static_cast<std::int64_t>(opencl::round_up(rows, 16));
  slab.values = opencl::DeviceArray<float>(
      state, static_cast<std::uint64_t>(views * columns.count * slab.rows_padded), "upsampled projections");
  return slab;
}

}  // namespace

LineIntegrals::LineIntegrals(const ProjectionSet& scan, const Units& units) : scan_(&scan) {
  if (units.line == 0) return;
  scaled_ = scan.data;
  scale(scaled_, -units.line);
}

FilteredScan filter_projections(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                                const Progress& progress, FilterMethod method, Precision precision,
                                const Units& units) {
  FilteredScan out;
  out.geometry = used_geometry(scan, field, units);
  const ParallelGeometry& g = out.geometry;
  const ViewWeights weights = view_weights(g);

  out.fft_length = fft::good_length(2 * g.columns - 1);
  const auto filter = make_row_filter(state, g, ramp_kernel(field, g.pitch_u, g.columns), method, precision);
  const auto size = static_cast<std::size_t>(scan.size());
  out.samples = scan.data.scratch() ? SampleArray(size, scan.data.scratch(), "the filtered projections")
                                    : SampleArray(large_zeros(size));
  out.view_max.assign(static_cast<std::size_t>(g.views()), 0.0);
  const LineIntegrals line_integrals(scan, units);
  (*filter)(line_integrals.data(), weights.weight, out.samples, progress);
  measure_views(out, line_integrals.data(), weights, *filter);
  return out;
}

std::uint64_t slab_bytes(const DeviceInfo& device, const ParallelGeometry& geometry,
                         const UpsampledColumns& columns, std::int64_t rows) {
  const auto lanes = static_cast<std::uint64_t>(std::max(column_tuning(device).lanes, 16));
  return static_cast<std::uint64_t>(geometry.views() * columns.count) *
         opencl::round_up(static_cast<std::uint64_t>(rows), lanes) * sizeof(float);
}

DirectFilter::DirectFilter(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                           const Units& units)
    : state_(&state), data_(scan, units), geometry_(used_geometry(scan, field, units)) {
  weights_ = view_weights(geometry_).weight;
  filter_ = make_row_filter(state, geometry_, ramp_kernel(field, geometry_.pitch_u, geometry_.columns),
                            FilterMethod::automatic, Precision::fp32);
}

std::optional<UpsampledSlab> DirectFilter::operator()(const UpsampledColumns& columns,
                                                      std::span<const double> rows,
                                                      const Progress& progress) {
  const ParallelGeometry& g = geometry_;
  const auto v = pixels_at(rows, g.rows, 0);
  if (columns.rate != 1 || columns.first != 0 || columns.pad > g.columns || v.empty()) return std::nullopt;
  UpsampledSlab slab = empty_slab(*state_, columns, v.size(), 0, g.views());
  if (!filter_->to_device(data_.data(), weights_, {&slab.values, -columns.pad, columns.count, v}, progress))
    return std::nullopt;
  return slab;
}

WindowFilter::WindowFilter(opencl::State& state, const ProjectionSet& scan, const FieldOptions& field,
                           Precision precision, const Units& units)
    : state_(&state), scan_(&scan), field_(field), precision_(precision), units_(units) {}

// Rows first .. first + rows - 1 of all views, as a scan of their own.
ProjectionSet WindowFilter::window(std::int64_t first, std::int64_t rows) const {
  const ParallelGeometry& g = scan_->geometry;
  ProjectionSet out;
  out.geometry = g;
  out.geometry.rows = rows;
  out.data = SampleArray(large_zeros(static_cast<std::size_t>(out.size())));
  const std::int64_t run = rows * g.columns;
  parallel_for(g.views(), {}, "", [&](std::int64_t k) {
    std::copy_n(scan_->data.data() + (k * g.rows + first) * g.columns, run, out.data.data() + k * run);
  });
  return out;
}

std::optional<UpsampledSlab> WindowFilter::operator()(const UpsampledColumns& columns,
                                                      std::span<const double> rows,
                                                      const Progress& progress) {
  const auto v = pixels_at(rows, scan_->geometry.rows, 0);
  if (v.empty()) return std::nullopt;
  const auto [first, last] = std::minmax_element(v.begin(), v.end());
  const std::int64_t count = *last - *first + 1;
  std::vector<double> within;
  for (const std::int64_t pixel : v) within.push_back(static_cast<double>(pixel - *first));
  HostMemory host(*state_);
  host.count(2 * sizeof(float) *
                 static_cast<std::uint64_t>(scan_->geometry.views() * scan_->geometry.columns * count),
             fmt::format("{} rows of all projections", count));
  const ProjectionSet own = window(*first, count);
  const FilteredScan filtered =
      filter_projections(*state_, own, field_, progress, FilterMethod::automatic, precision_, units_);
  UpsampledSlab slab = Upsampler(*state_, filtered)(columns, within);
  state_->queue.finish();  // before what it reads goes
  return slab;
}

std::uint64_t Upsampler::slab_bytes(const UpsampledColumns& columns, std::int64_t rows) const {
  return vdvr::slab_bytes(state_->info, scan_->geometry, columns, rows);
}

const Upsampler::Matrix& Upsampler::matrix_u(const UpsampledColumns& columns, int order) {
  const std::tuple key{columns.rate, columns.pad, columns.count, order};
  if (const auto found = matrices_.find(key); found != matrices_.end()) return found->second;
  const std::vector<double> positions = positions_of(columns);
  const ParallelGeometry& g = scan_->geometry;
  const auto exact = resampling_matrix(g.columns, positions, order, g.pitch_u, columns.rate);
  const std::vector<float> rounded(exact.begin(), exact.end());
  Matrix m{opencl::DeviceArray<float>(*state_, std::span<const float>(rounded), "upsampling matrix"), 0};
  const auto width = static_cast<std::size_t>(g.columns);
  for (std::size_t j = 0; j < positions.size(); ++j) {
    double sum = 0;
    for (std::size_t i = 0; i < width; ++i) sum += std::abs(exact[j * width + i]);
    m.gain = std::max(m.gain, sum);
  }
  return matrices_.emplace(key, std::move(m)).first->second;
}

bool Upsampler::transforms(const UpsampledColumns& columns) const {
  const std::int64_t most =
      column_tuning(state_->info).lanes > 1 ? fast_product_columns : fast_product_columns_of_cards;
  const bool wanted = method_ == ColumnMethod::accurate || scan_->geometry.columns > most;
  return wanted && columns.rate % 2 == 0 && ColumnUpsampling::is_possible(*state_);
}

double Upsampler::gain_u() {
  if (gain_ == 0) gain_ = cosine_gain(scan_->geometry.columns);
  return gain_;
}

double Upsampler::gain_u(const UpsampledColumns& columns, int order) {
  return order == 0 ? gain_u() : matrix_u(columns, order).gain;
}

const opencl::DeviceArray<float>& Upsampler::row_matrix(std::span<const double> rows, int order,
                                                        int lattice) {
  if (rows_.values.size() > 0 && rows_.order == order && std::ranges::equal(rows_.rows, rows))
    return rows_.values;
  // v and z lie in the same order everywhere, so the transposed matrix is float [z / 16][v][16].
  const ParallelGeometry& g = scan_->geometry;
  const auto exact = resampling_matrix(g.rows, rows, order, g.pitch_v, lattice);
  const std::size_t height = static_cast<std::size_t>(g.rows);
  std::vector<float> transposed(height * opencl::round_up(rows.size(), 16), 0.0f);
  for (std::size_t z = 0; z < rows.size(); ++z)
    for (std::size_t v = 0; v < height; ++v)
      transposed[(z / 16 * height + v) * 16 + z % 16] = static_cast<float>(exact[z * height + v]);
  rows_ = {{rows.begin(), rows.end()},
           order,
           {*state_, std::span<const float>(transposed), "row resampling matrix"}};
  return rows_.values;
}

void Upsampler::copy(opencl::DeviceArray<float>& values, std::int64_t first_view, std::int64_t views,
                     std::span<const std::int64_t> u, std::span<const std::int64_t> v) {
  const ParallelGeometry& g = scan_->geometry;
  const std::size_t chunks = opencl::round_up(v.size(), 16) / 16;
  values.write_mapped([&](std::span<float> mapped) {
    parallel_for(views, {}, "", [&](std::int64_t k) {
      const float* view = scan_->samples.data() + (first_view + k) * g.columns * g.rows;
      for (std::size_t c = 0; c < chunks; ++c) {
        const bool straight = consecutive(v, 16 * c);
        float* target = mapped.data() +
                        (c * static_cast<std::size_t>(views) + static_cast<std::size_t>(k)) * u.size() * 16;
        for (std::size_t n = 0; n < u.size(); ++n, target += 16) {
          const float* column = view + u[n] * g.rows;
          if (straight) std::copy_n(column + v[16 * c], 16, target);
          else copy_rows(column, v, 16 * c, target);
        }
      }
    });
  });
}

void Upsampler::resample_rows(opencl::DeviceArray<float>& values, std::int64_t first_view, std::int64_t views,
                              std::span<const double> rows, int order, int lattice) {
  const ParallelGeometry& g = scan_->geometry;
  if (const auto v = pixels_at(rows, g.rows, order); !v.empty()) {
    std::vector<std::int64_t> u(static_cast<std::size_t>(g.columns));
    std::iota(u.begin(), u.end(), 0);
    copy(values, first_view, views, u, v);
    return;
  }
  const std::int64_t per_view = g.columns * g.rows;
  const opencl::DeviceArray<float> filtered(*state_,
                                            std::span<const float>(scan_->samples)
                                                .subspan(static_cast<std::size_t>(first_view * per_view),
                                                         static_cast<std::size_t>(views * per_view)),
                                            "filtered chunk");
  batched_product(*state_, values, filtered, row_matrix(rows, order, lattice),
                  {.rows = views * g.columns,
                   .terms = g.rows,
                   .z_padded = static_cast<std::int64_t>(opencl::round_up(rows.size(), 16)),
                   .run = row_run,
                   .out_chunk = static_cast<std::uint64_t>(views * g.columns * 16),
                   .v_chunk = static_cast<std::uint64_t>(g.rows * 16)});
}

UpsampledSlab Upsampler::operator()(const UpsampledColumns& columns, std::span<const double> rows,
                                    int order_u, int order_v, int row_lattice, std::int64_t first_view,
                                    std::int64_t views) {
  const ParallelGeometry& g = scan_->geometry;
  if (views < 0) views = g.views() - first_view;
  UpsampledSlab slab = empty_slab(*state_, columns, rows.size(), first_view, views);
  const auto count = [](std::int64_t n) { return static_cast<std::uint64_t>(n); };
  const auto u = pixels_at(positions_of(columns), g.columns, order_u), v = pixels_at(rows, g.rows, order_v);
  if (!u.empty() && !v.empty()) {
    copy(slab.values, first_view, views, u, v);
    return slab;
  }

  const std::int64_t per_view = g.columns * (g.rows + slab.rows_padded) * 4;
  const std::int64_t chunk = std::clamp<std::int64_t>((std::int64_t{32} << 20) / per_view, 1, views);
  opencl::DeviceArray<float> resampled;
  for (std::int64_t first = 0; first < views; first += chunk) {
    const std::int64_t n = std::min(chunk, views - first);
    // Of these views to the element: what is written is written whole.
    if (resampled.size() != count(n * g.columns * slab.rows_padded))
      resampled =
          opencl::DeviceArray<float>(*state_, count(n * g.columns * slab.rows_padded), "rows of a slab");
    resample_rows(resampled, first_view + first, n, rows, order_v, row_lattice);
    const VdvrChunks in{0, count(g.columns * 16), count(n * g.columns * 16)},
        out{count(first * columns.count * 16), count(columns.count * 16), count(views * columns.count * 16)};
    if (order_u == 0 && transforms(columns)) {
      const auto [of_rate, fresh] = transforms_.try_emplace(columns.rate, *state_, g.columns, columns.rate);
      of_rate->second(slab.values, out, resampled, in, columns, n, slab.rows_padded / 16);
      continue;
    }
    batched_product(*state_, slab.values, matrix_u(columns, order_u).values, resampled,
                    {.rows = columns.count,
                     .terms = g.columns,
                     .z_padded = slab.rows_padded,
                     .batches = n,
                     .run = run(),
                     .out_first = out.first,
                     .out_batch = out.batch,
                     .out_chunk = out.chunk,
                     .v_batch = in.batch,
                     .v_chunk = in.chunk});
  }
  return slab;
}

}  // namespace vdvr
