// Weights of cone-beam samples and views.
#include "host/field/fdk/fdk_weights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/base/system/casts.hpp"
#include "host/scan/geometry/vectors.hpp"
#include "host/scan/geometry/view_weights.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

using std::numbers::pi;

double degrees(double radians) { return radians * 180 / pi; }

}  // namespace

FdkWeights::FdkWeights(const ConeGeometry& cone, std::int64_t columns, std::int64_t rows)
    : columns_(columns), rows_(rows), redundancy_(cone.redundancy), arc_(source_arc(cone)) {
  if (cone.views.size() < 2)
    throw InputError(
        fmt::format("{} view(s); tomography needs at least 2: look at `views`", cone.views.size()));
  if (columns < 2 || rows < 1)
    throw InputError(fmt::format("a detector of {} columns x {} rows is too small", columns, rows));
  std::vector<double> angles;
  for (const ViewMatrix& matrix : cone.views) {
    const ConeView view = cone_view(matrix);
    if (!(view.center > -0.5 && view.center < static_cast<double>(columns) - 0.5))
      throw InputError(
          fmt::format("view {}: the axis falls on column {:.2f}, which is not one of the "
                      "detector's {}; correct `center`",
                      views_.size(), view.center, columns));
    // The plane of the orbit is that of the detector's rows, through the source.
    const Vec3 in_plane = sum(view.source, scaled(view.along_v, -dot(view.source, view.along_v)));
    to_axis_.push_back(scaled(in_plane, -1 / length(in_plane)));
    angles.push_back(view.angle());
    const double after = std::fmod(view.angle() - arc_.first_rad + 4 * pi, 2 * pi);
    // The first view's own angle may round to just before it.
    after_first_.push_back(2 * pi - after < 1e-9 ? 0.0 : after);
    view_.push_back(length(in_plane) / view.source_to_axis);
    views_.push_back(view);
  }
  const ViewWeights weights =
      view_weights(angles, 2 * pi, redundancy_ == Redundancy::short_scan ? Arc::open : Arc::closed);
  require_directions(weights);
  notes_ = weights.notes;
  // A turn sees every ray twice.
  for (std::size_t k = 0; k < view_.size(); ++k) view_[k] *= 0.5 * weights.weight[k];
  if (redundancy_ == Redundancy::short_scan) check_short_scan();
  if (redundancy_ == Redundancy::displaced) pad_displaced();
}

// Of the ray through a column, in the plane of the orbit: from the line to the axis towards high columns.
double FdkWeights::fan_angle(std::size_t k, double column) const {
  const ConeView& view = views_[k];
  const double across = (column - view.foot_u) * view.pitch_u;
  return std::atan2(across, view.source_to_axis) -
         std::atan2(dot(to_axis_[k], view.along_u), dot(to_axis_[k], view.normal));
}

double FdkWeights::cosine(std::size_t k, double column, double row) const {
  const ConeView& view = views_[k];
  const double across = (column - view.foot_u) * view.pitch_u, along = (row - view.foot_v) * view.pitch_v;
  const double dot_axis = view.source_to_axis * dot(to_axis_[k], view.normal) +
                          across * dot(to_axis_[k], view.along_u) + along * dot(to_axis_[k], view.along_v);
  return dot_axis / std::hypot(view.source_to_axis, across, along);
}

void FdkWeights::check_short_scan() const {
  double widest = 0;
  const double last = static_cast<double>(columns_ - 1);
  for (std::size_t k = 0; k < views_.size(); ++k)
    widest = std::max({widest, std::abs(fan_angle(k, 0)), std::abs(fan_angle(k, last))});
  if (arc_.arc_rad + 1e-9 < pi + 2 * widest)
    throw InputError(fmt::format(
        "the views cover {:.2f} degrees, but a short scan needs 180 and the fan's {:.2f}: {:.2f}; rays that "
        "are missing cannot be weighed",
        degrees(arc_.arc_rad), degrees(2 * widest), 180 + degrees(2 * widest)));
  for (const ConeView& view : views_) {
    const double below = view.center, above = last - view.center;
    if (std::abs(above - below) >= 0.1 * (above + below))
      throw InputError(
          fmt::format("a short scan with a displaced detector (axis on column {:.2f} of {}): the opposite "
                      "views, which would complete its rays, do not exist",
                      view.center, columns_));
  }
}

// The fan that every view sees on both sides, and columns of zeros to make the shorter side as long.
void FdkWeights::pad_displaced() {
  const double last = static_cast<double>(columns_ - 1);
  double below = std::numeric_limits<double>::infinity(), above = below;
  std::int64_t lacking = 0;
  for (std::size_t k = 0; k < views_.size(); ++k) {
    below = std::min(below, -fan_angle(k, 0));
    above = std::min(above, fan_angle(k, last));
    lacking = std::max(lacking, static_cast<std::int64_t>(std::ceil(std::abs(last - 2 * views_[k].center))));
  }
  displaced_up_ = above > below;
  overlap_fan_ = std::min(below, above);
  if (!(overlap_fan_ > 0))
    throw InputError("displaced detector: a view's axis does not fall on the detector; correct `center`");
  (displaced_up_ ? pad_before_ : pad_after_) = lacking;
}

double FdkWeights::redundancy(std::size_t k, double column) const {
  if (redundancy_ == Redundancy::full_turn) return 1;
  const double fan = fan_angle(k, column);
  const auto squared = [](double x) { return x * x; };
  if (redundancy_ == Redundancy::displaced) {
    // Wang 2002, eq. 15, in the fan's angle.
    const double towards = displaced_up_ ? fan : -fan;
    if (towards <= -overlap_fan_) return 0;
    if (towards >= overlap_fan_) return 2;
    return 1 + std::sin(0.5 * pi * towards / overlap_fan_);
  }
  // Parker 1982: his fan angle grows towards low columns, his scan is 180 degrees and 2 delta.
  const double delta = 0.5 * (arc_.arc_rad - pi), alpha = -fan, beta = after_first_[k];
  if (beta <= 0) return 0;
  if (beta <= 2 * (delta - alpha)) return 2 * squared(std::sin(0.25 * pi * beta / (delta - alpha)));
  if (beta <= pi - 2 * alpha) return 2;
  if (beta <= pi + 2 * delta)
    return 2 * squared(std::sin(0.25 * pi * (pi + 2 * delta - beta) / (delta + alpha)));
  return 0;
}

void FdkWeights::apply(std::size_t k, std::span<const float> samples, std::span<double> out) const {
  const std::int64_t wide = pad_before_ + columns_ + pad_after_;
  std::fill(out.begin(), out.end(), 0.0);
  for (std::int64_t i = 0; i < columns_; ++i) {
    const auto column = static_cast<double>(i);
    const double share = redundancy(k, column);
    for (std::int64_t j = 0; j < rows_; ++j)
      out[at(j * wide + pad_before_ + i)] = share * cosine(k, column, static_cast<double>(j)) *
                                            static_cast<double>(samples[at(j * columns_ + i)]);
  }
}

}  // namespace vdvr
