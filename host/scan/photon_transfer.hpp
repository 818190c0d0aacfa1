// What repeated flats and darks say of a pixel's noise (photon transfer: Janesick, SPIE Press 2007).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host/scan/raw/raw_scan.hpp"
#include "vdvr/expert/line_noise.hpp"

namespace vdvr {

/// Counts of a photon a: (variance over flats, each divided by its own level, - variance over darks) / mean,
/// median over pixels. The variance is that within runs of flats (of indices; none: all are one), between
/// which the beam may have drifted. Then var p = a e^p / open + var(dark) e^2p / open^2, by pixel. Nothing of
/// fewer than five flats (of n runs, 4 + n), or where flats do not vary (saturated, averaged). Cost: flats
/// and darks are read twice. Memory: five numbers a pixel.
std::optional<LineIntegralNoise> photon_transfer(const io::Frames& flats, const io::Frames& darks,
                                                 std::int64_t rows, std::int64_t columns,
                                                 const std::vector<std::vector<std::int64_t>>& runs = {});

/// Of pixels that are means of binning x binning.
LineIntegralNoise binned(const LineIntegralNoise& noise, std::int64_t rows, std::int64_t columns,
                         int binning);

}  // namespace vdvr
