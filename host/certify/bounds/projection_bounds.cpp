// Bounds in closed form, from sups over the detector, for which kernels/certify/bounds/projection_bounds.cl
// is launched (docs/error-bounds.md).
#include "host/certify/bounds/projection_bounds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <numbers>
#include <optional>

#include "host/base/opencl/column_tuning.hpp"
#include "host/base/opencl/kernel.hpp"
#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/certify/bounds/column_taps.hpp"
#include "host/certify/bounds/dense_rounding.hpp"
#include "host/certify/bounds/node_functional.hpp"
#include "host/field/fbp/dense_values.hpp"
#include "host/field/fdk/region_parts.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;
constexpr double smallest_normal = 0x1p-126;

}  // namespace

double product_underflow(const ParallelGeometry& g, double gain_u) {
  return 4 * (static_cast<double>(g.rows) * gain_u + static_cast<double>(g.columns)) * smallest_normal;
}

namespace {

// No bound can be made of a sup that is no finite number.
void require_finite(const std::vector<float>& sups, int order) {
  if (std::all_of(sups.begin(), sups.end(), [](float s) { return std::isfinite(s); })) return;
  throw InputError(fmt::format(
      "the {} of the filtered projections is not finite in float32; check the scan's values and pitches",
      order == 0 ? "value" : "2nd derivative"));
}

using RowSup = opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int>;

// The largest |d| of every view of a slab: float d[row / 16][view][column][16].
std::vector<double> view_sups(opencl::State& state, const opencl::DeviceArray<float>& d, std::int64_t views,
                              std::int64_t columns, std::int64_t rows, int order) {
  const auto padded = static_cast<std::int64_t>(opencl::round_up(count(rows), 16));
  const auto lanes = static_cast<std::uint64_t>(column_tuning(state.info).lanes);
  RowSup row_sup(state, "certify/bounds/projection_bounds", "row_sup",
                 {{"VDVR_LANES", std::to_string(lanes)}});
  opencl::DeviceArray<float> sup(state, count(views * padded), "row maxima");
  row_sup({{count(padded) / lanes, count(views), 1}, {16 / lanes, 1, 1}}, sup.buffer(), d.buffer(),
          to_int(views), to_int(columns), to_int(padded));
  const auto host = sup.to_host();
  require_finite(host, order);
  std::vector<double> out(at(views));
  for (std::int64_t k = 0; k < views; ++k)
    for (std::int64_t z = 0; z < rows; ++z)
      out[at(k)] = std::max(out[at(k)], static_cast<double>(host[at(k * padded + z)]));
  return out;
}

// A term is rounded within its run, the sum at its end, and the m roundings that were kept are summed with m
// u of themselves. In units of u.
double compensated_runs(double runs, double roundings) {
  const double m = std::ceil(runs);
  return roundings + 2 + 1.01 * m * m * unit_roundoff;
}

std::vector<double> view_sups(opencl::State& state, const UpsampledSlab& d, int order) {
  return view_sups(state, d.values, d.views, d.columns.count, d.rows, order);
}

}  // namespace

double product_error(std::int64_t n, int run) { return compensated_runs(static_cast<double>(n) / run, run); }

double lebesgue_constant(std::int64_t n) {
  // Trigonometric interpolation in 2n points: below (2/pi) ln(2n) + 1.5 for every n (Rivlin, Chebyshev
  // Polynomials, section 1.4).
  return 2 / pi * std::log(2.0 * static_cast<double>(n)) + 1.5;
}

