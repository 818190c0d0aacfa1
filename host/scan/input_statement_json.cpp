#include "host/scan/input_statement_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "vdvr/error.hpp"

namespace vdvr {

nlohmann::json json_of(const InputStatement& s) {
  nlohmann::json json = nlohmann::json::object();
  if (!s.entry.empty()) json["entry"] = s.entry;
  if (!s.views.empty()) json["views"] = s.views;
  if (s.dark) json["dark"] = *s.dark;
  if (s.flat) json["flat"] = *s.flat;
  if (s.values) json["values"] = text_of(*s.values);
  if (s.angle_unit) json["angle_unit"] = text_of(*s.angle_unit);
  if (!s.beam_current.empty()) json["beam_current"] = s.beam_current;
  if (s.axis_roll_deg) json["axis_roll"] = *s.axis_roll_deg;
  return json;
}

InputStatement input_statement_of(const nlohmann::json& json) {
  if (!json.is_object()) throw InputError("input: expected an object");
  InputStatement s;
  const auto level = [](const std::string& name, const nlohmann::json& value) {
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      throw InputError(fmt::format("input: '{}' must be a finite number", name));
    return value.get<double>();
  };
  for (const auto& [name, value] : json.items()) {
    if (name == "entry" && value.is_string()) {
      s.entry = value.get<std::string>();
    } else if (name == "views" && value.is_array()) {
      for (const auto& range : value) {
        if (!range.is_array() || range.size() != 2 || !range[0].is_number_integer() ||
            !range[1].is_number_integer())
          throw InputError("input: 'views' must be a list of [first, last]");
        s.views.emplace_back(range[0].get<std::int64_t>(), range[1].get<std::int64_t>());
      }
    } else if (name == "beam_current" && value.is_string()) {
      s.beam_current = value.get<std::string>();
    } else if (name == "dark") {
      s.dark = level(name, value);
    } else if (name == "axis_roll") {
      s.axis_roll_deg = level(name, value);
    } else if (name == "flat") {
      s.flat = level(name, value);
    } else if (name == "values" && value.is_string() && sample_values_of(value.get<std::string>())) {
      s.values = sample_values_of(value.get<std::string>());
    } else if (name == "angle_unit" && value.is_string() && angle_unit_of(value.get<std::string>())) {
      s.angle_unit = angle_unit_of(value.get<std::string>());
    } else {
      throw InputError(fmt::format("input: member '{}' is not known to this version", name));
    }
  }
  return s;
}

}  // namespace vdvr
