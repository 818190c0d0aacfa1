#include "host/scan/prepare/prepare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "host/base/system/limits.hpp"
#include "host/base/system/parallel.hpp"
#include "host/scan/prepare/stripes.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr {
namespace {

View view_of(const ProjectionSet& scan, std::int64_t k) {
  const std::int64_t columns = scan.geometry.columns, rows = scan.geometry.rows;
  const float* from = scan.data.data() + k * rows * columns;
  return {columns, rows, std::vector<double>(from, from + rows * columns)};
}

// --- stripes ---

Sinogram sinogram_of(const ProjectionSet& scan, std::int64_t row) {
  const std::int64_t K = scan.geometry.views(), V = scan.geometry.rows, U = scan.geometry.columns;
  Sinogram s{K, U, std::vector<double>(static_cast<std::size_t>(K * U))};
  for (std::int64_t k = 0; k < K; ++k) {
    const float* from = scan.data.data() + (k * V + row) * U;
    std::copy(from, from + U, s.row(k));
  }
  return s;
}

void put(const Sinogram& s, ProjectionSet& scan, std::int64_t row) {
  const std::int64_t V = scan.geometry.rows;
  for (std::int64_t k = 0; k < s.views; ++k)
    std::transform(s.row(k), s.row(k) + s.columns, scan.data.data() + (k * V + row) * s.columns,
                   [](double p) { return static_cast<float>(p); });
}

void remove_stripes(ProjectionSet& scan, const Stripes& stripes, std::uint64_t max_memory_bytes,
                    const Progress& progress) {
  const ParallelGeometry& g = scan.geometry;
  // The sinogram, its sorted columns with their views, and these smoothed.
  const std::uint64_t each = (3 * sizeof(double) + sizeof(std::int32_t)) *
                             static_cast<std::uint64_t>(g.views()) * static_cast<std::uint64_t>(g.columns);
  io::require_memory(scan.data.resident_bytes() + each * std::max(1u, std::thread::hardware_concurrency()),
                     max_memory_bytes, "stripe removal: the projections and a sinogram for each core");
  std::atomic<std::int64_t> dead{0}, lasting{0};
  parallel_for(g.rows, progress, "stripes", [&](std::int64_t row) {
    Sinogram s = sinogram_of(scan, row);
    dead += remove_dead_stripes(s, stripes.ratio, stripes.large);
    lasting += remove_lasting_stripes(s, stripes.ratio, stripes.small);
    remove_small_stripes(s, stripes.small);
    put(s, scan, row);
  });
  scan.report.notes.push_back(
      fmt::format("stripes: in {} rows {} columns were dead or fluctuating, {} off those around them for "
                  "many views; then all got the median of {} columns, rank by rank",
                  g.rows, dead.load(), lasting.load(), stripes.small));
}

// --- binning ---

// Column i of a binned detector shows columns b i to b i + b - 1, whose middle is b i + (b - 1) / 2.
ViewMatrix binned(ViewMatrix m, int b) {
  for (std::size_t axis = 0; axis < 2; ++axis)
    for (std::size_t i = 0; i < 4; ++i) m[axis][i] = (m[axis][i] - 0.5 * (b - 1) * m[2][i]) / b;
  return m;
}

void bin_geometry(ProjectionSet& scan, int b) {
  ParallelGeometry& g = scan.geometry;
  g.columns /= b, g.rows /= b;
  if (scan.cone) {
    for (ViewMatrix& m : scan.cone->views) m = binned(m, b);
    const std::string unit = g.unit;
    g = parallel_limit(*scan.cone, g.columns, g.rows, unit);
    return;
  }
  g.center = binned_center(g.center, b);
  g.pitch_u *= b, g.pitch_v *= b;
  for (double& shift : g.column_shift) shift /= b;
  for (double& shift : g.row_shift) shift /= b;
}

}  // namespace

std::int64_t remove_outliers(View& view, const Outliers& outliers) {
  // exp(-p) falls with p, so the median of transmissions is that of the median integral.
  const View middle = median_filtered(view, outliers.window);
  std::int64_t replaced = 0;
  for (std::size_t i = 0; i < view.data.size(); ++i)
    if (std::exp(-view.data[i]) - std::exp(-middle.data[i]) > outliers.threshold) {
      view.data[i] = middle.data[i];
      ++replaced;
    }
  return replaced;
}

ViewPreparation::ViewPreparation(const Preparation& preparation, const ParallelGeometry& g, bool cone)
    : preparation_(preparation) {
  check_preparation(preparation);
  if (!preparation.phase) return;
  if (cone)
    throw InputError("phase: retrieval is for parallel beam; a cone-beam scan magnifies along the way");
  const double unit = millimetres_of(g.unit);
  phase_ = std::make_unique<PaganinFilter>(g.columns, g.rows, g.pitch_u * unit, g.pitch_v * unit,
                                           paganin_area_mm2(*preparation.phase));
}

std::int64_t ViewPreparation::apply(View& view) const {
  const std::int64_t replaced = preparation_.outliers ? remove_outliers(view, *preparation_.outliers) : 0;
  if (phase_) phase_->apply(view);
  return replaced;
}

void prepare_scan(ProjectionSet& scan, const Preparation& p, std::uint64_t max_memory_bytes,
                  const Progress& progress) {
  if (p.stripes) remove_stripes(scan, *p.stripes, max_memory_bytes, progress);
  if (p.median == 1 && p.gaussian == std::array<double, 2>{0, 0} && p.binning == 1) return;
  const std::int64_t columns = scan.geometry.columns / p.binning, rows = scan.geometry.rows / p.binning;
  if (columns < 2 || rows < 1)
    throw InputError(fmt::format("binning: {} leaves {} x {} of {} x {} pixels", p.binning, columns, rows,
                                 scan.geometry.columns, scan.geometry.rows));
  SampleArray prepared;
  if (p.binning > 1)
    prepared = SampleArray(static_cast<std::size_t>(scan.geometry.views() * rows * columns),
                           scan.data.scratch(), "the binned projections");
  SampleArray& out = p.binning > 1 ? prepared : scan.data;
  parallel_for(scan.geometry.views(), progress, "prepare", [&](std::int64_t k) {
    View view = view_of(scan, k);
    if (p.median > 1) view = median_filtered(view, p.median);
    if (p.gaussian[0] > 0 || p.gaussian[1] > 0) view = gaussian_filtered(view, p.gaussian[0], p.gaussian[1]);
    if (p.binning > 1) view = binned(view, p.binning);
    std::transform(view.data.begin(), view.data.end(), out.data() + k * rows * columns,
                   [](double sample) { return static_cast<float>(sample); });
  });
  if (p.binning == 1) return;
  scan.data = std::move(prepared);
  bin_geometry(scan, p.binning);
}

}  // namespace vdvr
