// Filters that take gold from its nodes to a finer lattice along one axis, each with its bounds.
#pragma once

#include <numbers>
#include <vector>

#include "host/certify/bounds/node_functional.hpp"

namespace vdvr {

/// Radians a node: filters are designed for no more.
inline constexpr double highest_gold_band = 0.75 * std::numbers::pi;
/// Positions between two nodes.
inline constexpr int most_gold_phases = 32;

/// One filter of `taps` weights for each position phase / rate between two nodes: the value there is
///   sum_i weights[phase * taps + i] f(first() + i),  nodes counted from the node on the left.
/// Phase 0 is a copy. weights at phase p and rate - p mirror each other to the bit. All that is said below
/// holds for the weights as rounded to fp32, evaluated exactly. Evaluated in fp32, a value errs by
/// (taps / 2 + 1) u norm times the largest |f| more.
struct GoldFilter {
  int rate = 1;                // positions to a node, phase 0 included
  int taps = 2;                // even
  double band = 0;             // radians a node, at most highest_gold_band
  std::vector<float> weights;  // [phase][taps]
  /// E: largest error of a wave |kappa| <= band, of its amplitude.
  double error = 0;
  /// c: |interpolant - f| <= c sup |f| for every bounded f of frequencies |kappa| <= band. Along three axes
  /// one after another: ((1 + c)^3 - 1) sup |f|, with the c of each axis.
  double sup = 0;
  /// L: largest sum of magnitudes of a phase, 1 for phase 0.
  double norm = 1;
  /// D2, D4: differences of the *interpolant* over neighbours on the finer lattice are at most this times the
  /// largest |f| at the nodes, whatever f there.
  double second_difference = 0, fourth_difference = 0;

  [[nodiscard]] int first() const { return 1 - taps / 2; }
};

/// The filter at a phase as a functional of its nodes, the one on the left at 0.
NodeFunctional functional(const GoldFilter& filter, int phase);

/// Nearly minimax over the band (iteratively reweighted least squares), in double precision, then rounded.
/// The weights add to 1 but for `error`. A band that fewer taps would do is widened to what these do with
/// 1e-8, before rounding: then `error` is that of the rounding, some 3e-8, and fewer taps have a smaller
/// norm. `rate` 1 is a copy: error and sup 0. Throws InputError unless rate is 1, 2, 4, 8, 16 or 32, 0 < band
/// <= 3/4 pi, and taps is even, 2 .. 32 (a single tap could not be mirrored; two are about linear
/// interpolation). Cost: some 2 ms a phase with 16 taps, of half the phases.
GoldFilter design_gold_filter(int rate, double band, int taps = 16);

}  // namespace vdvr
