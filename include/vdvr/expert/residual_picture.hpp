// The residuals of a detector row as a picture (docs/residual.md).
#pragma once

#include <cstdint>
#include <string>

#include "vdvr/api.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/residual.hpp"

namespace vdvr {

/// Columns across, views down, of one row: blue where F exceeds what was measured, red where it lacks some,
/// black dots in a grid where no interpolation explains it, with a scale, the rms by view and by column, and
/// a caption.
VDVR_API Image residual_picture(const Residual& residual, const ResidualSummary& summary, std::int64_t row,
                                const std::string& title);

}  // namespace vdvr
