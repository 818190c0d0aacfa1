// Random lists of angles as instruments deliver them: ten kinds that see every direction, and as many that
// leave wedges. Degrees; `period` is 180 for parallel beam, 360 for cone beam.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace vdvr::testing {

using Angles = std::vector<double>;
using NamedAngles = std::vector<std::pair<std::string, Angles>>;

class AngleScans {
 public:
  AngleScans(unsigned seed, double period) : random_(seed), period_(period) {}

  /// All directions are seen, or as near to each other as the kind's own coarsest gaps are.
  NamedAngles whole() {
    return {{"turns", turns()},          {"drift", drift()},
            {"jitter", jitter()},        {"pauses", pauses()},
            {"bursts", bursts()},        {"golden angle", golden()},
            {"both ends", both_ends()},  {"dense and coarse", dense_and_coarse()},
            {"random", random_angles()}, {"few directions", few_directions()}};
  }
  /// At least a quarter of the period is missing, in one piece or several.
  NamedAngles with_wedges() {
    const double arc = between(0.15, 0.75) * period_;
    const std::int64_t views = whole_number(60, 400);
    const double step = arc / static_cast<double>(views);
    Angles stray = equal(arc, views), noisy = stray, turned, coarser;
    stray.push_back(arc + between(0.25, 0.75) * (period_ - arc));
    jolt(noisy, 0.3 * step);
    for (int turn = 0; turn < 3; ++turn) {
      Angles next = equal(arc, views);
      shift(next, normal(0.02));
      turned.insert(turned.end(), next.begin(), next.end());
    }
    for (double a = 0; a < arc; a += a < 0.5 * arc ? 0.25 * step : step) coarser.push_back(a);
    return {{"one wedge", equal(arc, views)}, {"with a stray view", stray},    {"with jitter", noisy},
            {"three turns", turned},          {"with a coarse part", coarser}, {"several wedges", several()}};
  }

 private:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::int64_t whole_number(std::int64_t low, std::int64_t high) {
    return std::uniform_int_distribution<std::int64_t>(low, high)(random_);
  }
  double normal(double deviation) { return std::normal_distribution<double>(0, deviation)(random_); }
  // Of any order of magnitude between 10^low and 10^high.
  double decade(double low, double high) { return std::pow(10.0, between(low, high)); }
  template <class T>
  T one_of(const std::vector<T>& all) {
    return all[static_cast<std::size_t>(whole_number(0, static_cast<std::int64_t>(all.size()) - 1))];
  }
  void shift(Angles& angles, double by) {
    for (double& a : angles) a += by;
  }
  void jolt(Angles& angles, double deviation) {
    for (double& a : angles) a += normal(deviation);
  }
  std::int64_t some_views() { return whole_number(20, 720); }
  // Both ends are views with `closed`.
  static Angles equal(double arc, std::int64_t n, bool closed = false) {
    Angles out;
    for (std::int64_t k = 0; k < n; ++k)
      out.push_back(arc * static_cast<double>(k) / static_cast<double>(closed ? n - 1 : n));
    return out;
  }

  // Whole turns, the encoder a little off at their end.
  Angles turns() {
    const double off = one_of<double>({0, between(-0.1, 0.1), between(0, 2)});
    const std::int64_t turns = whole_number(1, 7);
    return equal(period_ * static_cast<double>(turns) + off, std::max(some_views(), 20 * turns), true);
  }
  // Turn after turn, each a little later.
  Angles drift() {
    const std::int64_t rounds = whole_number(2, 7), n = whole_number(20, 200);
    const double step = one_of<double>({0, 0.01, 0.05, 0.3});
    Angles out;
    for (std::int64_t r = 0; r < rounds; ++r) {
      Angles next = equal(period_, n);
      shift(next, static_cast<double>(r) * step + normal(0.02));
      out.insert(out.end(), next.begin(), next.end());
    }
    return out;
  }
  Angles jitter() {
    const std::int64_t n = some_views();
    Angles out = equal(period_ * static_cast<double>(whole_number(1, 3)), n);
    jolt(out, decade(-4, -0.3) * period_ / static_cast<double>(n));
    return out;
  }
  // The stage stands still while views are taken.
  Angles pauses() {
    const Angles moving = equal(period_ * static_cast<double>(whole_number(1, 2)), some_views());
    Angles out = moving;
    for (std::int64_t p = whole_number(1, 4); p > 0; --p)
      out.insert(out.end(), static_cast<std::size_t>(whole_number(2, 200)), one_of(moving) + normal(0.01));
    jolt(out, decade(-6, -3));
    return out;
  }
  // Some views in fast succession, then a step.
  Angles bursts() {
    const std::int64_t steps = whole_number(8, 90), views = whole_number(2, 20);
    const double step = period_ / static_cast<double>(steps), filled = between(0.01, 0.6) * step;
    Angles out;
    for (std::int64_t s = 0; s < steps; ++s)
      for (std::int64_t v = 0; v < views; ++v)
        out.push_back(step * static_cast<double>(s) +
                      filled * static_cast<double>(v) / static_cast<double>(views));
    return out;
  }
  Angles golden() {
    const double golden_ratio = 0.5 * (std::sqrt(5.0) - 1);
    const double step = one_of<double>({180 * golden_ratio, 360 * golden_ratio, 360 * (1 - golden_ratio),
                                        137.508, 111.246, 68.754, 32.039, 23.628});
    Angles out;
    const std::int64_t n = some_views();
    for (std::int64_t k = 0; k < n; ++k) out.push_back(step * static_cast<double>(k));
    return out;
  }
  Angles both_ends() {
    Angles out = equal(period_ * static_cast<double>(whole_number(1, 2)), some_views(), true);
    jolt(out, one_of<double>({0, 1e-6, 1e-3}));
    return out;
  }
  Angles dense_and_coarse() {
    const double border = between(0.1, 0.9) * period_, step = decade(-1.3, 0),
                 coarse = std::min(step * between(2, 30), (period_ - border) / 8);
    Angles out;
    for (double a = 0; a < period_; a += a < border ? step : coarse) out.push_back(a);
    return out;
  }
  Angles random_angles() {
    Angles out(static_cast<std::size_t>(some_views()));
    for (double& a : out) a = between(0, 3 * period_);
    return out;
  }
  // A few directions, again and again. (Fewer than six ring at equal angles, too.)
  Angles few_directions() {
    const std::int64_t n = whole_number(6, 30), rounds = whole_number(1, 20);
    Angles out;
    for (std::int64_t r = 0; r < rounds; ++r) {
      const Angles next = equal(period_, n);
      out.insert(out.end(), next.begin(), next.end());
    }
    jolt(out, decade(-6, -3.5) * period_ / static_cast<double>(n));
    return out;
  }
  Angles several() {
    const std::int64_t wedges = whole_number(2, 5);
    Angles widths, out;
    double missing = 0;
    for (std::int64_t w = 0; w < wedges; ++w) {
      widths.push_back(between(0.07, 0.12) * period_);
      missing += widths.back();
    }
    const double step = (period_ - missing) / static_cast<double>(whole_number(80, 400));
    double at = 0;
    for (const double width : widths) {
      const double end = at + (period_ - missing) / static_cast<double>(wedges) * between(0.6, 1);
      for (; at < end; at += step) out.push_back(at);
      at += width;
    }
    return out;
  }

  std::mt19937_64 random_;
  double period_;
};

}  // namespace vdvr::testing
