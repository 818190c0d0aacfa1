#include "apps/vdvr/verification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace vdvr::cli {

namespace {

/// What `verify` measures: the total with the device's worse sampler.
double certified_total(const Certificate& c) {
  return std::max(c.total_buffer, c.total_image3d.value_or(c.total_buffer));
}

/// Per sampler: what it may err, whether that holds, or why it was not judged.
Json samplers_json(const VerifyResult& m, const Certificate& c) {
  Json json = Json::object();
  const auto add = [&](const char* name, bool promised, const std::optional<double>& total,
                       const std::optional<bool>& holds) {
    Json& entry = json[name];
    entry["promised"] = promised;
    entry["total"] = total ? Json(*total) : Json(nullptr);
    entry["holds"] = holds ? Json(*holds) : Json(nullptr);
  };
  add("buffer", c.holds_buffer, m.total_buffer, m.holds_buffer);
  add("image3d", c.holds_image3d.value_or(false), m.total_image3d, m.holds_image3d);
  json["image3d"]["of_this_device"] = m.image3d_promised;
  return json;
}

std::string sampler_text(bool promised, const std::optional<double>& total, const std::optional<bool>& holds,
                         bool of_this_device = true) {
  if (!total) return promised ? "promised, but this device has no such sampler" : "not on this device";
  return fmt::format("{:.5g}, {}", *total,
                     !holds           ? "not promised"
                     : *holds         ? "holds"
                     : of_this_device ? "DOES NOT HOLD"
                                      : "does not hold for this device, which did not build it: pictures "
                                        "here take the buffer");
}

}  // namespace

Json verification_json(const VerifyResult& m, const Certificate& c) {
  return {{"holds", m.holds},
          {"epsilon_abs", m.epsilon_abs},
          {"measured",
           {{"measured_max", m.measured_max}, {"measured_total", m.measured_total}, {"total", m.total}}},
          {"certified",
           {{"measured_max", c.measured_max},
            {"measured_total", c.measured_total},
            {"total", certified_total(c)}}},
          {"arithmetic", m.arithmetic},
          {"samplers", samplers_json(m, c)},
          {"worst_at", m.worst_at},
          {"worst",
           {{"brick", m.worst.brick},
            {"brick_zyx", {m.worst.brick_at[2], m.worst.brick_at[1], m.worst.brick_at[0]}},
            {"level", m.worst.level},
            {"dataset", m.worst.dataset},
            {"tile", m.worst.tile},
            {"sample_zyx", {m.worst.sample[2], m.worst.sample[1], m.worst.sample[0]}},
            {"value", m.worst.value},
            {"field", m.worst.field}}},
          {"bricks_tested", m.bricks_tested},
          {"bricks", m.bricks},
          {"nodes_tested", m.nodes_tested},
          {"cells_tested", m.cells_tested},
          {"bricks_finer", m.bricks_finer},
          {"finest_rate", m.finest_rate},
          {"seams", m.seams},
          {"points_evaluated", m.points_evaluated},
          {"worst_share", m.worst_share},
          {"field_points", m.field_points},
          {"field_share", m.field_share},
          {"differences", m.differences},
          {"failure", m.failure}};
}

void print_verification(const VerifyResult& m, const Certificate& c) {
  fmt::print("verification   {} of {} bricks, {} gold cells, {} gold nodes: {}\n", m.bricks_tested, m.bricks,
             m.cells_tested, m.nodes_tested, m.holds ? "holds" : "DOES NOT HOLD");
  if (m.bricks_finer > 0)
    fmt::print("    {} bricks again on finer gold, up to {}x\n", m.bricks_finer, m.finest_rate);
  const auto line = [](const char* what, double measured, double certified) {
    fmt::print("    {:<18} measured {:>11.5g}   certified {:>11.5g}\n", what, measured, certified);
  };
  line("|V - F| at nodes", m.measured_max, c.measured_max);
  line("and between them", m.measured_total, c.measured_total);
  line("total", m.total, certified_total(c));
  fmt::print(
      "    {:<18} {}\n    {:<18} {}\n", "sampler buffer",
      sampler_text(c.holds_buffer, m.total_buffer, m.holds_buffer), "sampler image3d",
      sampler_text(c.holds_image3d.value_or(false), m.total_image3d, m.holds_image3d, m.image3d_promised));
  fmt::print("    {:<18} {:>20.5g}\n    worst at           {}\n", "tolerance", m.epsilon_abs,
             vec_text(m.worst_at));
  if (m.points_evaluated > 0)
    fmt::print("    {:<18} {} between nodes: at most {:.1f} % of what the certificate bounds there\n",
               "points", m.points_evaluated, 100 * m.worst_share);
  if (m.field_points > 0)
    fmt::print("    {:<18} {} by chance: verify's own F errs by at most {:.2g} % of what it charges\n",
               "nodes", m.field_points, 100 * m.field_share);
  for (const std::string& what : m.differences) fmt::print("    DIFFERS            {}\n", what);
}

}  // namespace vdvr::cli
