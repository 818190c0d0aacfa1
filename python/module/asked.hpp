// A tolerance as Python states it, and what it is held to.
#pragma once

#include <optional>
#include <string>

#include "vdvr/error.hpp"
#include "vdvr/noise_forecast.hpp"

namespace vdvr::python {

struct Asked {
  Tolerance tolerance;
  std::optional<double> sigmas;  ///< of the scan's own noise, brick by brick; then `tolerance` says nothing
  NoiseOptions noise;            ///< in place of what the scan tells
};

/// Of a tolerance in sigma; throws InputError where the noise is neither stated nor found.
inline ScanNoise known_noise(const ProjectionSet& scan, const Asked& asked) {
  std::string why;
  if (auto noise = scan_noise(scan, asked.noise, {}, &why)) return std::move(*noise);
  throw InputError("epsilon in sigma needs the scan's noise, and none is known: " + why +
                   "; state it by photons= or sigma_p=, or give a tolerance such as '3%'");
}

}  // namespace vdvr::python
