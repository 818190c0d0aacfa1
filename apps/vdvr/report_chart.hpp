// Bars of the report: inline SVG without text, which stretches to the width of the page; what they say stands
// beside them in HTML, so that it stays readable on a phone. Called by report.cpp and report_storage.cpp.
#pragma once

#include <string>
#include <vector>

namespace vdvr::cli {

inline constexpr const char* kGrid = "#2f6db5";
inline constexpr const char* kBetween = "#7fb0de";
inline constexpr const char* kArithmetic = "#e0a030";
inline constexpr const char* kSampler = "#8a5fb0";

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
