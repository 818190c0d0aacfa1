#include "host/picture/render/colour_space.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vdvr {
namespace {

constexpr Rgb kWhite{0.9505, 1.0, 1.089};  // D65, X Y Z

Rgb clamped(Rgb c) {
  for (double& x : c) x = std::clamp(x, 0.0, 1.0);
  return c;
}

Rgb lerp(const Rgb& a, const Rgb& b, double f) {
  Rgb c{};
  for (std::size_t i = 0; i < 3; ++i) c[i] = (1 - f) * a[i] + f * b[i];
  return c;
}

Rgb rgb_to_hsv(const Rgb& c) {
  const double high = std::max({c[0], c[1], c[2]}), low = std::min({c[0], c[1], c[2]}), span = high - low;
  if (!(span > 0)) return {0, 0, high};
  double h = 0;
  if (high == c[0]) h = (c[1] - c[2]) / span;
  else if (high == c[1]) h = 2 + (c[2] - c[0]) / span;
  else h = 4 + (c[0] - c[1]) / span;
  h /= 6;
  return {h < 0 ? h + 1 : h, span / high, high};
}

Rgb hsv_to_rgb(const Rgb& c) {
  const auto channel = [&](double n) {
    const double k = std::fmod(n + (c[0] - std::floor(c[0])) * 6, 6);
    return c[2] * (1 - c[1] * std::max(0.0, std::min({k, 4 - k, 1.0})));
  };
  return {channel(5), channel(3), channel(1)};
}

Rgb rgb_to_lab(const Rgb& c) {
  Rgb linear{};
  for (std::size_t i = 0; i < 3; ++i)
    linear[i] = c[i] > 0.04045 ? std::pow((c[i] + 0.055) / 1.055, 2.4) : c[i] / 12.92;
  const Rgb xyz{0.4124 * linear[0] + 0.3576 * linear[1] + 0.1805 * linear[2],
                0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2],
                0.0193 * linear[0] + 0.1192 * linear[1] + 0.9505 * linear[2]};
  Rgb f{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double t = xyz[i] / kWhite[i];
    f[i] = t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116;
  }
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

Rgb lab_to_rgb(const Rgb& lab) {
  const double fy = (lab[0] + 16) / 116;
  Rgb xyz{fy + lab[1] / 500, fy, fy - lab[2] / 200};
  for (std::size_t i = 0; i < 3; ++i) {
    const double cube = xyz[i] * xyz[i] * xyz[i];
    xyz[i] = kWhite[i] * (cube > 0.008856 ? cube : (xyz[i] - 16.0 / 116) / 7.787);
  }
  Rgb c{3.2406 * xyz[0] - 1.5372 * xyz[1] - 0.4986 * xyz[2],
        -0.9689 * xyz[0] + 1.8758 * xyz[1] + 0.0415 * xyz[2],
        0.0557 * xyz[0] - 0.2040 * xyz[1] + 1.0570 * xyz[2]};
  for (double& x : c) x = x > 0.0031308 ? 1.055 * std::pow(x, 1 / 2.4) - 0.055 : 12.92 * x;
  // Beyond the display: darker in the same proportions, as VTK does, and not cut, which would turn the hue.
  if (const double most = std::max({c[0], c[1], c[2]}); most > 1)
    for (double& x : c) x /= most;
  return clamped(c);
}

// Magnitude, saturation and hue: L*a*b* in polar coordinates around its lightness axis.
struct Msh {
  double m, s, h;
};

Msh lab_to_msh(const Rgb& lab) {
  const double m = std::hypot(lab[0], lab[1], lab[2]);
  const double s = m > 0.001 ? std::acos(lab[0] / m) : 0;
  return {m, s, s > 0.001 ? std::atan2(lab[2], lab[1]) : 0};
}

Rgb msh_to_lab(const Msh& c) {
  return {c.m * std::cos(c.s), c.m * std::sin(c.s) * std::cos(c.h), c.m * std::sin(c.s) * std::sin(c.h)};
}

// A hue for the unsaturated end, turned so that the path does not run through other hues.
double adjusted_hue(const Msh& saturated, double unsaturated_m) {
  if (saturated.m >= unsaturated_m - 0.1) return saturated.h;
  const double spin = saturated.s * std::sqrt(unsaturated_m * unsaturated_m - saturated.m * saturated.m) /
                      (saturated.m * std::sin(saturated.s));
  return saturated.h > -0.3 * std::numbers::pi ? saturated.h + spin : saturated.h - spin;
}

double angle_between(double a, double b) {
  const double d = std::fmod(std::abs(a - b), 2 * std::numbers::pi);
  return d > std::numbers::pi ? 2 * std::numbers::pi - d : d;
}

// The paper's thresholds: below 0.05 a colour counts as grey; hues more than 60 degrees apart pass by white.
Rgb mix_diverging(const Rgb& first, const Rgb& second, double f) {
  constexpr double grey = 0.05, white = 88;
  Msh a = lab_to_msh(rgb_to_lab(first)), b = lab_to_msh(rgb_to_lab(second));
  if (a.s > grey && b.s > grey && angle_between(a.h, b.h) > std::numbers::pi / 3) {
    const double middle = std::max({a.m, b.m, white});
    if (f < 0.5) {
      b = {middle, 0, 0};
      f *= 2;
    } else {
      a = {middle, 0, 0};
      f = 2 * f - 1;
    }
  }
  if (a.s < grey && b.s > grey) a.h = adjusted_hue(b, a.m);
  else if (b.s < grey && a.s > grey) b.h = adjusted_hue(a, b.m);
  return lab_to_rgb(msh_to_lab({(1 - f) * a.m + f * b.m, (1 - f) * a.s + f * b.s, (1 - f) * a.h + f * b.h}));
}

}  // namespace

Rgb to_space(ColourSpace space, const Rgb& rgb) {
  if (space == ColourSpace::hsv || space == ColourSpace::hsv_wrap) return rgb_to_hsv(rgb);
  if (space == ColourSpace::lab || space == ColourSpace::diverging) return rgb_to_lab(rgb);
  return rgb;
}

Rgb from_space(ColourSpace space, const Rgb& c) {
  if (space == ColourSpace::hsv || space == ColourSpace::hsv_wrap) return clamped(hsv_to_rgb(c));
  if (space == ColourSpace::lab || space == ColourSpace::diverging) return lab_to_rgb(c);
  return clamped(c);
}

Rgb mix(ColourSpace space, const Rgb& first, const Rgb& second, double f) {
  if (space == ColourSpace::step) return f > 0 ? second : first;
  if (space == ColourSpace::diverging) return mix_diverging(first, second, f);
  Rgb a = to_space(space, first), b = to_space(space, second);
  // The short way around the colour circle.
  if (space == ColourSpace::hsv_wrap && std::abs(a[0] - b[0]) > 0.5) (a[0] > b[0] ? b[0] : a[0]) += 1;
  return from_space(space, lerp(a, b, f));
}

}  // namespace vdvr
