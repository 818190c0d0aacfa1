// What the sections share: wording, JSON of measures, views.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/common/volume_json.hpp"
#include "apps/paper/report.hpp"

namespace vdvr::paper {

std::string percent(double value, int digits) { return fmt::format("{:.{}g} %", 100 * value, digits); }
std::string number(double value, int digits) { return fmt::format("{:.{}g}", value, digits); }
std::string duration(double seconds) {
  return seconds < 90 ? fmt::format("{:.1f} s", seconds) : fmt::format("{:.1f} min", seconds / 60);
}

Json measure_json(const ErrorMeasure& m) {
  return {{"samples", m.count},
          {"rms", m.rms},
          {"rms_normalised", m.rms_normalised},
          {"max", m.max},
          {"p99", m.p99},
          {"mean_error", m.mean_error},
          {"deviation_ratio", m.deviation_ratio}};
}

Json speed_json(const Speed& s) {
  return {{"fps", s.fps},
          {"frames", s.frames},
          {"seconds", {{"min", s.seconds_min}, {"median", s.seconds_median}, {"max", s.seconds_max}}},
          {"samples_per_second", s.samples_per_second}};
}

Json case_json(const Case& c) {
  Json options = {{"u", c.certificate.rates.upsampling},
                  {"u_filter", text_of(c.certificate.rates.interpolation)},
                  {"gold", c.certificate.rates.gold},
                  {"granularity", c.volume.granularity}};
  return {{"settings", text_of(c.settings)},
          {"epsilon", c.epsilon},
          {"epsilon_of", c.tolerance.absolute ? "density"
                         : c.epsilon_of_max   ? "maximum"
                                              : "range"},
          {"epsilon_abs", c.certificate.epsilon_abs},
          {"reference_range", c.certificate.reference_range},
          {"rates", options},
          {"certified", !c.certificate.comparison && c.certificate.holds_buffer},
          {"measured_max_to_gold", c.certificate.measured_max},
          {"arithmetic", c.certificate.budget.arithmetic.value},
          {"bricks", cli::levels_json(c.volume)},
          {"storage", cli::storage_json(c.volume, 0)},
          {"seconds", c.seconds}};
}

RenderOptions lobb_view(const Grid& grid, std::int64_t side) {
  RenderOptions o;
  o.mode = RenderMode::iso;
  o.surfaces = {{0.5}};
  o.width = o.height = side;
  // From above, where the rings are; a little to the side, so that grooves are not seen end on.
  o.camera = orbit_camera(grid, 30, -50, 1.35);
  return o;
}

RenderResult draw_case(Renderer& renderer, const Case& made, RenderOptions options) {
  options.sampler = made.sampler;
  return renderer.render(options);
}

}  // namespace vdvr::paper
