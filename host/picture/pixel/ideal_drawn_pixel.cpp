// A pixel of the ideal picture of F under the light that V was drawn with (docs/pixel-bounds.md, section 7).
// The device finds that light in fp32, so here it is a range: of gradients that its rounding may give.
#include <algorithm>
#include <cmath>

#include "host/picture/pixel/pixel_ray.hpp"
#include "host/picture/rays/light_range.hpp"
#include "vdvr/expert/certify_picture.hpp"

namespace vdvr {
namespace {

constexpr double unit_roundoff = 0x1p-24;

/// V's differences over one base cell at a point, as far as fp32 tells.
class DrawnGradient {
 public:
  /// `far`: the longest way from an eye, world units.
  DrawnGradient(const MixedVolume& volume, double largest, double far) : volume_(volume), largest_(largest) {
    const Grid& g = volume.grid;
    // Direction and entry of a ray, products along it, and a place in the grid: 32 u of all lengths.
    double sides = 0;
    for (std::size_t a = 0; a < 3; ++a) sides += static_cast<double>(g.cells[a]) * g.spacing[a];
    place_ = 32 * unit_roundoff * (far + sides);
  }

  [[nodiscard]] GradientBox at(const Vec3& point) const {
    const Grid& g = volume_.grid;
    GradientBox box;
    for (std::size_t a = 0; a < 3; ++a) {
      // One-sided at the grid's faces.
      const double end = g.origin[a] + static_cast<double>(g.cells[a]) * g.spacing[a];
      Vec3 low = point, high = point;
      low[a] = std::max(point[a] - 0.5 * g.spacing[a], g.origin[a]);
      high[a] = std::min(point[a] + 0.5 * g.spacing[a], end);
      const auto [below, below_moves] = value(low);
      const auto [above, above_moves] = value(high);
      const double width = (high[a] - low[a]) / length_unit(g),
                   rounding = 16 * unit_roundoff * std::abs(above - below) + below_moves + above_moves;
      box.low[a] = (above - below - rounding) / width;
      box.high[a] = (above - below + rounding) / width;
    }
    return box;
  }

 private:
  /// V, and how far the device's may be from it: 14 u of the largest sample for either sampler, and what V
  /// does within the place's rounding.
  [[nodiscard]] std::pair<double, double> value(const Vec3& point) const {
    const auto v = [&](const Vec3& p) { return static_cast<double>(sample_at(volume_, p)); };
    const double here = v(point);
    double moves = 28 * unit_roundoff * largest_;
    for (std::size_t a = 0; a < 3; ++a) {
      double most = 0;
      for (const double s : {-place_, place_}) {
        Vec3 beside = point;
        beside[a] += s;
        most = std::max(most, std::abs(v(beside) - here));
      }
      moves += most;
    }
    return {here, moves};
  }

  const MixedVolume& volume_;
  double largest_, place_ = 0;
};

LightRange either(const LightRange& a, const LightRange& b) {
  const auto least = [](const Light& x, const Light& y) {
    return Light{std::min(x.strength, y.strength), std::min(x.diffuse, y.diffuse),
                 std::min(x.highlight, y.highlight)};
  };
  const auto most = [](const Light& x, const Light& y) {
    return Light{std::max(x.strength, y.strength), std::max(x.diffuse, y.diffuse),
                 std::max(x.highlight, y.highlight)};
  };
  return {least(a.least, b.least), most(a.most, b.most)};
}

struct Seen {
  std::array<double, 3> low{}, high{};
};
Seen seen_under(const std::vector<double>& values, const std::vector<LightRange>& lights, std::size_t stride,
                double length, const RenderOptions& o, std::int64_t y) {
  Seen w{background_of_pixel(o, y), background_of_pixel(o, y)};
  for (std::size_t i = values.size(); i-- > 0;) {
    if (i % stride != stride / 2) continue;
    const TransferPoint p = transfer_at(o.transfer.points, values[i]);
    const double passes = std::pow(1 - p.opacity, length * static_cast<double>(stride));
    for (std::size_t c = 0; c < 3; ++c) {
      const auto [low, high] = lit_colours(p.rgb[c], p.rgb[c], lights[i]);
      w.low[c] = low + (w.low[c] - low) * passes;
      w.high[c] = high + (w.high[c] - high) * passes;
    }
  }
  return w;
}

/// Of each step of `s` the light of the interval of the drawn step that it lies in, or of both.
std::vector<LightRange> lights_of(const RaySteps& s, const MixedVolume& volume,
                                  const std::pair<float, float>& value_range, const RenderOptions& o) {
  const Lights lights(o, full_gradient(value_range));
  const double largest = std::max(std::abs(static_cast<double>(value_range.first)),
                                  std::abs(static_cast<double>(value_range.second)));
  const DrawnGradient gradient(volume, largest, s.last);
  const double drawn = o.step * length_unit(volume.grid), whole = s.last - s.first;
  const auto intervals = static_cast<std::size_t>(std::floor(whole / drawn)) + 1;
  std::vector<LightRange> of_interval;
  for (std::size_t k = 0; k < intervals; ++k) {
    // The last lies in the middle of the path that is left.
    const double from = static_cast<double>(k) * drawn, end = std::min(from + drawn, whole);
    of_interval.push_back(lights.over(gradient.at(s.at(s.first + 0.5 * (from + end))), s.direction));
  }
  const auto interval_of = [&](double t) {
    return std::min(static_cast<std::size_t>(std::max(t, 0.0) / drawn), intervals - 1);
  };
  std::vector<LightRange> ranges;
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    const double hair = 0x1p-16 * drawn, from = static_cast<double>(i) * s.length;
    ranges.push_back(
        either(of_interval[interval_of(from - hair)], of_interval[interval_of(from + s.length + hair)]));
  }
  return ranges;
}

}  // namespace

IdealPixel ideal_drawn_pixel(const std::function<std::vector<double>(const std::vector<Vec3>&)>& field,
                             const MixedVolume& volume, const std::pair<float, float>& value_range,
                             const RenderOptions& o, std::int64_t x, std::int64_t y, double step) {
  const RaySteps s = steps_of_pixel(o, volume.grid, x, y, step);
  IdealPixel pixel;
  pixel.points = s.points.size();
  pixel.rgb = background_of_pixel(o, y);
  if (s.points.empty()) return pixel;
  const std::vector<double> values = field(s.points);
  const std::vector<LightRange> lights = lights_of(s, volume, value_range, o);
  const double length = s.length / length_unit(volume.grid);
  const Seen fine = seen_under(values, lights, 1, length, o, y),
             coarse = seen_under(values, lights, 3, length, o, y);
  for (std::size_t c = 0; c < 3; ++c) {
    pixel.rgb[c] = 0.5 * (fine.low[c] + fine.high[c]);
    pixel.light = std::max(pixel.light, 0.5 * (fine.high[c] - fine.low[c]));
    pixel.quadrature = std::max(pixel.quadrature,
                                0.5 * std::abs(coarse.low[c] + coarse.high[c] - fine.low[c] - fine.high[c]));
  }
  return pixel;
}

}  // namespace vdvr
