// A foam: a body with spherical pores at random places that do not touch, so that their number, their volume
// and the porosity of any region are known.
#include <fmt/format.h>

#include <cmath>
#include <random>

#include "vdvr/error.hpp"
#include "vdvr/expert/simulate.hpp"

namespace vdvr {
namespace {

// Of the body's radius: pores' radii, and what lies between two at least.
constexpr double smallest = 0.02, largest_radius = 0.1, gap = 0.01;
// Places tried for a pore before the next, which may be smaller.
constexpr int tries = 2000;

// In [0, 1), of a generator that the standard defines to the bit; its distributions it does not.
double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

}  // namespace

Phantom foam(double radius, double half_height, int pores, std::uint64_t seed) {
  if (!(radius > 0) || !(half_height > 0)) throw InputError("a foam needs a radius and a height above 0");
  if (pores < 1 || pores > 100'000) throw InputError(fmt::format("pores: {}; give 1 to 100000", pores));
  std::mt19937_64 random(seed);
  // Twice as high, so that the body is there in every row; pores lie between the heights asked for.
  std::vector<Ellipsoid> list{{1, {0, 0, 0}, {radius, radius, 2 * half_height}, 0}};
  std::vector<std::pair<Vec3, double>> placed;
  const auto fits = [&](const Vec3& p, double r) {
    const double height = p[2] / (2 * half_height);
    if (std::hypot(p[0], p[1]) + r + gap * radius > radius * std::sqrt(1 - height * height)) return false;
    for (const auto& [q, s] : placed)
      if (std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) < r + s + gap * radius) return false;
    return true;
  };
  for (int tried = 0; static_cast<int>(placed.size()) < pores; ++tried) {
    if (tried == tries)
      throw InputError(
          fmt::format("pores: room for {} of {} was found; ask for fewer", placed.size(), pores));
    const double r = radius * smallest * std::pow(largest_radius / smallest, uniform(random));
    const double x = (2 * uniform(random) - 1) * radius, y = (2 * uniform(random) - 1) * radius,
                 z = (2 * uniform(random) - 1) * std::max(0.0, half_height - r);
    if (!fits({x, y, z}, r)) continue;
    placed.push_back({{x, y, z}, r});
    list.push_back({-1, {x, y, z}, {r, r, r}, 0});
    tried = -1;
  }
  return ellipsoid_list(std::move(list), 0, "foam");
}

}  // namespace vdvr
