// Fourth derivatives of a band-limited field from the fourth differences of its nodes.
#pragma once

namespace vdvr {

/// Functionals of `taps` nodes of one axis around a point (floor of its place - taps / 2 + 1, ...): a of
/// values, b of second and d of fourth central differences at those nodes, for the value, the second and the
/// fourth derivative at the point, wherever it lies between nodes. Unit of length: the nodes' spacing h of
/// the axis, so that derivatives carry h^2, h^4.
struct RemainderNorms {
  int taps = 0;
  double band = 0;  // radians a node
  /// Sums of magnitudes: |a|, |b|, |d|.
  double value = 0, second = 0, fourth = 0;
  /// Largest relative error of any of them on a wave of the band: a against 1, b against (i kappa)^2, d
  /// against kappa^4.
  double eta = 0;
  /// Absolute: |a f - f| <= value_sup sup |f|, |b delta^2 f - h^2 f''| <= second_sup sup |f|,
  /// |d delta^4 f - h^4 f''''| <= fourth_sup sup |f|, for every bounded f of the band.
  double value_sup = 0, second_sup = 0, fourth_sup = 0;
};

/// For every position: designed at some of [0, 1/2] (63 for 1e-4 at pi / 2), mirrored, the taps interpolated
/// linearly between them. Sums of magnitudes are the least, to .01, with an error of `eta`. That of the
/// result is what was reached: about the one asked for (below 1e-4 up to a tenth above), and 1.3 times the
/// least possible where `taps` cannot. Throws InputError unless 0 < band <= pi / 2, taps is even, 4 .. 32,
/// and 1e-5 <= eta <= .1. Cost: half a second of one core for 1e-4 at pi / 2, as the root of 1 / eta, on all
/// cores; kept for the next call with the same arguments.
RemainderNorms remainder_norms(double band, int taps = 16, double eta = 1e-4);

// At every point x, with the maxima over all nodes of the stencils,
//   h_j^4 |F_jjjj(x)|       <= pure_factor max |delta_j^4 F|            + tail ,
//   h_i^2 h_j^2 |F_iijj(x)| <= mixed_factor max |delta_i^2 delta_j^2 F| + tail .
// Arguments: the norms of the axes that are differentiated, then of the others.
double pure_factor(const RemainderNorms& along, const RemainderNorms& across, const RemainderNorms& other);
double mixed_factor(const RemainderNorms& first, const RemainderNorms& second, const RemainderNorms& across);

/// The tails by sups: this times sup |F| of a field band-limited along each axis.
double pure_tail(const RemainderNorms& along, const RemainderNorms& across, const RemainderNorms& other);
double mixed_tail(const RemainderNorms& first, const RemainderNorms& second, const RemainderNorms& across);

}  // namespace vdvr
