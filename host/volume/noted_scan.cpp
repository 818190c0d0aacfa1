#include "vdvr/expert/noted_scan.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/scan/input_statement_json.hpp"
#include "vdvr/error.hpp"

namespace vdvr {

namespace {

RowExtension extension_of(const nlohmann::json& e) {
  RowExtension out;
  if (e.at("half_acquisition").get<bool>()) out.half_acquisition = true;
  const auto padding = padding_of(e.at("pad").get<std::string>());
  if (!padding) throw FileError("certificate, options.geometry.extension: an unknown padding");
  out.padding = *padding;
  out.before = e.at("before").get<std::int64_t>();
  out.after = e.at("after").get<std::int64_t>();
  out.center = e.at("center").get<double>();
  return out;
}

HeightSeries series_of(const nlohmann::json& g) {
  HeightSeries s{g.at("rows").get<std::int64_t>(),
                 g.at("first").get<std::int64_t>(),
                 g.at("full_turn").get<bool>(),
                 g.at("theta_rad").get<std::vector<double>>(),
                 g.at("row_shift").get<std::vector<double>>(),
                 g.value("column_shift", std::vector<double>{})};
  if (s.rows < 1 || s.theta_rad.empty() || s.row_shift.size() != s.theta_rad.size() ||
      (!s.column_shift.empty() && s.column_shift.size() != s.theta_rad.size()))
    throw FileError(
        "certificate, options.geometry.series: rows, and one number of each kind a view, are needed");
  return s;
}

}  // namespace

std::optional<ProjectionSet> noted_geometry(const Certificate& certificate) {
  const auto options = nlohmann::json::parse(certificate.options_json, nullptr, false);
  if (!options.is_object() || !options.contains("geometry")) return std::nullopt;
  try {
    const auto& g = options.at("geometry");
    ProjectionSet scan;
    ParallelGeometry& geometry = scan.geometry;
    geometry.columns = g.at("columns").get<std::int64_t>();
    geometry.rows = g.at("rows").get<std::int64_t>();
    geometry.pitch_u = g.at("pitch_u").get<double>();
    geometry.pitch_v = g.at("pitch_v").get<double>();
    geometry.center = g.at("center").get<double>();
    geometry.unit = g.at("unit").get<std::string>();
    geometry.theta_rad = g.at("theta_rad").get<std::vector<double>>();
    for (auto [name, shift] :
         {std::pair{"column_shift", &geometry.column_shift}, std::pair{"row_shift", &geometry.row_shift}}) {
      if (!g.contains(name)) continue;
      *shift = g.at(name).get<std::vector<double>>();
      if (shift->size() != geometry.theta_rad.size())
        throw FileError(fmt::format("certificate, options.geometry.{}: one number is needed a view", name));
    }
    if (g.contains("series")) geometry.series = series_of(g.at("series"));
    if (g.contains("extension")) geometry.extension = extension_of(g.at("extension"));
    geometry.axis_roll_deg = g.value("axis_roll", 0.0);
    require_axis_roll(geometry.axis_roll_deg, "certificate, options.geometry.axis_roll");
    geometry.extension.cut = g.value("columns_cut", std::int64_t{0});
    geometry.extension.common_heights = !geometry.row_shift.empty() || geometry.axis_roll_deg != 0;
    if (g.contains("cone")) {
      const auto& cone = g.at("cone");
      const auto redundancy = redundancy_of(cone.at("redundancy").get<std::string>());
      if (!redundancy) throw FileError("certificate, options.geometry.cone: an unknown redundancy");
      const auto numbers = cone.at("matrices").get<std::vector<double>>();
      if (numbers.size() != 12 * geometry.theta_rad.size())
        throw FileError("certificate, options.geometry.cone: 12 numbers are needed for each view");
      scan.cone = ConeGeometry{std::vector<ViewMatrix>(geometry.theta_rad.size()), *redundancy};
      for (std::size_t i = 0; i < numbers.size(); ++i)
        scan.cone->views[i / 12][i % 12 / 4][i % 4] = numbers[i];
    }
    return scan;
  } catch (const nlohmann::json::exception& e) {
    throw FileError(fmt::format("certificate, options.geometry: {}", e.what()));
  }
}

InputStatement noted_input(const Certificate& certificate) {
  const auto options = nlohmann::json::parse(certificate.options_json, nullptr, false);
  if (!options.is_object() || !options.contains("input")) return {};
  try {
    return input_statement_of(options.at("input"));
  } catch (const InputError& e) {
    throw FileError(fmt::format("certificate, options: {}", e.what()));
  }
}

}  // namespace vdvr
