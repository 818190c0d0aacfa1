// Tolerances in sigma; see vdvr/noise_forecast.hpp.
#include "vdvr/noise_forecast.hpp"

#include <algorithm>
#include <limits>

#include "host/certify/foresee.hpp"
#include "host/system/casts.hpp"
#include "host/volume/bricks.hpp"
#include "vdvr/certified_region.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// [bz][by][bx]: the least sigma of a brick's corners; infinite where no corner has any.
std::vector<float> least_of_bricks(const Volume& sigma, const Index3& bricks) {
  const Index3 n = sigma.grid.samples();
  std::vector<float> out(at(bricks[0] * bricks[1] * bricks[2]), std::numeric_limits<float>::infinity());
  for (std::int64_t z = 0; z < bricks[2]; ++z)
    for (std::int64_t y = 0; y < bricks[1]; ++y)
      for (std::int64_t x = 0; x < bricks[0]; ++x) {
        float& least = out[at((z * bricks[1] + y) * bricks[0] + x)];
        for (std::int64_t c = 0; c < 8; ++c) {
          const float s =
              sigma.samples[at(((z + (c >> 2)) * n[1] + y + ((c >> 1) & 1)) * n[0] + x + (c & 1))];
          if (s > 0) least = std::min(least, s);
        }
      }
  return out;
}

}  // namespace

SigmaRange sigma_range(const Volume& sigma, const ProjectionSet& scan, const FieldOptions& field) {
  const CertifiedRegion region(scan, field);
  const Index3 n = sigma.grid.samples();
  std::vector<float> covered;
  for (std::int64_t i = 0; i < sigma.grid.sample_count(); ++i)
    if (sigma.samples[at(i)] > 0 &&
        region.contains(sigma.grid.position({i % n[0], i / n[0] % n[1], i / n[0] / n[1]})))
      covered.push_back(sigma.samples[at(i)]);
  if (covered.empty())
    throw InputError("no sample of the grid is covered by the scan; change `origin`, `size` or `center`");
  std::sort(covered.begin(), covered.end());
  return {static_cast<double>(covered.front()), static_cast<double>(covered[covered.size() / 2]),
          static_cast<double>(covered.back())};
}

std::vector<SigmaForecast> foresee_in_sigma(const Plan& plan, const Volume& sigma,
                                            std::span<const double> multiples) {
  if (!plan.foresight || plan.estimated) return {};
  Foresight& foresight = *plan.foresight;
  const std::vector<float> least = least_of_bricks(sigma, Bricks(plan.grid, plan.layout.granularity).along());
  std::vector<SigmaForecast> out;
  for (const double multiple : multiples) {
    NodeTolerance tolerance(0, least);
    for (float& brick : tolerance.by_brick) {
      if (!(brick < std::numeric_limits<float>::infinity())) continue;
      const double wanted = multiple * static_cast<double>(brick) - plan.budget.arithmetic.value;
      // Below what rounding takes no tolerance is within reach: such a brick counts with the plan's.
      brick = static_cast<float>(from_world(wanted > 0 ? wanted : plan.epsilon_abs, foresight.units()));
      tolerance.of_all = std::max(tolerance.of_all, static_cast<double>(brick));
    }
    if (tolerance.of_all > 0) out.push_back({multiple, foresight.foresee(tolerance).samples_ratio});
  }
  return out;
}

}  // namespace vdvr
