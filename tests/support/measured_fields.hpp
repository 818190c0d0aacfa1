// Analytic fields and the mixed volumes sampled from them, with the distance between the two known brick by
// brick.
#pragma once

#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>

#include "tests/reference/measured_truth.hpp"
#include "tests/reference/mixed_field.hpp"
#include "tests/support/mixed_volumes.hpp"
#include "vdvr/expert/certificate.hpp"
#include "vdvr/expert/measure.hpp"

namespace vdvr::support {

/// Of a test: a few, or as many as VDVR_MEASURE_FIELDS says.
inline unsigned measured_fields(unsigned few) {
  const char* text = std::getenv("VDVR_MEASURE_FIELDS");
  return text == nullptr ? few : static_cast<unsigned>(std::stoul(text));
}

/// A certificate of these bounds by brick, that everything within a cylinder of this radius is covered.
inline Certificate bounds_certificate(std::vector<float> totals, double radius, double low, double high) {
  Certificate c;
  c.brick_totals = std::move(totals);
  c.covered = CoveredCylinder{radius, {low, high}};
  return c;
}

struct MeasuredCase {
  reference::Waves field;
  MixedVolume volume;
  Certificate certificate;
  std::mt19937 random;

  [[nodiscard]] reference::TruthBox brick_box(const Index3& brick) const {
    reference::TruthBox box;
    const Grid& g = volume.grid;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto first = static_cast<double>(brick[a] * volume.granularity);
      box.low[a] = g.origin[a] + first * g.spacing[a];
      box.high[a] =
          g.origin[a] +
          std::min<double>(first + volume.granularity, static_cast<double>(g.cells[a])) * g.spacing[a];
    }
    return box;
  }
  [[nodiscard]] std::vector<reference::TruthBox> bricks() const {
    std::vector<reference::TruthBox> boxes;
    const Index3 n = volume.bricks();
    for (std::int64_t i = 0; i < volume.brick_count(); ++i)
      boxes.push_back(brick_box({i % n[0], i / n[0] % n[1], i / (n[0] * n[1])}));
    return boxes;
  }
  [[nodiscard]] Vec3 cells_of(const Vec3& p) const {
    Vec3 c{};
    for (std::size_t a = 0; a < 3; ++a) c[a] = (p[a] - volume.grid.origin[a]) / volume.grid.spacing[a];
    return c;
  }
  /// e of the brick that holds a point.
  [[nodiscard]] double bound(const Vec3& p) const {
    const Vec3 c = cells_of(p);
    const Index3 n = volume.bricks();
    const std::int64_t b =
        (reference::brick_of(volume, 2, c[2]) * n[1] + reference::brick_of(volume, 1, c[1])) * n[0] +
        reference::brick_of(volume, 0, c[0]);
    return static_cast<double>(certificate.brick_totals[static_cast<std::size_t>(b)]);
  }
};

/// Waves over a small grid: random cells, spacings, origin, levels, coarsening. e is what trilinear
/// interpolation errs by, sum_j h_j^2 / 8 sup |F_jj|, and the rounding of samples.
inline MeasuredCase measured_case(unsigned seed, double steepness = 1) {
  MeasuredCase c;
  c.random.seed(seed);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(c.random);
  };
  Grid grid;
  for (std::size_t a = 0; a < 3; ++a) {
    grid.cells[a] = 2 * std::uniform_int_distribution<std::int64_t>(4, 6)(c.random);
    grid.spacing[a] = uniform(0.7, 1.4);
    grid.origin[a] = -0.5 * static_cast<double>(grid.cells[a]) * grid.spacing[a] + uniform(-0.3, 0.3);
  }
  for (int i = 0; i < 3; ++i) {
    reference::Waves::Wave w{uniform(0.3, 1), uniform(0, 6.3), {}};
    for (double& k : w.k) k = steepness * uniform(-0.6, 0.6);
    c.field.waves.push_back(w);
  }
  const LevelTriple coarse = seed % 3 == 0 ? LevelTriple{1, 0, 1} : LevelTriple{};
  const std::vector<LevelTriple> levels{{0, 0, 0}, {1, 1, 1}, {2, 1, 0}, {0, 2, 2}};
  c.volume = sampled_mixed(
      grid, 4, 8, levels, seed,
      [&](double x, double y, double z) {
        return c.field({grid.origin[0] + x * grid.spacing[0], grid.origin[1] + y * grid.spacing[1],
                        grid.origin[2] + z * grid.spacing[2]});
      },
      coarse);
  double height = 0;
  for (const auto& w : c.field.waves) height += w.height;
  std::vector<float> totals;
  for (const LevelTriple& l : c.volume.level) {
    double e = 0x1p-22 * height;
    for (std::size_t a = 0; a < 3; ++a) {
      const double h = std::ldexp(grid.spacing[a], c.volume.coarsening[2 - a] - l[2 - a]);
      e += h * h / 8 * c.field.curvature(a);
    }
    totals.push_back(std::nextafter(static_cast<float>(e), HUGE_VALF));
  }
  c.certificate = bounds_certificate(std::move(totals), 100, -100, 100);
  return c;
}

