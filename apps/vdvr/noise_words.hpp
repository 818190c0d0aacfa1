// The noise of a scan and of F, as `info` and `plan` tell it.
#pragma once

#include <optional>
#include <vector>

#include "apps/vdvr/certify.hpp"
#include "apps/vdvr/inputs.hpp"
#include "vdvr/expert/noise.hpp"
#include "vdvr/expert/noise_forecast.hpp"

namespace vdvr::cli {

Json noise_json(const NoiseFound& found);
void print_noise(const NoiseFound& found);

/// What F is worth on a plan's grid, and what tolerances in sigma would store.
struct FieldNoise {
  SigmaRange sigma;
  std::optional<double> sigmas;  ///< asked for by --epsilon
  std::optional<SplitOfViews> split;
  std::vector<SigmaForecast> forecasts;
  std::optional<RingNoise> rings;  ///< of the flats
};
std::optional<FieldNoise> noise_of_plan(Device& device, const Planned& planned, const Progress& progress);
Json field_noise_json(const FieldNoise& noise, const Plan& plan);
void print_field_noise(const FieldNoise& noise, const Plan& plan);

}  // namespace vdvr::cli
