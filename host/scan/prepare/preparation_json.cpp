#include "host/scan/prepare/preparation_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "vdvr/error.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr {
namespace {

using Json = nlohmann::json;

void require_members(const Json& json, const std::string& what, const std::vector<std::string>& names) {
  if (!json.is_object())
    throw InputError(fmt::format("{} is {}, expected an object", what, json.type_name()));
  for (const auto& [name, value] : json.items())
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw InputError(fmt::format("{}: '{}' is not known to this version", what, name));
}

double number(const Json& json, const std::string& what) {
  if (!json.is_number()) throw InputError(fmt::format("{} is {}, expected a number", what, json.type_name()));
  return json.get<double>();
}

double number(const Json& object, const std::string& what, const char* name) {
  if (!object.contains(name)) throw InputError(fmt::format("{}: '{}' is missing", what, name));
  return number(object.at(name), fmt::format("{}: '{}'", what, name));
}

int whole(const Json& json, const std::string& what) {
  const double value = number(json, what);
  constexpr double most = std::numeric_limits<int>::max();
  if (!(value >= 0 && value <= most) || value != static_cast<double>(static_cast<int>(value)))
    throw InputError(fmt::format("{} is {}, expected a whole number", what, value));
  return static_cast<int>(value);
}

int whole(const Json& object, const std::string& what, const char* name) {
  if (!object.contains(name)) throw InputError(fmt::format("{}: '{}' is missing", what, name));
  return whole(object.at(name), fmt::format("{}: '{}'", what, name));
}

// True or false, where the member is there.
std::optional<bool> said(const Json& object, const char* name) {
  if (!object.contains(name)) return {};
  if (!object.at(name).is_boolean()) throw InputError(fmt::format("{}: expected true or false", name));
  return object.at(name).get<bool>();
}

}  // namespace

Json json_of(const Preparation& p) {
  Json json = Json::object();
  if (p.outliers) json["outliers"] = {{"threshold", p.outliers->threshold}, {"window", p.outliers->window}};
  if (p.phase)
    json["phase"] = {{"distance_mm", p.phase->distance_mm},
                     {"energy_kev", p.phase->energy_kev},
                     {"delta_beta", p.phase->delta_beta}};
  if (p.stripes)
    json["stripes"] = {{"ratio", p.stripes->ratio}, {"large", p.stripes->large}, {"small", p.stripes->small}};
  if (p.median > 1) json["median"] = p.median;
  if (p.gaussian != std::array<double, 2>{0, 0}) json["gaussian"] = p.gaussian;
  if (p.binning > 1) json["binning"] = p.binning;
  if (p.half_acquisition) json["half_acquisition"] = *p.half_acquisition;
  if (p.padding != Padding::none) json["pad"] = text_of(p.padding);
  if (p.heights)
    json[p.heights == Heights::all ? "all_heights" : "common_heights"] = p.heights != Heights::as_seen;
  if (p.flats_in_time) json["flats_in_time"] = *p.flats_in_time;
  if (p.beam_current) json["beam_current"] = *p.beam_current;
  return json;
}

Preparation preparation_of(const Json& json) {
  require_members(json, "preparation",
                  {"outliers", "phase", "stripes", "median", "gaussian", "binning", "half_acquisition", "pad",
                   "flats_in_time", "beam_current", "common_heights", "all_heights"});
  Preparation p;
  if (json.contains("outliers")) {
    const Json& o = json.at("outliers");
    require_members(o, "outliers", {"threshold", "window"});
    p.outliers = Outliers{number(o, "outliers", "threshold"), whole(o, "outliers", "window")};
  }
  if (json.contains("phase")) {
    const Json& o = json.at("phase");
    require_members(o, "phase", {"distance_mm", "energy_kev", "delta_beta"});
    p.phase = PhaseRetrieval{number(o, "phase", "distance_mm"), number(o, "phase", "energy_kev"),
                             number(o, "phase", "delta_beta")};
  }
  if (json.contains("stripes")) {
    const Json& o = json.at("stripes");
    require_members(o, "stripes", {"ratio", "large", "small"});
    p.stripes =
        Stripes{number(o, "stripes", "ratio"), whole(o, "stripes", "large"), whole(o, "stripes", "small")};
  }
  if (json.contains("median")) p.median = whole(json.at("median"), "median");
  if (json.contains("gaussian")) {
    const Json& o = json.at("gaussian");
    if (!o.is_array() || o.size() != 2) throw InputError("gaussian: expected two numbers");
    p.gaussian = {number(o.at(0), "gaussian"), number(o.at(1), "gaussian")};
  }
  if (json.contains("binning")) p.binning = whole(json.at("binning"), "binning");
  p.half_acquisition = said(json, "half_acquisition");
  if (const auto common = said(json, "common_heights"))
    p.heights = *common ? Heights::common : Heights::as_seen;
  if (said(json, "all_heights").value_or(false)) p.heights = Heights::all;
  p.flats_in_time = said(json, "flats_in_time");
  p.beam_current = said(json, "beam_current");
  if (json.contains("pad")) {
    const Json& text = json.at("pad");
    const auto padding = padding_of(text.is_string() ? text.get<std::string>() : "");
    if (!padding) throw InputError("pad: expected \"none\", \"edge\" or \"mirror\"");
    p.padding = *padding;
  }
  check_preparation(p);
  return p;
}

}  // namespace vdvr
