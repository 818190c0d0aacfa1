// What a filter between kept nodes errs on what a cone-beam view adds to F, which has no band limit in space
// (docs/error-bounds.md, section 16).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "host/certify/kept/gold_filters.hpp"

namespace vdvr {

/// Along a line of kept nodes, t nodes from the place that is filled, a view adds
///   f(t) = lambda^-2 (1 + rho t)^-2 g(t / (1 + rho t)) ,
/// where g is what the filtered view holds along a line, of at most `band` radians a node at that place, rho
/// is by how much lambda grows from node to node there, over lambda itself. In powers of rho,
///   f(t) = lambda^-2 sum over m, i of C(m + 1 + i, i) / m! (-rho)^(m + i) t^(2m + i) g^(m)(t) ,
/// and of each term the filter makes a sum over band-limited values, which sup_constant bounds.
class ProjectiveError {
 public:
  /// Bands for which constants are known, evenly spaced.
  static constexpr std::size_t bands = 24;
  /// Whose constants hold for `band`. At one place errors grow with bands and with |rho|.
  [[nodiscard]] static std::size_t place_of(double band, double highest);

  /// Of bands up to `highest`. Cost: 24 bands of moment_sup_constants for each pair of phases.
  ProjectiveError(const GoldFilter& filter, double highest);
  /// The same, for some bands only: elsewhere the error is infinite. Beyond `moments` magnitudes are taken: 1
  /// does for rho 0. Cost: as much less; none for phases that were asked for lately.
  ProjectiveError(const GoldFilter& filter, double highest, std::span<const double> for_bands,
                  std::size_t moments);
  /// At least |filtered - f| / (lambda^-2 sup |g|), at any phase. Infinite where `band` exceeds the highest
  /// or lambda vanishes among the taps.
  [[nodiscard]] double at(double band, double rho) const;
  [[nodiscard]] double highest() const { return highest_; }

 private:
  double highest_ = 0, reach_ = 0, norm_ = 0;
  std::vector<std::vector<double>> constants_;  // [band][moment]; none of a copy
};

/// Of a view at the places of a part of the covered region: lambda^-2 sup |q|, and band and rho there along
/// an axis.
struct ViewAtPart {
  double weight = 0, band = 0, rho = 0;
};
/// The sum over a part's views of what a filter errs.
double sum_of_errors(std::span<const ViewAtPart> part, const ProjectiveError& error);
/// At least that, by one evaluation for each band of the constants.
double most_of_errors(std::span<const ViewAtPart> part, const ProjectiveError& error);
/// At least the largest sum of all parts. Cost: bounds of all, sums of those that they do not rule out.
double largest_of_errors(std::span<const std::vector<ViewAtPart>> parts, const ProjectiveError& error);

}  // namespace vdvr
