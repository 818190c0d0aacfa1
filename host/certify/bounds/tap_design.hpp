// Taps on nodes that reproduce a value or a derivative on a band: of least error (gold_filters.cpp), or of
// least norm at a given error (remainder_norms.cpp). Proposals: what taps err is bounded by node_functional.
#pragma once

#include <vector>

namespace vdvr {

/// Taps on the nodes 1 - taps / 2 .. taps / 2 for the position `place` between nodes 0 and 1. They are to
/// approximate 1, or, of central differences of even `order` at the nodes, the derivative:
///   r(kappa) = sum_n h_n exp(i kappa (n - place)) (2 sin(kappa / 2) / kappa)^order - 1 ,
/// with |r| small on |kappa| <= band, kappa in radians a node.
struct TapTask {
  int taps = 0;
  double place = 0, band = 0;
  int order = 0;  // 0, 2 or 4
};

/// Nearly minimax, by Lawson's reweighted least squares with a ridge; or as soon as |r| <= `enough` on a grid
/// of frequencies. Cost: about 2 ms for 16 taps, less if something is enough.
std::vector<double> least_error_taps(const TapTask& task, double enough = 0);

/// Least sum |h_n|, to .01, with |r| <= eta on a grid of frequencies, from `start`, whose |r| is below eta;
/// by Newton's method on a logarithmic barrier. Cost: about 1 ms for 16 taps.
std::vector<double> least_norm_taps(const TapTask& task, double eta, const std::vector<double>& start);

/// At least |r| of taps on the whole band: the largest on a grid, and what its second derivative allows
/// between. Cost: 2,048 frequencies.
double relative_error(const TapTask& task, const std::vector<double>& taps);

}  // namespace vdvr
