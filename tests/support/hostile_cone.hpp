// A hostile build of cone beam drawn from a seed: orbit, field and target of an attack on its bounds
// (cone_attacks.hpp), with a grid, options and units as builds of parallel beam get them (hostile_case.hpp).
// Called by hostile_builds.cpp.
#pragma once

#include "tests/support/cone_attacks.hpp"
#include "tests/support/hostile_case.hpp"
#include "vdvr/error.hpp"

namespace vdvr::hostile {
namespace detail {

/// Seeds of orbits that the library refuses are followed by others: `cone_attacks` counts refusals.
inline attacks::ConeCase draw_attack(std::uint64_t seed) {
  for (;; seed += 0x632be59bd9b4e019u) {
    try {
      return attacks::draw_cone_case(seed);
    } catch (const InputError&) {
    }
  }
}

/// A few cells, fewer where gold is fine, and one time in ten many. The target lies in the middle of a gold
/// cell, on a node, or anywhere between.
inline void draw_cone_grid(Random& random, Case& c) {
  const ParallelGeometry& g = c.scan.geometry;
  const int gold = c.rates.gold.value_or(8), wide = gold > 8 ? 2 : chance(random, 0.1) ? 12 : 5;
  for (std::size_t a = 0; a < 3; ++a)
    c.grid.cells[a] =
        std::uniform_int_distribution<std::int64_t>(1, a == 2 ? std::max(1, wide / 2) : wide)(random);
  const double across = one_of(random, {0.4, 0.7, 1.0, 1.0, 1.3, 2.0}) * g.pitch_u,
               up = one_of(random, {0.4, 0.7, 1.0, 1.0, 1.6}) * (g.rows > 1 ? g.pitch_v : g.pitch_u);
  c.grid.spacing = {across, across, up};
  const double part = one_of(random, {0.0, 0.5, unit(random)});
  for (std::size_t a = 0; a < 3; ++a)
    c.grid.origin[a] = c.target[a] - (static_cast<double>(c.grid.cells[a] * gold / 2) + part) / gold *
                                         c.grid.spacing[a];  // NOLINT
  // Of a fan only the plane of its rows is covered.
  if (g.rows == 1 && chance(random, 0.5)) c.grid.origin[2] = -0.5 * c.grid.spacing[2];
  draw_base(random, c);
  draw_region_and_window(random, c);
}

}  // namespace detail

/// The case that a seed stands for, the same in every run.
inline Case draw_cone(std::uint64_t seed) {
  using namespace detail;
  Random random(seed * 0x9e3779b97f4a7c15u + 5);
  const attacks::ConeCase attack = draw_attack(seed);
  Case c;
  c.name = attack.orbit + "; " + attack.field + "; target: " + attack.place;
  c.scan = attack.scan;
  c.target = attack.target;
  draw_options(random, c);
  c.rates.upsampling.reset();  // of cone beam the detector's filter is what it is
  c.rates.interpolation.reset();
  draw_cone_grid(random, c);
  find_range(c);
  if (chance(random, 0.5)) {
    const bool exact = chance(random, 0.5);
    c.scale.pitch_u = c.scale.pitch_v = draw_factor(random, 12, exact);
    c.scale.density = draw_factor(random, 36, exact);
    if (!exact && chance(random, 0.5)) c.options.storage = StorageChoice::f32;
  }
  if (chance(random, 0.25) && c.settings.comparison.closing != Closing::paper) c.sigma_seed = random();
  return c;
}

}  // namespace vdvr::hostile
