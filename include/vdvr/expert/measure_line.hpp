// F along a line: a profile with its bound, where it passes a value, and how wide what lies between is.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "vdvr/expert/measure.hpp"

namespace vdvr {

struct LineOptions {
  std::int64_t samples = 257;   ///< of the profile, evenly from p to q
  std::optional<double> value;  ///< whose crossings are looked for
};

/// Between the distances a and b from p F passes the value; `rising`: from below to above.
struct LineCrossing {
  Interval at;
  bool rising = false;
};

/// Between two crossings, where F is surely on one side of the value somewhere.
struct LineRun {
  bool above = false;
  Interval from, to;  ///< where it begins and ends
  /// How long the stretch of F on that side is; nothing where F may pass the value between and come back.
  std::optional<Interval> width;
};

struct LineMeasure {
  double length = 0;
  Interval covered;             ///< what of [0, length] is measured
  std::vector<double> at;       ///< distances from p, of samples that are covered
  std::vector<Interval> value;  ///< F there
  std::vector<LineCrossing> crossings;
  std::vector<LineRun> runs;  ///< between two crossings each, in order
  double undecided = 0;       ///< length where F may be on either side
};

}  // namespace vdvr
