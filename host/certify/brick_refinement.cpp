#include "host/certify/brick_refinement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "host/volume/result_units.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

BrickRefinement::BrickRefinement(const Refinement& wanted, const Units& units)
    : wanted_(wanted), units_(units), everywhere_(from_world(wanted.everywhere_abs, units)) {}

std::vector<double> BrickRefinement::bounds() const {
  std::vector<double> bounds;
  for (const float bound : wanted_.by_brick) bounds.push_back(from_world(static_cast<double>(bound), units_));
  return bounds;
}

void BrickRefinement::begin(double rest, double least) {
  if (knows_bricks()) take(wanted_.by_brick, rest, least, {});
}

bool BrickRefinement::asks(const MixedVolume& volume, const Certificate& certificate, double rest,
                           double least) {
  const std::vector<float> asked = [&] {
    if (!wanted_.ask) return wanted_.by_brick;
    if (units_.are_world()) return wanted_.ask(volume, certificate);
    MixedVolume in_world = volume;
    scale(in_world, units_.density());
    in_world.grid = to_world(volume.grid, units_);
    return wanted_.ask(in_world, to_world(certificate, units_));
  }();
  if (!asked.empty() && asked.size() != volume.level.size())
    throw InputError(fmt::format("refinement asks for {} bricks of {}", asked.size(), volume.level.size()));
  return !asked.empty() && take(asked, rest, least, certificate.brick_totals);
}

// Whether a brick's total lies above what is newly asked of it.
bool BrickRefinement::take(const std::vector<float>& asked, double rest, double least,
                           const std::vector<float>& totals) {
  if (by_brick_.empty()) by_brick_.assign(asked.size(), std::numeric_limits<float>::infinity());
  bool more = false;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const double bound = from_world(static_cast<double>(asked[i]), units_);
    const auto tolerance = static_cast<float>(std::max(bound - rest, least));
    if (!(tolerance < by_brick_[i])) continue;
    by_brick_[i] = tolerance;
    more = more || (!totals.empty() && totals[i] >= 0 && totals[i] > tolerance);
  }
  return more;
}

}  // namespace vdvr
