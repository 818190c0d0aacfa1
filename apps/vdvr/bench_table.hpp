// What `vdvr bench` measured, for people: the same figures as in its line of JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace vdvr::cli {

/// A line per figure: spreads as median (least to largest), lists of objects as a table.
std::string bench_table(const nlohmann::ordered_json& line);

}  // namespace vdvr::cli
