// Covered region and default grid.
#include "host/field/fbp/coverage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "host/base/system/casts.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/reconstruct.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t sectors = 1024;
constexpr int circles = 64;
// Around the region its half-planes are known by sectors: up to so many of its inner radii.
constexpr double around = 2;

std::size_t sector_of(double x, double y) {
  const double turn = std::atan2(y, x) / (2 * std::numbers::pi) + 1;
  return static_cast<std::size_t>(turn * sectors) % sectors;
}

}  // namespace

std::pair<double, double> seen_columns(const ParallelGeometry& g) {
  const auto before = static_cast<double>(g.extension.before), after = static_cast<double>(g.extension.after);
  // Of the view that sees least on that side.
  double low = 0, high = 0;
  if (!g.column_shift.empty()) {
    const auto [least, most] = std::minmax_element(g.column_shift.begin(), g.column_shift.end());
    low = *least;
    high = *most;
  }
  const double below = g.center + low - before + 0.5,
               above = static_cast<double>(g.columns) - after - 0.5 - g.center - high;
  if (!g.extension.half_acquisition.value_or(false)) return {below, above};
  return {std::max(below, above), std::max(below, above)};
}

Coverage::Coverage(const ParallelGeometry& g)
    // A point exactly on the detector's edge counts as covered whatever the rounding of its t.
    : slack_(1e-9 * g.pitch_u), slack_z_(1e-9 * g.pitch_v) {
  const auto [of_columns, beyond] = seen_columns(g);
  const double below = of_columns * g.pitch_u, above = beyond * g.pitch_u,
               half_height = 0.5 * static_cast<double>(g.rows - 1) * g.pitch_v;
  heights_ = {-half_height, half_height};
  inner_ = std::min(below, above);
  if (!(inner_ > 0))
    throw InputError(
        g.column_shift.empty()
            ? fmt::format("the centre {} does not fall on the detector's {} columns; correct `center`",
                          g.center, g.columns)
            : fmt::format(
                  "the centre {}, with shifts of {:g} to {:g} columns, does not fall on the detector's {} "
                  "columns in every view; correct `center` or `shifts`, which are lengths",
                  g.center, *std::min_element(g.column_shift.begin(), g.column_shift.end()),
                  *std::max_element(g.column_shift.begin(), g.column_shift.end()), g.columns));
  ParallelGeometry one = g;
  for (std::size_t k = 0; k < g.theta_rad.size(); ++k) {
    const double c = std::cos(g.theta_rad[k]), s = std::sin(g.theta_rad[k]);
    double low = below, high = above;
    if (!g.column_shift.empty()) {
      one.column_shift = {g.column_shift[k]};
      const auto [towards_first, towards_last] = seen_columns(one);
      low = towards_first * g.pitch_u;
      high = towards_last * g.pitch_u;
    }
    planes_.push_back({c, s, low});
    planes_.push_back({-c, -s, high});
  }
  index();
}

std::array<std::array<double, 4>, 4> planes_of_view(const ViewMatrix& m, std::int64_t columns,
                                                    std::int64_t rows) {
  const auto plane_of = [&](std::size_t row, double bound, double sign) {
    std::array<double, 4> plane{};
    for (std::size_t j = 0; j < 4; ++j) plane[j] = sign * (m[row][j] - bound * m[2][j]);
    const double norm = std::hypot(plane[0], plane[1], plane[2]);
    for (double& value : plane) value /= norm;
    return plane;
  };
  return {plane_of(0, -0.5, 1), plane_of(0, static_cast<double>(columns) - 0.5, -1), plane_of(1, 0, 1),
          plane_of(1, static_cast<double>(rows - 1), -1)};
}

Coverage::Coverage(const ParallelGeometry& g, const std::vector<ViewMatrix>& views) {
  if (views.empty()) {
    *this = Coverage(g);
    return;
  }
  slack_ = 1e-9 * g.pitch_u;
  slack_z_ = 1e-9 * g.pitch_v;
  std::vector<std::array<double, 4>> planes;
  for (const ViewMatrix& m : views)
    for (const auto& plane : planes_of_view(m, g.columns, g.rows)) planes.push_back(plane);
  take_cylinder(planes);
  index();
}

