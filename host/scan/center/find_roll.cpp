// The line through the centres of bands of rows.
#include "vdvr/expert/find_roll.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "host/base/system/casts.hpp"
#include "host/base/system/parallel.hpp"
#include "host/scan/center/half_turn.hpp"
#include "host/scan/center/opposite_views.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t most_bands = 16, fewest_bands = 3;
constexpr std::int64_t most_rows = 256;                     // that are read of a view
constexpr double band_quality = 0.5, band_uncertainty = 1;  // as find_center() has it; columns
// What registration of two rows gets wrong, by interpolation between columns.
constexpr double finest_uncertainty = 0.01;

// The rows that are read, and the bands they are in.
struct Rows {
  explicit Rows(std::int64_t all) : bands(std::min(most_bands, all)), row(at(bands)), count(at(bands)) {
    const std::int64_t by = (all + most_rows - 1) / most_rows;
    for (std::int64_t j = by / 2; j < all; j += by) {
      const auto band = at(j * bands / all);
      row[band] += static_cast<double>(j) - 0.5 * static_cast<double>(all - 1);
      count[band] += 1;
      read.push_back({j, j * bands / all});
    }
    for (std::size_t b = 0; b < row.size(); ++b) row[b] /= std::max(1.0, count[b]);
  }
  std::int64_t bands;
  std::vector<double> row, count;  // mean row of each band, from the middle one
  std::vector<std::pair<std::int64_t, std::int64_t>> read;
};

// Means of bands of rows that stand upright on an axis of this roll, read between pixels: float
// [view][band][column].
ProjectionSet upright_bands(const ProjectionSet& scan, const Rows& rows, double roll_rad) {
  const ParallelGeometry& g = scan.geometry;
  const std::int64_t U = g.columns, V = g.rows, bands = rows.bands;
  ProjectionSet out;
  out.geometry = g;
  out.geometry.rows = bands;
  out.data = SampleArray(std::vector<float>(at(out.size())));
  const double c = std::cos(roll_rad), s = std::sin(roll_rad), aspect = g.pitch_v / g.pitch_u,
               middle_u = 0.5 * static_cast<double>(U - 1), middle_v = 0.5 * static_cast<double>(V - 1);
  parallel_for(g.views(), {}, "", [&](std::int64_t k) {
    const float* view = scan.data.data() + k * V * U;
    const double moved = g.column_shift.empty() ? 0 : g.column_shift[at(k)];
    std::vector<double> sum(at(bands * U));
    for (const auto& [j, band] : rows.read) {
      const double z = (static_cast<double>(j) - middle_v) * aspect;
      for (std::int64_t i = 0; i < U; ++i) {
        const double t = static_cast<double>(i) - middle_u + moved;
        const double u = std::clamp(t * c + z * s + middle_u, 0.0, static_cast<double>(U - 1)),
                     v = std::clamp((z * c - t * s) / aspect + middle_v, 0.0, static_cast<double>(V - 1));
        const auto u0 = std::min(static_cast<std::int64_t>(u), std::max<std::int64_t>(0, U - 2)),
                   v0 = std::min(static_cast<std::int64_t>(v), std::max<std::int64_t>(0, V - 2));
        const double fu = u - static_cast<double>(u0), fv = v - static_cast<double>(v0);
        const auto on_row = [&](std::int64_t row) {
          const float* p = view + row * U + u0;
          return std::lerp(static_cast<double>(p[0]), static_cast<double>(p[U > 1 ? 1 : 0]), fu);
        };
        sum[at(band * U + i)] += std::lerp(on_row(v0), on_row(V > 1 ? v0 + 1 : v0), fv);
      }
    }
    for (std::int64_t b = 0; b < bands; ++b)
      for (std::int64_t i = 0; i < U; ++i)
        out.data[at((k * bands + b) * U + i)] = static_cast<float>(sum[at(b * U + i)] / rows.count[at(b)]);
  });
  out.geometry.column_shift.clear();
  return out;
}

ProjectionSet band_of(const ProjectionSet& bands, std::int64_t band) {
  const ParallelGeometry& g = bands.geometry;
  ProjectionSet one;
  one.geometry = g;
  one.geometry.rows = 1;
  one.data = SampleArray(std::vector<float>(at(one.size())));
  for (std::int64_t k = 0; k < g.views(); ++k)
    std::copy_n(bands.data.data() + (k * g.rows + band) * g.columns, g.columns,
                one.data.data() + k * g.columns);
  return one;
}

