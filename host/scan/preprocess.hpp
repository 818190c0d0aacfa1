// From counts to line integrals: p = -log((raw - dark) / (flat - dark)), dead pixels replaced, air background
// taken off. Everything in double; the caller rounds to float once.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "host/scan/raw/raw_scan.hpp"

namespace vdvr {

/// What turns one projection's counts into line integrals.
struct FlatField {
  std::vector<double> dark;  ///< [row][column], mean over the darks
  std::vector<double>
      gain;                 ///< mean flat - mean dark; NaN where it is not positive and finite (a dead pixel)
  double floor = 0;         ///< transmissions at or below it count as dead
  double largest_flat = 0;  ///< of all flats' samples
  std::int64_t at_largest = 0;  ///< samples of flats that have it
};

/// Averages darks and flats. The floor is half of what the detector can tell apart from nothing: half a count
/// over the median gain for whole-number counts, half a step of a 16-bit converter (2^-17 of the flat) for
/// others. Throws FileError naming a flat without any pixel above the dark.
FlatField make_flat_field(const io::Frames& flats, const io::Frames& darks, std::int64_t rows,
                          std::int64_t columns, bool integer);

/// counts[row][column] become line integrals in place; returns how many pixels were replaced. A dead pixel
/// (gain, count or transmission unusable) gets the median of the valid ones in the smallest square about it
/// that has any. Of a projection without one, all pixels count, and are left NaN.
std::int64_t to_line_integrals(std::span<double> counts, std::int64_t rows, std::int64_t columns,
                               const FlatField& field);
/// The same with a gain of this projection's own in place of the field's.
std::int64_t to_line_integrals(std::span<double> counts, std::int64_t rows, std::int64_t columns,
                               const FlatField& field, std::span<const double> gain);

/// Subtracts from each row the least-squares line through its samples in the (inclusive) column ranges.
void subtract_air_background(std::span<double> view, std::int64_t rows, std::int64_t columns,
                             std::span<const std::pair<std::int64_t, std::int64_t>> air_columns);

}  // namespace vdvr
