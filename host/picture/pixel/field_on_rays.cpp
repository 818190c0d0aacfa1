// F itself along random rays of a picture that was certified, by its definition in double precision.
#include "host/picture/pixel/field_on_rays.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "vdvr/expert/exact_field.hpp"
#include "vdvr/expert/stop.hpp"

namespace vdvr {
namespace {

constexpr double kRayStep = 0.125;  // base cells

using Field = std::function<std::vector<double>(const std::vector<Vec3>&)>;

void take(RayCheck& check, double value, double low, double high) {
  const double share = high > low ? std::abs(2 * value - high - low) / (high - low) : value == low ? 0 : 2;
  check.worst = std::max(check.worst, share);
  if (!(share <= 1)) ++check.outside;
}

/// A pixel by chance, and what F there is held to.
struct RandomPixel {
  const Field& field;
  const CertifiedPicture& picture;
  const MixedVolume& volume;
  const std::pair<float, float>& value_range;
  std::size_t number;  ///< in rows
  [[nodiscard]] const RenderOptions& options() const { return picture.record.options; }
  [[nodiscard]] const Grid& grid() const { return volume.grid; }
  [[nodiscard]] std::int64_t x() const { return static_cast<std::int64_t>(number) % options().width; }
  [[nodiscard]] std::int64_t y() const { return static_cast<std::int64_t>(number) / options().width; }
  [[nodiscard]] RaySteps ray() const { return steps_of_pixel(options(), grid(), x(), y(), kRayStep); }
};

/// F's own pixel, under whatever light the picture is of.
IdealPixel ideal_of(const RandomPixel& p) {
  const RenderOptions& o = p.options();
  if (p.picture.record.lit)
    return ideal_lit_pixel(p.field, p.value_range, o, p.grid(), p.x(), p.y(), kRayStep);
  if (o.shading) return ideal_drawn_pixel(p.field, p.volume, p.value_range, o, p.x(), p.y(), kRayStep);
  return ideal_pixel(p.field, o, p.grid(), p.x(), p.y(), kRayStep);
}

void check_colours(const RandomPixel& p, RayCheck& check) {
  const IdealPixel ideal = ideal_of(p);
  const double reach = ideal.quadrature + ideal.light + 0x1p-12;
  for (std::size_t c = 0; c < 3; ++c)
    take(check, ideal.rgb[c], static_cast<double>(p.picture.bounds.lo.values[3 * p.number + c]) - reach,
         static_cast<double>(p.picture.bounds.hi.values[3 * p.number + c]) + reach);
}

void check_grey(const RandomPixel& p, RayCheck& check) {
  if (p.picture.bounds.parts[p.number] == 0) return;  // absent
  const auto [low, high] = p.options().slice_range.value();
  const double value = p.field({slice_point(p.options(), p.grid(), p.x(), p.y())}).front(),
               grey = high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0;
  take(check, grey, static_cast<double>(p.picture.bounds.lo.values[3 * p.number]) - 0x1p-23,
       static_cast<double>(p.picture.bounds.hi.values[3 * p.number]) + 0x1p-23);
}

/// What a value between two of a row's may rise above both, as second differences tell: an estimate.
double rise(const std::vector<double>& values) {
  double most = 0;
  for (std::size_t i = 1; i + 1 < values.size(); ++i)
    most = std::max(most, std::abs(values[i - 1] - 2 * values[i] + values[i + 1]));
  return most;
}

void check_maximum(const RandomPixel& p, RayCheck& check) {
  const RaySteps steps = p.ray();
  if (steps.points.empty() || std::isnan(p.picture.maxima.low.values[p.number])) return;
  // Both ends too: the largest value may lie where the region does.
  std::vector<Vec3> points{steps.at(steps.first)};
  for (const Vec3& point : steps.points) points.push_back(point);
  points.push_back(steps.at(steps.last));
  const std::vector<double> values = p.field(points);
  take(check, *std::max_element(values.begin(), values.end()),
       static_cast<double>(p.picture.maxima.low.values[p.number]) - rise(values),
       static_cast<double>(p.picture.maxima.high.values[p.number]));
}

/// By midpoints; what steps three times as long are off is an estimate of what these are.
void check_integral(const RandomPixel& p, RayCheck& check) {
  const RaySteps steps = p.ray();
  if (steps.points.empty()) return;
  const std::vector<double> values = p.field(steps.points);
  double fine = 0, coarse = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    fine += values[k] * steps.length;
    if (k % 3 == 1) coarse += values[k] * 3 * steps.length;
  }
  take(check, fine, static_cast<double>(p.picture.integrals.low.values[p.number]) - std::abs(fine - coarse),
       static_cast<double>(p.picture.integrals.high.values[p.number]) + std::abs(fine - coarse));
}

/// Whether F comes to the value before `last`, where it is surely on one side, or as near to it from there as
/// it moves between two places.
bool meets(const Field& field, const RaySteps& steps, const std::vector<double>& values, double last,
           double value, double moves) {
  const double end = field({steps.at(last)}).front(), side = end < value ? 1 : -1;
  double other = side * (end - value);
  for (std::size_t k = 0; k < values.size(); ++k)
    if (steps.first + (static_cast<double>(k) + 0.5) * steps.length < last)
      other = std::max(other, side * (values[k] - value));
  return other >= -moves;
}

void check_crossing(const RandomPixel& p, RayCheck& check) {
  const RaySteps steps = p.ray();
  if (steps.points.empty()) return;
  const int hit = p.picture.surface.hit[p.number];
  const double value = p.options().surfaces.front().value,
               first = hit == 0 ? steps.last : static_cast<double>(p.picture.surface.first.values[p.number]);
  const std::vector<double> values = p.field(steps.points);
  // The most that F moves from one place to the next, as neighbours show.
  double moves = 0;
  for (std::size_t k = 1; k < values.size(); ++k)
    moves = std::max(moves, std::abs(values[k] - values[k - 1]));
  if (!(first > steps.first)) {  // the side is unknown on which F begins
    if (hit == 2 && !meets(p.field, steps, values,
                           static_cast<double>(p.picture.surface.last.values[p.number]), value, moves))
      ++check.outside;
    return;
  }
  const double side = values.front() < value ? 1 : -1;
  bool early = false;
  for (std::size_t k = 0; k < values.size(); ++k)
    early |= steps.first + (static_cast<double>(k) + 0.5) * steps.length < first &&
             !(side * (values[k] - value) < 0);
  bool reached = hit != 2;
  if (hit == 2) {
    const double last = static_cast<double>(p.picture.surface.last.values[p.number]);
    // The end of the band is rounded to float32: four units of it.
    reached =
        side * (p.field({steps.at(last)}).front() - value) >= -4 * 0x1p-23 * last * moves / steps.length;
  }
  if (early || !reached) ++check.outside;
}

}  // namespace

