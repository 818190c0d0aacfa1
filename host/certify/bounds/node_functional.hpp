// What a sum over nodes errs on band-limited functions: the bounds behind gold_filters.cpp, six_taps.cpp and
// remainder_norms.cpp, which call it.
#pragma once

#include <cstddef>
#include <vector>

namespace vdvr {

/// sum_i taps[i] f(first + i), which stands for the derivative of even order `order` of f at 0. Unit of
/// length: the nodes' spacing. On the wave exp(i kappa x) it errs by its *symbol error*
///   e(kappa) = sum_i taps[i] exp(i kappa (first + i)) - (i kappa)^order ,
/// kappa in radians a node. So `first` is minus the place at which the derivative is wanted, counted from
/// the first tap's node.
struct NodeFunctional {
  std::vector<double> taps;
  double first = 0;
  int order = 0;  // 0, 2 or 4
};

/// At least |e(kappa)|, by no more than the rounding of the sum.
double symbol_error(const NodeFunctional& functional, double kappa);

/// At least |e| on |kappa| <= band: the largest on a grid of frequencies, and what derivatives of e allow
/// between them. Cost: some 20,000 operations a tap.
double largest_symbol_error(const NodeFunctional& functional, double band);

/// A c with |error| <= c sup |f| for every bounded f of frequencies |kappa| <= band, however many: the sum of
/// the magnitudes of the Fourier coefficients of e times a smooth cut that is 1 on the band, by FFT, with
/// bounds of its tail and of aliasing (the better of two widths of the cut). Cost: two FFTs of length 1,024
/// and some 10,000 operations a tap.
double sup_constant(const NodeFunctional& functional, double band);

/// sup_constant() of its first moments, sum_i taps[i] (first + i)^n f(first + i), n = 0 .. count - 1. Of
/// order 0: only moment 0 stands for anything, f(0). At most most_moments. Moments' symbols are derivatives
/// of one another. Cost: one FFT each, and some 20,000 operations a tap.
std::vector<double> moment_sup_constants(const NodeFunctional& functional, double band, std::size_t count);
inline constexpr std::size_t most_moments = 17;

}  // namespace vdvr
