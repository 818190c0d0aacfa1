// How far a drawn picture can lie from the ideal one.
#include <algorithm>
#include <cmath>

#include "vdvr/error.hpp"
#include "vdvr/expert/certify_picture.hpp"

namespace vdvr {
namespace {

double shown(float x) { return 255 * std::clamp(static_cast<double>(x), 0.0, 1.0); }

/// The largest distance of the ideal byte from the drawn one over the channels of pixel i.
double bytes_off(const PixelBounds& b, const Image& drawn, std::size_t i) {
  double most = 0;
  for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
    const double d = drawn.rgb[c];
    most = std::max({most, std::round(shown(b.hi.values[c])) - d, d - std::round(shown(b.lo.values[c]))});
  }
  return most;
}

void check_size(const PixelBounds& b, const Image& drawn) {
  if (drawn.rgb.size() != b.lo.values.size())
    throw InputError("the picture and the bounds of its pixels are not of one size");
}

}  // namespace

double share_within(const PixelBounds& b, const Image& drawn, double levels) {
  check_size(b, drawn);
  const std::size_t pixels = b.parts.size();
  std::size_t within = 0;
  for (std::size_t i = 0; i < pixels; ++i) within += bytes_off(b, drawn, i) <= levels ? 1U : 0U;
  return pixels == 0 ? 1 : static_cast<double>(within) / static_cast<double>(pixels);
}

PictureBound bound_of_picture(const PixelBounds& b, const Image& drawn) {
  check_size(b, drawn);
  PictureBound r;
  r.levels = FloatImage{drawn.width, drawn.height, {}, 1};
  r.pixels = static_cast<std::int64_t>(b.parts.size());
  double sum = 0, half = 0, parts = 0;
  for (std::size_t i = 0; i < b.parts.size(); ++i) {
    double level = 0, width = 0;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
      const double d = drawn.rgb[c], lo = shown(b.lo.values[c]), hi = shown(b.hi.values[c]);
      level = std::max({level, hi - d, d - lo});
      width = std::max(width, (hi - lo) / 2);
    }
    if (level > r.max || i == 0) {
      r.max = level;
      r.worst = {static_cast<std::int64_t>(i) % drawn.width, static_cast<std::int64_t>(i) / drawn.width};
    }
    sum += level;
    half += width;
    parts += b.parts[i];
    r.background += b.parts[i] == 0 ? 1 : 0;
    r.untested += b.untested[i];
    r.levels.values.push_back(static_cast<float>(level));
  }
  const double n = std::max<double>(1, static_cast<double>(r.pixels));
  r.mean = sum / n;
  r.half_width_mean = half / n;
  r.parts_mean = parts / n;
  std::vector<float> sorted = r.levels.values;
  if (!sorted.empty()) {
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(std::ceil(0.99 * n)) - 1;
    std::nth_element(sorted.begin(), at, sorted.end());
    r.p99 = static_cast<double>(*at);
  }
  for (auto& [levels, share] : r.within) share = share_within(b, drawn, levels);
  return r;
}

}  // namespace vdvr
