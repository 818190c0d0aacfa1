#include "host/volume/result_units.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vdvr {
namespace {

// What rounds below the normal numbers rounds up: a bound stays one.
void scale_bounds(std::vector<float>& bounds, int exponent) {
  for (float& bound : bounds) {
    if (bound < 0) continue;  // not tested
    const float scaled = std::ldexp(bound, exponent);
    bound = std::ldexp(scaled, -exponent) < bound ? std::nextafter(scaled, INFINITY) : scaled;
  }
}

}  // namespace

void scale(ErrorBudget& b, int exponent) {
  for (ErrorTerm* term : {&b.grid, &b.gold, &b.projection, &b.arithmetic, &b.sampler.buffer})
    term->value = std::ldexp(term->value, exponent);
  if (b.sampler.image3d) b.sampler.image3d->value = std::ldexp(b.sampler.image3d->value, exponent);
  scale_bounds(b.sampler.image3d_by_brick, exponent);
}

void scale(std::vector<Bound>& bounds, int exponent) {
  for (Bound& b : bounds) b.value = std::ldexp(b.value, exponent);
}

void scale(MixedVolume& volume, int exponent) {
  if (exponent == 0) return;
  for_each_block(volume, [&](SampleBlock& block) { scale(block.f32, exponent); });
  volume.step = std::ldexp(volume.step, exponent);
}

Certificate to_world(Certificate c, const Units& units) {
  // `covered` was taken from the scan as it is, in world units.
  const int density = units.density();
  for (double* value : {&c.epsilon_abs, &c.reference_range, &c.measured_max, &c.measured_total})
    *value = to_world(*value, units);
  scale(c.budget, density);
  scale(c.bounds, density);
  scale_bounds(c.brick_totals, density);
  // The largest of the bricks' is the volume's: where they were rounded up, so is that.
  double more = 0;
  for (const float total : c.brick_totals)
    more = std::max(more, static_cast<double>(total) * (1 - 0x1p-21) - c.measured_total);
  c.measured_total += more;
  charge_samplers(c, std::exchange(c.budget.sampler, {}));
  c.holds_buffer = c.holds_buffer && c.total_buffer <= c.epsilon_abs;
  if (c.total_image3d) c.holds_image3d = c.holds_image3d.value_or(false) && *c.total_image3d <= c.epsilon_abs;
  c.worst_at = to_world(c.worst_at, units);
  if (c.range_at)
    for (Vec3& place : *c.range_at) place = to_world(place, units);
  if (c.window) c.window = {to_world(c.window->first, units), to_world(c.window->second, units)};
  if (c.roi) c.roi = to_world(*c.roi, units);
  return c;
}

}  // namespace vdvr