// Half-planes of the cylinder of largest volume among those whose heights are a share of the axis' own: what
// a plane leaves of a height is affine in it, so that it is the less of both ends. Distances to a plane in
// space are no larger along z = const, so margins are what they promise.
void Coverage::take_cylinder(const std::vector<std::array<double, 4>>& planes) {
  double low = -INFINITY, high = INFINITY;
  for (const auto& p : planes) {
    if (p[2] > 1e-14) low = std::max(low, -p[3] / p[2]);
    if (p[2] < -1e-14) high = std::min(high, -p[3] / p[2]);
    if (!(p[3] + slack_ >= 0))
      throw InputError("the isocentre does not fall on the detector in every view; correct `center`");
  }
  const auto rest = [&](const std::array<double, 4>& p, double share) {
    return p[3] + std::min(p[2] * low * share, p[2] * high * share);
  };
  constexpr int steps = 256;
  double largest = -1, best = 1;
  for (int i = steps; i > 0; --i) {
    const double share = static_cast<double>(i) / steps;
    double radius = INFINITY;
    for (const auto& p : planes) {
      const double across = std::hypot(p[0], p[1]);
      if (across > 1e-14) radius = std::min(radius, rest(p, share) / across);
    }
    // A single row has no height, and the whole of its plane.
    const double volume = radius > 0 ? radius * radius * (high > low ? share : 1.0) : 0.0;
    if (volume > largest) {
      largest = volume;
      best = share;
      inner_ = radius;
    }
  }
  if (!(inner_ > 0))
    throw InputError("the axis does not fall on the detector's columns in every view; correct `center`");
  heights_ = {low * best, high * best};
  for (const auto& p : planes) planes_.push_back({p[0], p[1], rest(p, best)});
}

void Coverage::index() {
  const auto reach = [](const HalfPlane& p, double dx, double dy) {
    const double towards = -(p.x * dx + p.y * dy);
    return towards > 0 ? p.rest / towards : std::numeric_limits<double>::infinity();
  };
  for (std::int64_t i = 0; i < sectors; ++i) {
    const double phi = 2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(sectors),
                 x = std::cos(phi), y = std::sin(phi);
    nearest_.push_back(0);
    double least = INFINITY;
    for (std::size_t k = 0; k < planes_.size(); ++k)
      if (const double r = reach(planes_[k], x, y); r < least) {
        least = r;
        nearest_.back() = k;
      }
  }
  for (int i = 0; i <= circles; ++i) {
    const double r = inner_ * static_cast<double>(i) / circles;
    double least = INFINITY;
    for (const HalfPlane& p : planes_) least = std::min(least, p.rest - r * std::hypot(p.x, p.y));
    within_.push_back(least);
  }
  for (std::int64_t i = 0; i < sectors; ++i) {
    first_.push_back(least_.size());
    add_least(i);
  }
  first_.push_back(least_.size());
}

// Of half-planes that can have the least margin somewhere in a sector. What one has more than the nearest is
// affine in the radius, and in the direction a cosine.
void Coverage::add_least(std::int64_t sector) {
  const double half = std::numbers::pi / static_cast<double>(sectors) * (1 + 1e-6),
               phi =
                   2 * std::numbers::pi * (static_cast<double>(sector) + 0.5) / static_cast<double>(sectors);
  const double c = std::cos(phi), s = std::sin(phi), cos_half = std::cos(half), sin_half = std::sin(half),
               far = around * inner_;
  const HalfPlane& nearest = planes_[nearest_[at(sector)]];
  // Far above what rounding can turn.
  const double slack = 1e-9 * (std::abs(nearest.rest) + far);
  for (const HalfPlane& p : planes_) {
    const double x = p.x - nearest.x, y = p.y - nearest.y, middle = x * c + y * s,
                 least = std::min(middle, middle * cos_half) - std::abs(y * c - x * s) * sin_half;
    if (p.rest - nearest.rest + std::min(inner_ * least, far * least) <= slack) least_.push_back(p);
  }
}

double Coverage::margin(double x, double y) const {
  const double r = std::sqrt(x * x + y * y);  // hypot takes three times as long
  if (r < inner_) {                           // covered whatever the angles
    // The least margin on a circle is concave in its radius: it lies above its chords.
    const double place = r / inner_ * circles;
    const auto i = std::min(static_cast<std::size_t>(place), static_cast<std::size_t>(circles - 1));
    const double part = place - static_cast<double>(i);
    return within_[i] + part * (within_[i + 1] - within_[i]) + slack_;
  }
  const std::size_t sector = sector_of(x, y);
  std::span<const HalfPlane> planes = planes_;
  if (r < around * inner_)
    planes = std::span(least_).subspan(first_[sector], first_[sector + 1] - first_[sector]);
  double margin = INFINITY;
  for (const HalfPlane& p : planes) margin = std::min(margin, p.margin(x, y));
  return margin + slack_;
}

double Coverage::margin_above(double x, double y, double floor) const {
  if (x * x + y * y > inner_ * inner_) {
    const double far = planes_[nearest_[sector_of(x, y)]].margin(x, y) + slack_;
    if (far < floor) return far;
  }
  return margin(x, y);
}

namespace {

// What of a convex polygon lies where x * px + y * py + rest >= 0.
std::vector<std::array<double, 2>> clipped(const std::vector<std::array<double, 2>>& polygon, double x,
                                           double y, double rest) {
  std::vector<std::array<double, 2>> out;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double at_p = x * p[0] + y * p[1] + rest, at_q = x * q[0] + y * q[1] + rest;
    if (at_p >= 0) out.push_back(p);
    if ((at_p < 0) == (at_q < 0)) continue;
    const double part = at_p / (at_p - at_q);
    out.push_back({p[0] + part * (q[0] - p[0]), p[1] + part * (q[1] - p[1])});
  }
  return out;
}

}  // namespace

