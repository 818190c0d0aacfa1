// Round numbers along an axis, and units as people read them.
#pragma once

#include <string>
#include <vector>

namespace vdvr {

struct Tick {
  double value = 0;
  std::string label;
};
struct Ticks {
  std::vector<Tick> ticks;  ///< rising, within the range; labels differ
  int exponent = 0;         ///< labels times 10^exponent are the values
};

/// At most `most` (2 and up) multiples of 1, 2 or 5 times a power of ten within [lo, hi]; the ends themselves
/// where no two multiples lie inside that digits can tell apart. None where an end is not finite or lo > hi.
Ticks round_ticks(double lo, double hi, int most);

/// The largest of 1, 2 and 5 times a power of ten that is not above `length`, a positive number.
double round_length(double length);

/// Lengths of world unit `unit` times `factor` are in `name`.
struct ShownUnit {
  double factor = 1;
  std::string name;
};
/// Metric units become m, mm, µm, nm or pm, so that `extent` has one to three digits before its point; others
/// stay.
ShownUnit shown_unit(const std::string& unit, double extent);

/// mm⁻¹ of mm.
std::string per_unit(const std::string& unit);
/// ×10⁻⁶, nothing of exponent 0.
std::string times_power(int exponent);
/// Four digits, with a minus of its own width.
std::string number_text(double value);

}  // namespace vdvr
