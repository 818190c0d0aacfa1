// Least cost under linear constraints: with a price lambda for each pixel the best bound of a brick is the
// power -2/5 of what its slopes cost. Prices rise where a pixel is above what it may be, and fall where it is
// not.
#include "host/picture/refine/spend.hpp"

#include <algorithm>
#include <cmath>

namespace vdvr {
namespace {

double used(const PixelDemand& demand, const std::vector<float>& bounds) {
  double sum = 0;
  for (const auto& [brick, slope] : demand.slopes)
    sum += static_cast<double>(slope) * static_cast<double>(bounds[brick]);
  return sum;
}

void bid(const std::vector<float>& most, const std::vector<PixelDemand>& demands,
         const std::vector<double>& prices, float finest, std::vector<float>& bounds) {
  std::vector<double> cost(most.size(), 0.0);
  for (std::size_t p = 0; p < demands.size(); ++p)
    for (const auto& [brick, slope] : demands[p].slopes)
      cost[brick] += prices[p] * static_cast<double>(slope);
  for (std::size_t b = 0; b < most.size(); ++b)
    bounds[b] = cost[b] > 0 ? std::min(most[b], std::max(finest, static_cast<float>(std::pow(cost[b], -0.4))))
                            : most[b];
}

}  // namespace

std::vector<float> spend(const std::vector<float>& most, const std::vector<PixelDemand>& demands,
                         double finest) {
  const auto least = static_cast<float>(finest);
  std::vector<float> bounds = most;
  if (demands.empty()) return bounds;
  // A price at which a pixel alone would be held, shared among those that see the same bricks.
  std::vector<double> prices;
  for (const PixelDemand& d : demands) {
    double power = 0;
    for (const auto& [brick, slope] : d.slopes) power += std::pow(static_cast<double>(slope), 0.6);
    prices.push_back(std::pow(power / d.allowed, 2.5) / 16);
  }
  constexpr int rounds = 60;
  constexpr double haste = 1.5;
  for (int round = 0; round < rounds; ++round) {
    bid(most, demands, prices, least, bounds);
    for (std::size_t p = 0; p < demands.size(); ++p)
      prices[p] *= std::pow(std::clamp(used(demands[p], bounds) / demands[p].allowed, 0.25, 4.0), haste);
  }
  // What prices left over.
  for (const PixelDemand& d : demands)
    if (const double over = used(d, bounds) / d.allowed; over > 1)
      for (const auto& [brick, slope] : d.slopes)
        bounds[brick] = std::min(
            bounds[brick], std::max(least, static_cast<float>(static_cast<double>(bounds[brick]) / over)));
  return bounds;
}

}  // namespace vdvr