namespace {

// What the taps between half columns err and grow, at their places 1 / phases, 2 / phases .. .
struct HalfColumnTaps {
  double norm = 1;  // largest sum of magnitudes
  double sup = 0;   // |interpolant - q| <= sup times the largest |q|, for every row q
};

HalfColumnTaps facts_of_taps(int phases) {
  HalfColumnTaps out;
  for (int p = 1; 2 * p <= phases; ++p) {  // the others mirror these
    const double place = static_cast<double>(p) / phases;
    const std::vector<double> taps = taps_between_half_columns(place);
    double norm = 0;
    for (const double t : taps) norm += std::abs(t);
    out.norm = std::max(out.norm, norm);
    out.sup = std::max(out.sup, sup_constant({taps, 1 - half_column_taps / 2 - place, 0}, pi / 2));
  }
  return out;
}

const HalfColumnTaps& half_column_facts(int phases) {
  static std::mutex guard;
  static std::map<int, HalfColumnTaps> known;
  const std::scoped_lock lock(guard);
  if (const auto found = known.find(phases); found != known.end()) return found->second;
  return known.emplace(phases, facts_of_taps(phases)).first->second;
}

}  // namespace

double transform_error(std::int64_t n, int rate, double largest, double sup) {
  const HalfColumnTaps& taps = half_column_facts(rate / 2);
  // Rounded once; before that in double precision, 32 products of the taps' magnitudes among them.
  const double half = half_column_error(n) * std::sqrt(static_cast<double>(n));
  return unit_roundoff * 1.001 * sup + (taps.sup + 0x1p-46) * sup + taps.norm * half * largest;
}

double column_error(Upsampler& upsampler, std::int64_t detector_columns, const UpsampledColumns& columns,
                    double largest, double sup, Fp64 fp64) {
  const bool transforms =
      fp64 == Fp64::as_here ? upsampler.transforms(columns) : fp64 == Fp64::present && columns.rate % 2 == 0;
  if (!transforms)
    return unit_roundoff * (product_error(detector_columns, upsampler.run()) + 2) * upsampler.gain_u() *
           largest;
  return transform_error(detector_columns, columns.rate, largest, sup);
}

namespace {

// fp32 error of an upsampled derivative along u of views whose samples do not exceed `view_max`, summed: the
// samples' own error and two products, each relative to the matrices' gain. Along v, (pi / pitch_v)^order
// more.
double derivative_rounding(Upsampler& upsampler, const FilteredScan& scan, const UpsampledColumns& columns,
                           int order, double view_max, double views) {
  const ParallelGeometry& g = scan.geometry;
  const double gain = upsampler.gain_u(columns, order), row_max = lebesgue_constant(g.rows) * view_max;
  const double of_columns =
      order == 0 ? column_error(upsampler, g.columns, columns, row_max, gain * row_max)
                 : unit_roundoff * (product_error(g.columns, upsampler.run()) + 2) * gain * row_max;
  return unit_roundoff * (product_error(g.rows, row_run) + 2) * gain * row_max + of_columns +
         views * product_underflow(g, gain);
}

// Views per chunk so that slabs of derivatives stay near 64 MiB, and what is made on the way beside them
// within what is left.
std::int64_t view_chunk(const opencl::State& state, const FilteredScan& scan, std::int64_t columns,
                        std::int64_t rows) {
  const std::int64_t per_view = columns * (rows + 16) * 4;
  const auto budget = static_cast<std::int64_t>(std::min(std::uint64_t{64} << 20, state.memory.left() / 6));
  return std::clamp<std::int64_t>(budget / per_view, 1, scan.geometry.views());
}

// Where sups are sampled. A signal sampled L times denser than Nyquist rises above its samples by at most
// 1 / cos(pi / (2 L)), per axis (Ehlich and Zeller 1964). A single row does not vary along v.
struct DenseGrid {
  static constexpr int density = 4;
  explicit DenseGrid(const FilteredScan& scan)
      : columns(upsampled_columns(scan.geometry.columns, density, 0)) {
    const std::int64_t V = scan.geometry.rows;
    for (std::int64_t j = 0; j <= density * V; ++j) rows.push_back(-0.5 + static_cast<double>(j) / density);
    const double of_axis = 1 / std::cos(pi / (2.0 * density));
    rise = V > 1 ? of_axis * of_axis : of_axis;
  }
  UpsampledColumns columns;
  std::vector<double> rows;
  double rise = 1;
};

// Rows from which on transforms along v are faster than a product, which takes rows squared.
constexpr std::int64_t fewest_dense_rows = 96;

// The largest |q| of each view: columns of the chunks are the dense rows.
std::vector<double> dense_sups(opencl::State& state, DenseValues& dense, std::int64_t first,
                               std::int64_t views) {
  return view_sups(state, dense(first, views), views, dense.rows().count, dense.columns().count, 0);
}

// Sup |q| view by view: of every `step`-th, the others are 0.
class ValuesByView {
 public:
  ValuesByView(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan, const DenseGrid& grid)
      : state_(state), upsampler_(upsampler), scan_(scan), grid_(grid) {
    const ParallelGeometry& g = scan.geometry;
    if (DenseValues::suit(state, g, fewest_dense_rows))
      dense_.emplace(state, upsampler, scan, grid.columns, upsampled_columns(g.rows, DenseGrid::density, 0));
  }
  /// Without rounding.
  std::vector<double> operator()(std::int64_t first, std::int64_t n) {
    std::vector<double> sups =
        dense_
            ? dense_sups(state_, *dense_, first, n)
            : view_sups(state_, upsampler_(grid_.columns, grid_.rows, 0, 0, DenseGrid::density, first, n), 0);
    for (double& s : sups) s *= grid_.rise;
    return sups;
  }
  /// Of views whose samples sum up to `samples`.
  [[nodiscard]] double rounding(double samples, double views) {
    return dense_ ? grid_.rise * dense_rounding(upsampler_, scan_, dense_->columns(), dense_->rows(), samples,
                                                upsampler_.gain_u() * samples)
                  : derivative_rounding(upsampler_, scan_, grid_.columns, 0, samples, views);
  }

