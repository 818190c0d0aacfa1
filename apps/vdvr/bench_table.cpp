#include "apps/vdvr/bench_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

namespace vdvr::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string words_of(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

bool is_spread(const Json& value) {
  return value.is_object() && value.size() == 3 && value.contains("min") && value.contains("median");
}

/// A figure in the four digits that a timing has.
std::string figure(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
  if (is_spread(value))
    return fmt::format("{} ({} to {})", figure(value["median"]), figure(value["min"]), figure(value["max"]));
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const Json& one : value) text += (text.empty() ? "" : ", ") + figure(one);
  return text;
}

using Row = std::vector<std::string>;

/// Columns as wide as their widest cell.
std::string aligned(const std::vector<Row>& rows, const std::string& indent) {
  std::vector<std::size_t> widths;
  for (const Row& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const Row& row : rows) {
    std::string line = indent;
    for (std::size_t i = 0; i < row.size(); ++i) line += fmt::format("{:<{}}", row[i], widths[i] + 2);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

/// The figures first, then what has a heading of its own.
std::string section(const Json& object, const std::string& indent) {
  std::vector<Row> figures;
  std::string below;
  for (const auto& [name, value] : object.items()) {
    if (value.is_object() && !is_spread(value)) {
      below += indent + words_of(name) + "\n" + section(value, indent + "  ");
    } else {
      figures.push_back({words_of(name), figure(value)});
    }
  }
  return aligned(figures, indent) + below;
}

}  // namespace

std::string bench_table(const Json& line) { return section(line, ""); }

}  // namespace vdvr::cli
