// JSON objects with typed access; see description.hpp.
#include "host/scan/geometry/description.hpp"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/files/io/natural_order.hpp"
#include "host/files/io/text_encoding.hpp"
#include "vdvr/error.hpp"

namespace vdvr::io {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

/// Refuses what is nested so deeply that copying it would take the stack.
json::parser_callback_t nested() {
  return [](int depth, json::parse_event_t, json&) {
    constexpr int most = 64;
    if (depth > most) throw InputError(fmt::format("is nested more than {} deep", most));
    return true;
  };
}

}  // namespace

Description::Description(fs::path file, const std::set<std::string>& known) : file_(std::move(file)) {
  // The description of a scan takes lines, not megabytes: a larger file is something else.
  constexpr std::uintmax_t largest = 16u << 20;
  std::error_code error;
  if (!fs::is_regular_file(file_, error))
    fail(file_.filename() == "scan.json" ? "cannot be opened; a folder is a scan by its scan.json"
                                         : "cannot be opened");
  const std::string text = read_text(file_, "a description", largest);
  try {
    json_ = json::parse(text, nested(), true, true);
  } catch (const json::exception& e) {
    fail(fmt::format("is not JSON: {}", e.what()));
  } catch (const InputError& e) {
    fail(e.what());
  }
  if (!json_.is_object()) fail("is not a JSON object");
  require_known(known);
}

Description::Description(fs::path file, std::string within, json value, const std::set<std::string>& known)
    : file_(std::move(file)), within_(std::move(within)), json_(std::move(value)) {
  require_known(known);
}

Description Description::member(const std::string& key, const std::set<std::string>& known) const {
  if (!json_.at(key).is_object()) fail(fmt::format("{} must be an object", quoted(key)));
  return {file_, within_ + key + ".", json_.at(key), known};
}

std::vector<Description> Description::members(const std::string& key, const std::set<std::string>& known,
                                              std::size_t most) const {
  if (!has(key) || !is_list(key) || json_.at(key).empty())
    fail(fmt::format("{} must be a list of at least one object", quoted(key)));
  if (json_.at(key).size() > most)
    fail(fmt::format("{} has {} members; at most {} are read", quoted(key), json_.at(key).size(), most));
  std::vector<Description> all;
  for (const json& item : json_.at(key)) {
    const std::string name = fmt::format("{}[{}]", key, all.size());
    if (!item.is_object()) fail(fmt::format("{} must be an object", quoted(name)));
    all.push_back({file_, within_ + name + ".", item, known});
  }
  return all;
}

void Description::require_known(const std::set<std::string>& known) const {
  for (const auto& [key, value] : json_.items())
    if (!known.contains(key))
      fail(fmt::format("member {} is unknown; there are: {}", quoted(key), fmt::join(known, ", ")));
}

void Description::fail(const std::string& what) const {
  throw FileError(fmt::format("{}: {}", file_.string(), what));
}

std::string Description::quoted(const std::string& key) const { return fmt::format("'{}{}'", within_, key); }

std::string Description::text(const std::string& key) const {
  if (!json_.at(key).is_string()) fail(fmt::format("{} must be a string", quoted(key)));
  return json_.at(key).get<std::string>();
}

bool Description::flag(const std::string& key) const {
  if (!json_.at(key).is_boolean()) fail(fmt::format("{} must be true or false", quoted(key)));
  return json_.at(key).get<bool>();
}

double Description::number(const std::string& key) const {
  if (!has(key)) fail(fmt::format("{} is missing; it must be a number", quoted(key)));
  if (!json_.at(key).is_number()) fail(fmt::format("{} must be a number", quoted(key)));
  return json_.at(key).get<double>();
}

double Description::number_or(const std::string& key, double fallback) const {
  return has(key) ? number(key) : fallback;
}

double Description::positive(const std::string& key) const {
  const double value = number(key);
  if (!(value > 0) || !std::isfinite(value))
    fail(fmt::format("{} is {}; it must be positive", quoted(key), value));
  return value;
}

std::int64_t Description::integer(const std::string& key) const {
  if (!has(key) || !json_.at(key).is_number_integer())
    fail(fmt::format("{} must be a whole number", quoted(key)));
  return json_.at(key).get<std::int64_t>();
}

std::vector<std::string> Description::texts(const std::string& key) const {
  if (json_.at(key).is_string()) return {text(key)};
  std::vector<std::string> all;
  if (!json_.at(key).is_array()) fail(fmt::format("{} must be a list of strings", quoted(key)));
  for (const json& item : json_.at(key)) {
    if (!item.is_string()) fail(fmt::format("{} must be a list of strings", quoted(key)));
    all.push_back(item.get<std::string>());
  }
  return all;
}

