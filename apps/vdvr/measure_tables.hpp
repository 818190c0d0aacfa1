// What is measured as JSON, as lines for people, and as tables. Called by measure.cpp.
#pragma once

#include <string>
#include <vector>

#include "apps/common/common_options.hpp"
#include "vdvr/expert/components.hpp"
#include "vdvr/expert/measure.hpp"
#include "vdvr/expert/measure_line.hpp"

namespace vdvr::cli {

/// {"lo": a, "hi": b}
Json interval_json(const Interval& interval);
/// "1.25 to 1.5 mm^3 (1.375 +- 9.1 %)", both ends rounded outward to six digits.
std::string interval_text(const Interval& interval, const std::string& unit);

Json distribution_json(const Distribution& d);
std::string distribution_csv(const Distribution& d);

/// `crossings`: whether they were asked for.
Json line_json(const LineMeasure& line, bool crossings);
std::string line_csv(const LineMeasure& line, const Vec3& p, const Vec3& q);
std::vector<std::string> line_lines(const LineMeasure& line, const std::optional<double>& value,
                                    const std::string& unit);

Json components_json(const ComponentTable& table);
std::string components_csv(const ComponentTable& table);
std::vector<std::string> components_lines(const ComponentTable& table, const std::string& unit);

}  // namespace vdvr::cli