 private:
  opencl::State& state_;
  Upsampler& upsampler_;
  const FilteredScan& scan_;
  const DenseGrid& grid_;
  std::optional<DenseValues> dense_;
};

double sum_of_samples(const FilteredScan& scan) {
  double samples = 0;
  for (const double m : scan.view_max) samples += m;
  return samples;
}

}  // namespace

FieldSups value_sups(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan) {
  const ParallelGeometry& g = scan.geometry;
  const DenseGrid grid(scan);
  ValuesByView values(state, upsampler, scan, grid);
  const std::int64_t chunk =
      view_chunk(state, scan, grid.columns.count, static_cast<std::int64_t>(grid.rows.size()));
  double sum = 0;
  for (std::int64_t first = 0; first < g.views(); first += chunk)
    for (const double m : values(first, std::min(chunk, g.views() - first))) sum += m;
  FieldSups sups;
  sups.value = sum + values.rounding(sum_of_samples(scan), static_cast<double>(g.views()));
  sups.second_u = std::pow(pi / g.pitch_u, 2) * sups.value;
  if (g.rows > 1) sups.second_v = std::pow(pi / g.pitch_v, 2) * sups.value;
  return sups;
}

namespace {

// Calls with each run of views to look at: all, or every step-th one by one.
void for_views(std::int64_t views, std::int64_t together, std::int64_t step,
               const std::function<void(std::int64_t, std::int64_t)>& look) {
  const std::int64_t n = step == 1 ? together : 1;
  for (std::int64_t first = 0; first < views; first += step == 1 ? n : step)
    look(first, std::min(n, views - first));
}

}  // namespace

double share_of_views(std::int64_t views, std::int64_t step) {
  return static_cast<double>(views) / static_cast<double>((views + step - 1) / step);
}

double cost_of_sups(const ParallelGeometry& g) {
  constexpr double dense = DenseGrid::density * DenseGrid::density;
  return 3 * dense * static_cast<double>(g.views() * g.rows * g.columns) *
         static_cast<double>(g.rows + g.columns);
}