// By opposite views, or by the ends of half a turn.
std::optional<CenterWitness> center_of_band(const ProjectionSet& band) {
  if (const auto opposite = center::from_opposite_views(band)) return opposite->all;
  return center::from_ends(band);
}

struct BandCenter {
  double row = 0;  // from the middle one
  CenterWitness witness;
};

std::vector<BandCenter> centers_of(const ProjectionSet& bands, const Rows& rows) {
  std::vector<BandCenter> found;
  const std::int64_t n = bands.geometry.rows;
  for (std::int64_t b = 0; b < n; ++b) {
    const auto witness = center_of_band(band_of(bands, b));
    if (!witness || !(witness->quality >= band_quality) || !(witness->uncertainty <= band_uncertainty))
      continue;
    found.push_back({rows.row[at(b)], *witness});
  }
  // One that took another object for the mirror image of this one.
  std::vector<double> sorted;
  for (const BandCenter& b : found) sorted.push_back(b.witness.center);
  std::sort(sorted.begin(), sorted.end());
  if (sorted.empty()) return found;
  const double median = sorted[sorted.size() / 2], reach = std::tan(most_axis_roll_deg * radians_per_degree) *
                                                           2 * std::abs(rows.row.front()) *
                                                           bands.geometry.pitch_v / bands.geometry.pitch_u;
  std::erase_if(found, [&](const BandCenter& b) { return std::abs(b.witness.center - median) > reach + 2; });
  return found;
}

// center = at + slope row, by weighted least squares; what bands leave unexplained makes it less sure.
struct Line {
  double at = 0, slope = 0, uncertainty = 0;
};

std::optional<Line> line_through(const std::vector<BandCenter>& centers) {
  if (std::ssize(centers) < fewest_bands) return {};
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
  const auto weight = [](const BandCenter& b) {
    return 1 / std::pow(std::max(b.witness.uncertainty, finest_uncertainty), 2);
  };
  for (const BandCenter& b : centers) {
    const double u = weight(b);
    w += u, wx += u * b.row, wy += u * b.witness.center, wxx += u * b.row * b.row,
        wxy += u * b.row * b.witness.center;
  }
  const double spread = wxx - wx * wx / w;
  if (!(spread > 0)) return {};
  Line line;
  line.slope = (wxy - wx * wy / w) / spread;
  line.at = (wy - line.slope * wx) / w;
  double chi = 0;
  for (const BandCenter& b : centers)
    chi += weight(b) * std::pow(b.witness.center - line.at - line.slope * b.row, 2);
  line.uncertainty = std::sqrt(std::max(1.0, chi / static_cast<double>(std::ssize(centers) - 2)) / spread);
  return line;
}

}  // namespace

std::optional<RollEstimate> find_roll(const ProjectionSet& scan) {
  const ParallelGeometry& g = scan.geometry;
  if (scan.cone || g.rows < fewest_bands || g.views() < 2 || g.columns < 8) return std::nullopt;
  if (static_cast<std::int64_t>(scan.data.size()) != scan.size())
    throw InputError(
        fmt::format("{} samples for {} views of {} x {}", scan.data.size(), g.views(), g.rows, g.columns));
  const double aspect = g.pitch_u / g.pitch_v, most = 1.5 * most_axis_roll_deg * radians_per_degree;
  const Rows rows(g.rows);
  double roll = 0;
  RollEstimate found;
  constexpr int passes = 3;
  for (int pass = 0; pass < passes; ++pass) {
    const ProjectionSet bands = upright_bands(scan, rows, roll);
    const std::vector<BandCenter> centers = centers_of(bands, rows);
    const auto line = line_through(centers);
    if (!line) return std::nullopt;
    roll += std::atan(line->slope * aspect);
    if (!(std::abs(roll) <= most)) return std::nullopt;
    found.uncertainty_deg = std::atan(line->uncertainty * aspect) * degrees_per_radian;
    found.center = line->at;
    found.bands = std::ssize(centers);
    found.method = fmt::format("the centres of {} bands of rows", found.bands);
    if (std::abs(line->slope) < 0.1 * line->uncertainty) break;
  }
  const double off = std::abs(roll) * degrees_per_radian;
  found.significant =
      off > 4 * found.uncertainty_deg &&
      std::tan(std::abs(roll)) / aspect * 0.5 * static_cast<double>(g.rows - 1) > center_agreement;
  found.roll_deg = g.axis_roll_deg + roll * degrees_per_radian;
  return found;
}

}  // namespace vdvr
