// Bars of the report: inline SVG without text, which stretches to the width of the page; what they say stands
// beside them in HTML, so that it stays readable on a phone. Called by report.cpp.
#pragma once

#include <string>
#include <vector>

namespace vdvr::cli {

struct BarPart {
  std::string name, color;
  double value = 0;
};

/// Parts one after the other, on a scale that ends at `full`; a line at `mark` where that is above 0.
std::string stacked_bar(const std::vector<BarPart>& parts, double full, double mark,
                        const std::string& label);
/// A square of the color, and the name.
std::string legend(const std::vector<BarPart>& parts);

}  // namespace vdvr::cli