FieldSups field_sups(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                     std::int64_t step) {
  const ParallelGeometry& g = scan.geometry;
  const DenseGrid grid(scan);
  constexpr int dense = DenseGrid::density;
  const UpsampledColumns& columns = grid.columns;
  const std::vector<double>& rows = grid.rows;

  FieldSups sups;
  const auto sups_of = [&](int order_u, int order_v, std::int64_t first, std::int64_t n) {
    double sum = 0;
    for (const double m : view_sups(state, upsampler(columns, rows, order_u, order_v, dense, first, n),
                                    std::max(order_u, order_v)))
      sum += m;
    return grid.rise * sum;
  };
  const std::int64_t chunk = view_chunk(state, scan, columns.count, static_cast<std::int64_t>(rows.size()));
  for_views(g.views(), chunk, step, [&](std::int64_t first, std::int64_t n) {
    sups.value += sups_of(0, 0, first, n);
    sups.second_u += sups_of(2, 0, first, n);
    if (g.rows == 1) return;  // a single row does not vary along v
    sups.second_v += sups_of(0, 2, first, n);
  });
  const double share = share_of_views(g.views(), step);
  for (double* sum : {&sups.value, &sups.second_u, &sups.second_v}) *sum *= share;
  // Rounding of the evaluation, relative to the sums of magnitudes it adds up.
  double samples = 0;
  for (const double m : scan.view_max) samples += m;
  const double views = static_cast<double>(g.views());
  const double value = derivative_rounding(upsampler, scan, columns, 0, samples, views);
  sups.value += value;
  sups.second_u += derivative_rounding(upsampler, scan, columns, 2, samples, views);
  // The second derivative along v multiplies by at most (pi / pitch_v)^2 (Bernstein).
  if (g.rows > 1) sups.second_v += value * std::pow(pi / g.pitch_v, 2);
  return sups;
}

namespace {

// The largest sum of lambda^-2 times the values on the covered region.
double largest_sum(const FilteredScan& scan, const std::vector<double>& values) {
  const Coverage coverage(scan.geometry, scan.views);
  double largest = 0;
  for (const Corners& part : RegionOutline(coverage, 0).parts(coverage.heights()))
    largest = std::max(largest, sum_of_weights(scan.views, values, part, 2));
  return largest;
}

// Whether fourth derivatives are worth their sups, which cost as much again as those of second ones: bounds
// of sixth derivatives grow with lambda^-8.
bool looks_closely(const FilteredScan& scan) {
  constexpr double near = 0.8;
  const Coverage coverage(scan.geometry, scan.views);
  double least = HUGE_VAL;
  std::vector<ViewBox> boxes(scan.views.size());
  for (const Corners& part : RegionOutline(coverage, 0).parts(coverage.heights())) {
    view_boxes(scan.views, part, boxes);
    for (const ViewBox& seen : boxes) least = std::min(least, seen.lambda_min);
  }
  return least < near;
}

}  // namespace