std::vector<std::array<double, 2>> Coverage::outline(double reach) const {
  constexpr std::int64_t directions = 64;
  // Where some direction has no end, at least farther out than any source.
  const double far = 1e3 * (inner_ + reach);
  std::vector<std::array<double, 2>> polygon{{far, far}, {-far, far}, {-far, -far}, {far, -far}};
  for (std::int64_t d = 0; d < directions; ++d) {
    const HalfPlane& p = planes_[nearest_[at(d * sectors / directions)]];
    // Corners are rounded: 1e-9 of the radius lies far above that.
    polygon = clipped(polygon, p.x, p.y, p.rest + reach + slack_ + 1e-9 * (inner_ + reach));
  }
  return polygon;
}

double Coverage::margin_z(double z) const {
  return std::min(z - heights_.first, heights_.second - z) + slack_z_;
}

double coverage_margin(const ParallelGeometry& geometry, double center, const Vec3& point) {
  ParallelGeometry g = geometry;
  g.center = center;
  const Coverage coverage(g);
  return std::min(coverage.margin(point[0], point[1]), coverage.margin_z(point[2]));
}

namespace {

std::int64_t cells_around(double length, double spacing) {
  // 1e-9: a length that is a whole number of cells but for rounding does not get one more.
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(length / spacing - 1e-9)));
}

void check_grid(const Grid& grid) {
  std::int64_t product = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!std::isfinite(grid.origin[a])) throw InputError("`origin` must be finite");
    if (!(grid.spacing[a] > 0) || !std::isfinite(grid.spacing[a]))
      throw InputError("`spacing` must be positive and finite");
    if (grid.cells[a] < 1 || grid.cells[a] > (1 << 20))
      throw InputError(fmt::format("`size`: {} cells along axis {}, but 1 to {} are possible", grid.cells[a],
                                   "xyz"[a], 1 << 20));
    if (product > (std::int64_t{1} << 40) / (grid.cells[a] + 1))
      throw InputError(
          fmt::format("`size` {}x{}x{} passes 2^40 samples", grid.cells[0], grid.cells[1], grid.cells[2]));
    product *= grid.cells[a] + 1;
  }
}

}  // namespace

Grid grid_around(const ParallelGeometry& geometry, double radius, std::pair<double, double> heights,
                 const GridOptions& options) {
  Grid grid;
  grid.unit = geometry.unit;
  const double d = options.spacing.value_or(geometry.pitch_u);
  grid.spacing = {d, d, options.spacing_z.value_or(options.spacing.value_or(geometry.pitch_v))};
  if (!(grid.spacing[0] > 0) || !(grid.spacing[2] > 0))
    throw InputError("`spacing` must be positive and finite");
  const std::int64_t across = cells_around(2 * radius, d),
                     along = cells_around(heights.second - heights.first, grid.spacing[2]);
  grid.cells = options.size.value_or(Index3{across, across, along});
  const Vec3 middle{0, 0, 0.5 * (heights.first + heights.second)};
  for (std::size_t a = 0; a < 3; ++a)
    grid.origin[a] = options.origin ? (*options.origin)[a]
                                    : middle[a] - 0.5 * static_cast<double>(grid.cells[a]) * grid.spacing[a];
  check_grid(grid);
  return grid;
}

Grid make_grid(const ParallelGeometry& geometry, const GridOptions& options) {
  const Coverage coverage(geometry);
  return grid_around(geometry, coverage.inner_radius(), coverage.heights(), options);
}

std::vector<std::string> check_scan(const ParallelGeometry& g) {
  if (g.views() < 2)
    throw InputError(fmt::format(
        "{} view(s); tomography needs at least 2: look at `views`, and at the file's angles", g.views()));
  if (g.columns < 2 || g.rows < 1)
    throw InputError(fmt::format("a detector of {} columns x {} rows is too small", g.columns, g.rows));
  for (const double theta : g.theta_rad)
    if (!std::isfinite(theta)) throw InputError("an angle is not finite");
  const Coverage coverage(g);
  for (const std::vector<double>* shift : {&g.column_shift, &g.row_shift}) {
    if (!shift->empty() && std::ssize(*shift) != g.views())
      throw InputError(fmt::format("{} shifts for {} views", shift->size(), g.views()));
    for (const double s : *shift)
      if (!std::isfinite(s)) throw InputError("a shift is not finite");
  }
  require_axis_roll(g.axis_roll_deg, "axis roll");
  if ((!g.row_shift.empty() || g.axis_roll_deg != 0) && !g.extension.common_heights)
    throw InputError(
        "views see other heights, or the axis leans, and their rows were not brought to common heights when "
        "they "
        "were read (common_heights)");
  if (!g.extension.half_acquisition && g.column_shift.empty() && looks_half_acquired(g))
    throw InputError(fmt::format(
        "the axis projects onto column {:.2f} of {} in a scan all around: half acquisition, whose rows are "
        "weighted when it is read (extend_rows); or correct `center`",
        g.center, g.columns));
  const ViewWeights weights = view_weights(g);
  require_directions(weights);
  return weights.notes;
}

}  // namespace vdvr