/// What is measured of it, in turn: everything, a ball, a cylinder with a box, a mask.
struct MeasuredPlace {
  MeasureRegion region;
  reference::PlaceOf place;
};
inline MeasuredPlace measured_place(const MeasuredCase& c, unsigned kind) {
  using reference::TruthBox;
  const Grid& g = c.volume.grid;
  const auto least = [](const TruthBox& b, const Vec3& center, std::size_t axes) {
    std::pair<double, double> d{0, 0};
    for (std::size_t a = 0; a < axes; ++a) {
      const double p = b.low[a] - center[a], q = b.high[a] - center[a];
      const double near = p > 0 ? p : q < 0 ? -q : 0, far = std::max(std::abs(p), std::abs(q));
      d.first += near * near;
      d.second += far * far;
    }
    return d;
  };
  switch (kind % 4) {
    case 1: {
      const RoundRegion ball{{0.2, -0.1, 0.3}, 3.3, false};
      return {
          {{}, {ball}, {}}, [=](const TruthBox& b) {
            const auto d = least(b, ball.center, 3);
            return d.first > ball.radius * ball.radius ? -1 : d.second <= ball.radius * ball.radius ? 1 : 0;
          }};
    }
    case 2: {
      const RoundRegion cylinder{{0.2, -0.4, 0}, 2.9, true};
      const std::array<double, 6> box{-2.1, -5, -1.7, 5, 1.9, 2.2};
      return {{box, {cylinder}, {}}, [=](const TruthBox& b) {
                const auto d = least(b, cylinder.center, 2);
                int in = d.first > cylinder.radius * cylinder.radius     ? -1
                         : d.second <= cylinder.radius * cylinder.radius ? 1
                                                                         : 0;
                for (std::size_t a = 0; a < 3; ++a) {
                  if (b.high[a] <= box[a] || b.low[a] >= box[a + 3]) in = -1;
                  else if (in > 0 && !(b.low[a] >= box[a] && b.high[a] <= box[a + 3])) in = 0;
                }
                return in;
              }};
    }
    case 3: {
      // Its samples lie in the middle of boxes of a cell and a half; every third is in.
      auto mask = std::make_shared<Volume>();
      for (std::size_t a = 0; a < 3; ++a) {
        mask->grid.cells[a] = 4;
        mask->grid.spacing[a] = 1.5 * g.spacing[a];
        mask->grid.origin[a] = g.origin[a] + 0.8 * g.spacing[a];
      }
      for (int i = 0; i < 125; ++i) mask->samples.push_back(i % 3 == 0 ? 1.0f : 0.0f);
      const Grid m = mask->grid;
      return {{{}, {}, mask}, [=](const TruthBox& b) {
                std::array<int, 3> first{}, last{};
                for (std::size_t a = 0; a < 3; ++a) {
                  first[a] =
                      static_cast<int>(std::floor((b.low[a] - m.origin[a]) / m.spacing[a] + 0.5 + 1e-12));
                  last[a] =
                      static_cast<int>(std::ceil((b.high[a] - m.origin[a]) / m.spacing[a] + 0.5 - 1e-12)) - 1;
                }
                bool any = false, all = true;
                for (int z = first[2]; z <= last[2]; ++z)
                  for (int y = first[1]; y <= last[1]; ++y)
                    for (int x = first[0]; x <= last[0]; ++x) {
                      const bool in = x >= 0 && y >= 0 && z >= 0 && x < 5 && y < 5 && z < 5 &&
                                      ((z * 5 + y) * 5 + x) % 3 == 0;
                      any = any || in;
                      all = all && in;
                    }
                return all ? 1 : any ? 0 : -1;
              }};
    }
    default:
      return {{}, [](const TruthBox&) { return 1; }};
  }
}

}  // namespace vdvr::support