FieldSups cone_sups(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan, std::int64_t step) {
  const ParallelGeometry& g = scan.geometry;
  const DenseGrid grid(scan);
  ValuesByView values(state, upsampler, scan, grid);
  const double square_u = g.pitch_u * g.pitch_u, square_v = g.pitch_v * g.pitch_v;
  FieldSups sups;
  sups.by_view.resize(at(g.views()));
  const std::int64_t chunk =
      view_chunk(state, scan, grid.columns.count, static_cast<std::int64_t>(grid.rows.size()));
  const bool fourth = looks_closely(scan);
  // Of samples, per pixel; a derivative along v multiplies rounding by at most pi / pitch_v (Bernstein).
  const auto sup = [&](double sampled, int order_u, int order_v, double most) {
    return std::pow(g.pitch_u, order_u) *
           (std::pow(g.pitch_v, order_v) * grid.rise * sampled +
            std::pow(pi, order_v) * derivative_rounding(upsampler, scan, grid.columns, order_u, most, 1));
  };
  for_views(g.views(), chunk, step, [&](std::int64_t first, std::int64_t n) {
    const auto derivative = [&](int order_u, int order_v) {
      return view_sups(state,
                       upsampler(grid.columns, grid.rows, order_u, order_v, DenseGrid::density, first, n), 2);
    };
    const std::vector<double> value = values(first, n), along_u = derivative(2, 0),
                              along_v = g.rows > 1 ? derivative(0, 2) : std::vector<double>(at(n), 0.0);
    for (std::int64_t i = 0; i < n; ++i) {
      DetectorSups& view = sups.by_view[at(first + i)];
      const double most = scan.view_max[at(first + i)];
      view.value = value[at(i)] + values.rounding(most, 1);
      view.second_u = sup(along_u[at(i)], 2, 0, most);
      if (g.rows > 1) view.second_v = sup(along_v[at(i)], 0, 2, most);
    }
    if (!fourth) return;
    const std::vector<double> fourth_u = derivative(4, 0);
    for (std::int64_t i = 0; i < n; ++i)
      sups.by_view[at(first + i)].fourth_u = sup(fourth_u[at(i)], 4, 0, scan.view_max[at(first + i)]);
    if (g.rows == 1) return;
    const std::vector<double> second_uv = derivative(2, 2), fourth_v = derivative(0, 4);
    for (std::int64_t i = 0; i < n; ++i) {
      DetectorSups& view = sups.by_view[at(first + i)];
      view.second_uv = sup(second_uv[at(i)], 2, 2, scan.view_max[at(first + i)]);
      view.fourth_v = sup(fourth_v[at(i)], 0, 4, scan.view_max[at(first + i)]);
    }
  });
  // An estimate takes the views between for those that were looked at.
  for (std::int64_t k = 0; k < g.views(); ++k) sups.by_view[at(k)] = sups.by_view[at(k - k % step)];
  const auto sum = [&](auto member) {
    std::vector<double> of_views;
    for (const DetectorSups& view : sups.by_view) of_views.push_back(view.*member);
    return largest_sum(scan, of_views);
  };
  sups.value = sum(&DetectorSups::value);
  sups.second_u = sum(&DetectorSups::second_u) / square_u;
  sups.second_v = sum(&DetectorSups::second_v) / square_v;
  return sups;
}

double filter_error_bound(Upsampler& upsampler, const FilteredScan& scan) {
  return scan.ramp_error * upsampler.gain_u() * lebesgue_constant(scan.geometry.rows);
}

namespace {

// What interpolation between columns multiplies and adds.
struct ColumnWeights {
  double taps = 2;       // of a sample
  double gain = 1;       // largest sum of magnitudes
  double slope = 1;      // of the interpolant's slope, of the largest difference quotient of columns
  double slope_sum = 0;  // and of the largest column
  double rounding = 0;   // of the weights, beyond eight roundings of their sum
};

ColumnWeights weights_of(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::linear:
      return {2, 1, 1, 0, 0};
    case Interpolation::cubic:
      return {4, 1.25, 4.0 / 3, 0, 0};
    case Interpolation::six_taps:
      break;
    case Interpolation::eight_taps:
      throw std::logic_error("columns of parallel beam have no eight taps");
  }
  const ColumnTaps& six = six_tap_facts();
  return {6, six.norm, six.slope, six.slope_sum, six.rounding};
}

double interpolation_error(const ParallelGeometry& g, const FieldSups& sups, int rate,
                           Interpolation interpolation) {
  const double step = g.pitch_u / rate;
  if (interpolation == Interpolation::linear) return step * step / 8 * sups.second_u;
  if (interpolation == Interpolation::cubic)
    return 3.0 / 128 * std::pow(step, 4) * std::pow(pi / g.pitch_u, 2) * sups.second_u;
  return rate >= 8 ? six_tap_facts().sup * sups.value : std::numeric_limits<double>::infinity();
}

}  // namespace

