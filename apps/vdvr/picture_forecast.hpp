// What `plan` says of a build that is refined for pictures.
#pragma once

#include <optional>

#include "apps/vdvr/certify.hpp"

namespace vdvr::cli {

/// None, unless refined for some.
std::optional<PictureForecast> picture_forecast(Device& device, const Planned& planned, const Wanted& wanted,
                                                const Progress& progress);
Json forecast_json(const PictureForecast& forecast, const Plan& plan);
void print_forecast(const PictureForecast& forecast, const Plan& plan);

}  // namespace vdvr::cli
