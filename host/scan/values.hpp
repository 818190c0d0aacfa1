// What the frames of a scan hold, and what turns counts into line integrals.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string>

#include "host/scan/raw/raw_scan.hpp"

namespace vdvr::io {

/// Settles `values`, `counts`, flats and darks: what `options` states, else scan.json or the file, else what
/// the format holds as a rule. Throws FileError, which names the remedy, for counts without flats or darks,
/// and for whole numbers that nobody says are line integrals; InputError for statements that contradict each
/// other.
void settle_values(RawScan& scan, const InputStatement& options, const std::string& name);

/// Running totals of a scan's values, from which it is told whether they can be what they are said to be.
struct ValueTotals {
  double sum = 0;                ///< of line integrals
  double largest = -INFINITY;    ///< of them
  double edges = 0, middle = 0;  ///< sums of means: outermost columns, middle third
  std::int64_t samples = 0, views = 0;
  std::int64_t fractions = 0;  ///< values that are no whole numbers
  std::int64_t saturated = 0;  ///< counts at the top of their range

  /// One view of line integrals [row][column].
  void add(std::span<const double> view, std::int64_t columns);
  void add(const ValueTotals& other);
};

/// The top of a converter's range, 2^n - 1 for n of 8 to 16 and their multiples that fill 16 bits, where the
/// largest count of the flats is one; else 0.
double saturation_of(const RawScan& scan, double largest_flat);

/// Throws FileError for values that are certainly not what they are said to be, and adds warnings to `scan`
/// for doubtful ones. `name`: of the input.
void judge_values(const ValueTotals& totals, RawScan& scan, const std::string& name);

}  // namespace vdvr::io