bool is_told_by_the_host(const PictureRecord& record) {
  const RenderOptions& o = record.options;
  return o.mode != RenderMode::dvr || !o.shading || record.lit ||
         (o.gradient == GradientKind::central && o.sampler == SamplerKind::buffer);
}

RayCheck check_rays(const CertifiedPicture& picture, const MixedVolume& volume,
                    const std::pair<float, float>& value_range, const ProjectionSet& scan,
                    const FieldOptions& options, std::int64_t rays, const Progress& progress) {
  const ExactField exact(scan, options, progress);
  const Field field = [&](const std::vector<Vec3>& points) { return exact.at(points); };
  const RenderOptions& o = picture.record.options;
  const auto pixels = static_cast<std::size_t>(o.width * o.height);
  std::vector<std::size_t> crossing;
  for (std::size_t i = 0; i < pixels; ++i)
    if (o.mode == RenderMode::iso ? picture.surface.hit[i] > 0 : picture.bounds.parts[i] > 0)
      crossing.push_back(i);
  std::mt19937_64 random(2024);
  RayCheck check;
  for (; check.rays < rays; ++check.rays) {
    throw_if_stopped();
    report(progress, "rays", static_cast<double>(check.rays) / static_cast<double>(rays));
    const bool any = crossing.empty() || check.rays % 2 == 1;
    const std::size_t i = any ? random() % pixels : crossing[random() % crossing.size()];
    const auto one = o.mode == RenderMode::iso        ? check_crossing
                     : o.mode == RenderMode::mip      ? check_maximum
                     : o.mode == RenderMode::integral ? check_integral
                     : o.mode == RenderMode::slice    ? check_grey
                                                      : check_colours;
    one({field, picture, volume, value_range, i}, check);
  }
  return check;
}

}  // namespace vdvr
