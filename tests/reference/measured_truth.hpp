// Volumes of {least <= f <= largest} by brute force, in double precision: boxes are cut into eight until a
// range of f on each decides, or they are small. Shares nothing with host/measure.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "vdvr/expert/grid.hpp"
#include "vdvr/expert/measure.hpp"

namespace vdvr::reference {

struct TruthBox {
  Vec3 low{}, high{};

  [[nodiscard]] double volume() const { return (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]); }
};

/// All values of f on a box, or more.
using RangeOn = std::function<Interval(const TruthBox&)>;
/// -1: the box lies outside, 1: inside, 0: neither.
using PlaceOf = std::function<int(const TruthBox&)>;

/// An interval that holds the volume of {least <= f <= largest} in the boxes.
inline Interval truth_volume(const std::vector<TruthBox>& boxes, const RangeOn& f, const PlaceOf& place,
                             double least, double largest, int depth) {
  Interval sum;
  const auto add = [&](const auto& self, const TruthBox& box, int left) -> void {
    const int in = place(box);
    if (in < 0) return;
    const Interval r = f(box);
    if (r.hi < least || r.lo > largest) return;
    if (in > 0 && r.lo >= least && r.hi <= largest) {
      sum.lo += box.volume();
      sum.hi += box.volume();
      return;
    }
    if (left == 0) {
      sum.hi += box.volume();
      return;
    }
    for (int i = 0; i < 8; ++i) {
      TruthBox part = box;
      for (std::size_t a = 0; a < 3; ++a) {
        const double middle = 0.5 * (box.low[a] + box.high[a]);
        (((i >> a) & 1) != 0 ? part.low : part.high)[a] = middle;
      }
      self(self, part, left - 1);
    }
  };
  for (const TruthBox& box : boxes) add(add, box, depth);
  return sum;
}

/// A sum of waves a sin(k . x + phase), and what is known of it in closed form.
struct Waves {
  struct Wave {
    double height = 0, phase = 0;
    Vec3 k{};
  };
  std::vector<Wave> waves;

  [[nodiscard]] double operator()(const Vec3& p) const {
    double sum = 0;
    for (const Wave& w : waves)
      sum += w.height * std::sin(w.k[0] * p[0] + w.k[1] * p[1] + w.k[2] * p[2] + w.phase);
    return sum;
  }
  /// sup of the second derivative along an axis.
  [[nodiscard]] double curvature(std::size_t axis) const {
    double sum = 0;
    for (const Wave& w : waves) sum += std::abs(w.height) * w.k[axis] * w.k[axis];
    return sum;
  }
  /// Of every wave the value and the slope in the middle of a box, and half the square of its phase's reach.
  [[nodiscard]] Interval range(const TruthBox& box) const {
    double middle = 0, reach = 0;
    Vec3 slope{};
    for (const Wave& w : waves) {
      double phase = w.phase, far = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        phase += w.k[a] * 0.5 * (box.low[a] + box.high[a]);
        far += std::abs(w.k[a]) * 0.5 * (box.high[a] - box.low[a]);
      }
      middle += w.height * std::sin(phase);
      for (std::size_t a = 0; a < 3; ++a) slope[a] += w.height * w.k[a] * std::cos(phase);
      reach += std::abs(w.height) * far * far / 2;
    }
    for (std::size_t a = 0; a < 3; ++a) reach += std::abs(slope[a]) * 0.5 * (box.high[a] - box.low[a]);
    return {middle - reach, middle + reach};
  }
  /// The integral over a box: of each wave a product of three sines.
  [[nodiscard]] double integral(const TruthBox& box) const {
    double sum = 0;
    for (const Wave& w : waves) {
      double phase = w.phase, product = w.height;
      for (std::size_t a = 0; a < 3; ++a) {
        const double half = 0.5 * (box.high[a] - box.low[a]);
        phase += w.k[a] * 0.5 * (box.low[a] + box.high[a]);
        product *= w.k[a] == 0 ? 2 * half : 2 * std::sin(w.k[a] * half) / w.k[a];
      }
      sum += product * std::sin(phase);
    }
    return sum;
  }
};

}  // namespace vdvr::reference