ChainErrors chain_errors(Upsampler& upsampler, const FilteredScan& scan, const FieldSups& sups,
                         const UpsampledColumns& columns, const ColumnBlocks& blocks,
                         Interpolation interpolation, Fp64 fp64) {
  const ParallelGeometry& g = scan.geometry;
  const double gain_u = upsampler.gain_u();
  double samples = 0;
  for (const double m : scan.view_max) samples += m;
  const ColumnWeights w = weights_of(interpolation);
  const double run = static_cast<double>(view_run(interpolation)), views = static_cast<double>(g.views());
  // An upsampled column is at most the samples times the gain, and the sup of the signal.
  const double largest = std::min(gain_u * samples, sups.value);
  ChainErrors out;
  out.ramp = filter_error_bound(upsampler, scan);
  out.columns = w.gain * column_error(upsampler, g.columns, columns, samples, sups.value, fp64);
  // Six taps: a view's by themselves, in compensated runs of such sums, and their own roundings known; else a
  // rounding for each run, and eight for weights.
  const double terms = interpolation == Interpolation::six_taps ? compensated_runs(views / run, w.taps + run)
                                                                : w.taps * run + std::ceil(views / run) + 8;
  out.summation = (unit_roundoff * terms * w.gain + w.rounding) * largest;
  out.interpolation = interpolation_error(g, sups, columns.rate, interpolation);
  // At a wrong position, too, the interpolant is that close to the signal, which moves by its slope
  // (Bernstein: of values alone, as six taps are). A position is in columns, and pi / pitch in world units.
  out.position = position_error(g, columns, blocks) / columns.rate * pi * sups.value;
  out.underflow = views * (2 * product_underflow(g, gain_u) + 8 * smallest_normal);
  return out;
}

double arithmetic_bound(Upsampler& upsampler, const FilteredScan& scan, const FieldSups& sups,
                        const UpsampledColumns& columns, const ColumnBlocks& blocks,
                        Interpolation interpolation, Fp64 fp64) {
  const ParallelGeometry& g = scan.geometry;
  const double gain_u = upsampler.gain_u(), gain_v = lebesgue_constant(g.rows);
  double samples = 0;
  for (const double m : scan.view_max) samples += m;
  const ColumnWeights w = weights_of(interpolation);
  const double weight_gain = w.gain;
  // Rows first, then columns: each product errs relative to its own operands (+2: the matrix entries and the
  // result round).
  const double upsampling = unit_roundoff * (product_error(g.rows, row_run) + 2) * gain_v * gain_u * samples +
                            column_error(upsampler, g.columns, columns, sups.value, sups.value, fp64);
  // One rounding per multiply-add of a run from the view that a term enters at, one per run, and the weights'
  // own.
  const double runs =
      std::ceil(static_cast<double>(g.views()) / static_cast<double>(view_run(interpolation)));
  const double summation = unit_roundoff *
                               (w.taps * static_cast<double>(view_run(interpolation)) + runs + 8) *
                               weight_gain * sups.value +
                           w.rounding * sups.value;
  // A wrong position moves along the interpolant, whose slope is at most 4/3 of the signal's (cubic); that is
  // bounded by Bernstein and by Landau and Kolmogorov, |q'|^2 <= 2 |q| |q''|.
  const double slope = std::min(pi / g.pitch_u * sups.value, std::sqrt(2 * sups.value * sups.second_u));
  const double position = position_error(g, columns, blocks) *
                              (g.pitch_u / columns.rate * w.slope * slope + w.slope_sum * sups.value) +
                          (interpolation == Interpolation::six_taps
                               ? 2 * interpolation_error(g, sups, columns.rate, interpolation)
                               : 0.0);
  const double views = static_cast<double>(g.views());
  return filter_error_bound(upsampler, scan) + weight_gain * upsampling + summation + position +
         views * (2 * product_underflow(g, gain_u) + 8 * smallest_normal);
}

}  // namespace vdvr
