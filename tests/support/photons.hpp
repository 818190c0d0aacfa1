// Scans of counted photons, for tests of noise.
#pragma once

#include <cmath>
#include <random>

#include "vdvr/expert/projections.hpp"

namespace vdvr::testing {

/// -log of Poisson counts over the open beam's; a pixel without any counts half a photon.
inline ProjectionSet counted(const ProjectionSet& ideal, double photons, unsigned seed) {
  ProjectionSet scan = ideal;
  std::mt19937_64 random(seed);
  for (float& p : scan.data) {
    std::poisson_distribution<long> count(photons * std::exp(-static_cast<double>(p)));
    p = static_cast<float>(std::log(photons / std::max(0.5, static_cast<double>(count(random)))));
  }
  return scan;
}

}  // namespace vdvr::testing
