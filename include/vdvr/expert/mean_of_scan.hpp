// The mean of F over a region by the projections themselves, and what their noise leaves in it
// (docs/measure.md, "Sigma of means"):
//
//   mean = sum_i c_i p_i,   var = sum_i c_i^2 v_i + sum_j (sum_k c_jk)^2 v_flat_j,
//
// i over samples, j over pixels, k over views. No volume is in it, so that it is far nearer to F's mean than
// V's interval tells; but it is computed in double precision, and bounds nothing.
#pragma once

#include <cstdint>
#include <optional>

#include "vdvr/expert/line_noise.hpp"

namespace vdvr {

/// What is known of the noise of the scan's samples.
struct MeanNoise {
  std::optional<LineIntegralNoise> model;  ///< as read_scan_noise() has it
  std::int64_t flats = 0;                  ///< averaged for its line integrals; 0: none, or not known
};

struct MeanOfScan {
  double mean = 0;              ///< density units
  std::optional<double> sigma;  ///< its standard deviation, an estimate; none without a model
  double of_flats = 0;          ///< the share of sigma^2 that the flats' own noise has
};

}  // namespace vdvr
