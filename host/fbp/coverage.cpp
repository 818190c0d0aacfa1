// Covered region and default grid.
#include "host/fbp/coverage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/fbp/view_weights.hpp"
#include "vdvr/error.hpp"
#include "vdvr/reconstruct.hpp"

namespace vdvr {
namespace {

constexpr std::int64_t sectors = 1024;

}  // namespace

Coverage::Coverage(const ParallelGeometry& g)
    : t_min_((-0.5 - g.center) * g.pitch_u),
      t_max_((static_cast<double>(g.columns) - 0.5 - g.center) * g.pitch_u),
      inner_(std::min(-t_min_, t_max_)),
      half_height_(0.5 * static_cast<double>(g.rows - 1) * g.pitch_v),
      // A point exactly on the detector's edge counts as covered whatever the rounding of its t.
      slack_(1e-9 * g.pitch_u),
      slack_z_(1e-9 * g.pitch_v) {
  if (!(inner_ > 0))
    throw InputError(fmt::format("the centre {} does not fall on the detector's {} columns; correct `center`",
                                 g.center, g.columns));
  for (const double theta : g.theta_rad) {
    cosine_.push_back(std::cos(theta));
    sine_.push_back(std::sin(theta));
  }
  for (std::int64_t i = 0; i < sectors; ++i) {
    const double phi = 2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(sectors),
                 x = std::cos(phi), y = std::sin(phi);
    const auto along = [&](std::size_t k) { return std::abs(x * cosine_[k] + y * sine_[k]); };
    std::size_t best = 0;
    for (std::size_t k = 1; k < cosine_.size(); ++k)
      if (along(k) > along(best)) best = k;
    nearest_.push_back(best);
  }
}

double Coverage::margin(double x, double y) const {
  const double r = std::hypot(x, y);
  if (r <= inner_) return inner_ - r;  // covered whatever the angles
  double margin = INFINITY;
  for (std::size_t k = 0; k < cosine_.size(); ++k) {
    const double t = x * cosine_[k] + y * sine_[k];
    margin = std::min(margin, std::min(t - t_min_, t_max_ - t));
  }
  return margin + slack_;
}

double Coverage::margin_above(double x, double y, double floor) const {
  if (std::hypot(x, y) > inner_) {
    const double turn = std::atan2(y, x) / (2 * std::numbers::pi) + 1;
    const std::size_t k = nearest_[static_cast<std::size_t>(turn * sectors) % sectors];
    const double t = x * cosine_[k] + y * sine_[k], far = std::min(t - t_min_, t_max_ - t) + slack_;
    if (far < floor) return far;
  }
  return margin(x, y);
}

double Coverage::margin_z(double z) const { return half_height_ - std::abs(z) + slack_z_; }

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
  const double height = coverage.half_height();
  return grid_around(geometry, coverage.inner_radius(), {-height, height}, options);
}

std::vector<std::string> check_scan(const ParallelGeometry& g) {
  std::vector<std::string> notes;
  if (g.views() < 2) throw InputError(fmt::format("{} view(s); tomography needs at least 2", g.views()));
  if (g.columns < 2 || g.rows < 1)
    throw InputError(fmt::format("a detector of {} columns x {} rows is too small", g.columns, g.rows));
  for (const double theta : g.theta_rad)
    if (!std::isfinite(theta)) throw InputError("an angle is not finite");
  const Coverage coverage(g);
  const auto [low, high] = std::minmax_element(g.theta_rad.begin(), g.theta_rad.end());
  const double arc = *high - *low, below = g.center + 0.5,
               above = static_cast<double>(g.columns) - 0.5 - g.center;
  // An axis within the outer quarter of a full-turn scan means half acquisition.
  if (arc > 1.5 * std::numbers::pi && std::min(below, above) < 0.5 * std::max(below, above)) {
    throw InputError(fmt::format(
        "the axis projects onto column {:.2f} of {} in a scan over {:.0f} degrees: half acquisition, "
        "which needs weights in u that this version does not have; use 180 degrees of it, or correct "
        "`center`",
        g.center, g.columns, arc * 180 / std::numbers::pi));
  }
  const ViewWeights weights = view_weights(g.theta_rad);
  if (weights.limited_angle)
    notes.push_back(
        "limited angle: a gap between views is above four times the median gap; its weight was capped");
  if (weights.grouped_views > 0)
    notes.push_back(fmt::format("{} coincident views share their weights", weights.grouped_views));
  return notes;
}

}  // namespace vdvr
