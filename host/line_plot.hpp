// Curves over one axis as an SVG element for a page. Called by the command bench paper.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace vdvr {

struct LineCurve {
  std::string label;
  std::vector<std::array<double, 2>> points;  ///< x, y; in order of x
  bool dashed = false;
};
struct LinePlot {
  std::string title, x_label, y_label;
  std::vector<LineCurve> curves;  ///< 6 at most have colours of their own
  bool logarithmic = false;       ///< in y
  bool marks = true;              ///< a dot on every point
};

/// <svg>...</svg>, 760 x 430, with axes, a grid and a legend; each marked point says its value when pointed
/// at. A logarithmic axis leaves out what is not above 0. Throws InputError without a finite point.
std::string svg(const LinePlot& plot);

}  // namespace vdvr