std::vector<double> Description::numbers(const std::string& key) const {
  if (!has(key) || !is_list(key)) fail(fmt::format("{} must be a list of numbers", quoted(key)));
  std::vector<double> all;
  for (const json& item : json_.at(key)) {
    if (!item.is_number()) fail(fmt::format("{} must be a list of numbers", quoted(key)));
    all.push_back(item.get<double>());
  }
  return all;
}

Vec3 Description::vec3(const std::string& key) const {
  const auto v = numbers(key);
  if (v.size() != 3) fail(fmt::format("{} must be three numbers [x, y, z]", quoted(key)));
  return {v[0], v[1], v[2]};
}

std::pair<double, double> Description::pair(const std::string& key) const {
  if (!has(key)) fail(fmt::format("{} is missing; it must be one number or [u, v]", quoted(key)));
  const auto values = is_list(key) ? numbers(key) : std::vector<double>(2, number(key));
  if (values.size() != 2) fail(fmt::format("{} must be one number or [u, v]", quoted(key)));
  return {values[0], values[1]};
}

std::vector<double> Description::table(const std::string& key, std::size_t width) const {
  if (!has(key) || !is_list(key)) fail(fmt::format("{} must be a list", quoted(key)));
  std::vector<double> all;
  for (const json& row : json_.at(key)) {
    if (!row.is_array() || row.size() != width)
      fail(fmt::format("{}: entry {} must hold {} numbers", quoted(key), all.size() / width, width));
    for (const json& item : row) {
      if (!item.is_number())
        fail(fmt::format("{}: entry {} must hold {} numbers", quoted(key), all.size() / width, width));
      all.push_back(item.get<double>());
    }
  }
  return all;
}

namespace {

std::optional<std::pair<std::int64_t, std::int64_t>> range_of(const json& item) {
  if (!item.is_array() || item.size() != 2 || !item[0].is_number_integer() || !item[1].is_number_integer())
    return {};
  return std::pair{item[0].get<std::int64_t>(), item[1].get<std::int64_t>()};
}

}  // namespace

std::pair<std::int64_t, std::int64_t> Description::half_open(const std::string& key, std::int64_t count,
                                                             const char* what) const {
  const auto range = range_of(json_.at(key));
  if (!range) fail(fmt::format("{} must be [first, last], two integers", quoted(key)));
  const auto [first, end] = *range;
  if (!(0 <= first && first < end && end <= count))
    fail(fmt::format("{} = [{}, {}) is not a range within the {} {}", quoted(key), first, end, count, what));
  return *range;
}

std::vector<std::pair<std::int64_t, std::int64_t>> Description::ranges(const std::string& key) const {
  std::vector<std::pair<std::int64_t, std::int64_t>> all;
  if (!json_.at(key).is_array()) fail(fmt::format("{} must be a list of [first, last]", quoted(key)));
  for (const json& item : json_.at(key)) {
    const auto range = range_of(item);
    if (!range) fail(fmt::format("{} must be [first, last], two integers", quoted(key)));
    all.push_back(*range);
  }
  return all;
}

std::vector<std::pair<std::int64_t, std::int64_t>> Description::one_or_more_ranges(
    const std::string& key) const {
  if (const auto one = range_of(json_.at(key))) return {*one};
  return ranges(key);
}

fs::path Description::inside(const std::string& name, const std::string& key) const {
  const fs::path relative(name);
  if (name.empty() || relative.is_absolute() ||
      std::find(relative.begin(), relative.end(), "..") != relative.end())
    fail(
        fmt::format("{} names '{}'; names are relative to the folder and stay within it", quoted(key), name));
  return folder() / relative;
}

std::vector<std::string> Description::matches(const std::string& key) const {
  std::vector<std::string> all;
  for (const std::string& pattern : texts(key)) {
    const auto found = matches(pattern, key);
    all.insert(all.end(), found.begin(), found.end());
  }
  if (all.empty())
    fail(fmt::format("{} is '{}', which matches no file in {}", quoted(key), fmt::join(texts(key), "', '"),
                     folder().string()));
  return all;
}

std::vector<std::string> Description::matches(const std::string& pattern, const std::string& key) const {
  const fs::path path = inside(pattern, key);
  if (pattern.find_first_of("*?[") == std::string::npos) return {pattern};
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path.parent_path(), error))
    if (::fnmatch(path.filename().c_str(), entry.path().filename().c_str(), FNM_PERIOD) == 0)
      found.push_back((fs::path(pattern).parent_path() / entry.path().filename()).generic_string());
  if (error)
    fail(fmt::format("{}: folder of '{}' cannot be listed: {}", quoted(key), pattern, error.message()));
  std::sort(found.begin(), found.end(), natural_less);
  return found;
}

}  // namespace vdvr::io
