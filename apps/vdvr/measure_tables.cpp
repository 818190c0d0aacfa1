#include "apps/vdvr/measure_tables.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace vdvr::cli {
namespace {

// Of a table of components for people.
constexpr std::size_t most_rows = 10;

// Six digits, and no more than x says; upward by the sign.
std::string rounded_down(double x) {
  std::string text = fmt::format("{:.6g}", x);
  if (std::stod(text) > x) {
    const double digit = std::pow(10.0, std::floor(std::log10(std::abs(x))) - 5);
    text = fmt::format("{:.6g}", std::stod(text) - digit);
  }
  return text;
}
std::string rounded_up(double x) {
  const std::string text = rounded_down(-x);
  return text == "0" || text == "-0" ? "0" : text[0] == '-' ? text.substr(1) : "-" + text;
}

std::string with_unit(const std::string& text, const std::string& unit) {
  return unit.empty() ? text : text + " " + unit;
}

// --- CSV: the shortest texts that read back to the same numbers ---

std::string fields(std::initializer_list<double> values) {
  std::string out;
  for (const double v : values) out += (out.empty() ? "" : ",") + fmt::format("{}", v);
  return out;
}

}  // namespace

Json interval_json(const Interval& i) { return {{"lo", i.lo}, {"hi", i.hi}}; }

std::string interval_text(const Interval& i, const std::string& unit) {
  std::string text = with_unit(fmt::format("{} to {}", rounded_down(i.lo), rounded_up(i.hi)), unit);
  const double middle = i.middle();
  if (middle != 0 && i.width() > 0 && std::abs(0.5 * i.width() / middle) < 0.5)
    text += fmt::format(" ({:.4g} +- {:.2g} %)", middle, 50 * i.width() / std::abs(middle));
  return text;
}

Json distribution_json(const Distribution& d) {
  Json at_least = Json::array(), within = Json::array();
  for (const Interval& i : d.at_least) at_least.push_back(interval_json(i));
  for (const Interval& i : d.within) within.push_back(interval_json(i));
  return {{"edges", d.edges}, {"at_least", at_least}, {"within", within}};
}

std::string distribution_csv(const Distribution& d) {
  std::string out = "from,to,volume_lo,volume_hi,at_least_lo,at_least_hi\n";
  for (std::size_t i = 0; i < d.within.size(); ++i)
    out += fields({d.edges[i], d.edges[i + 1], d.within[i].lo, d.within[i].hi, d.at_least[i].lo,
                   d.at_least[i].hi}) +
           "\n";
  return out;
}

Json line_json(const LineMeasure& l, bool crossings) {
  Json out = {{"length", l.length}, {"covered", {l.covered.lo, l.covered.hi}}};
  Json at = Json::array(), lo = Json::array(), hi = Json::array();
  for (std::size_t i = 0; i < l.at.size(); ++i) {
    at.push_back(l.at[i]);
    lo.push_back(l.value[i].lo);
    hi.push_back(l.value[i].hi);
  }
  out["profile"] = {{"at", at}, {"lo", lo}, {"hi", hi}};
  if (!crossings) return out;
  Json list = Json::array(), runs = Json::array();
  for (const LineCrossing& c : l.crossings) {
    Json one = interval_json(c.at);
    one["rising"] = c.rising;
    list.push_back(one);
  }
  for (const LineRun& r : l.runs)
    runs.push_back({{"above", r.above},
                    {"from", interval_json(r.from)},
                    {"to", interval_json(r.to)},
                    {"width", r.width ? interval_json(*r.width) : Json()}});
  out["crossings"] = list;
  out["runs"] = runs;
  out["undecided"] = l.undecided;
  return out;
}

std::string line_csv(const LineMeasure& l, const Vec3& p, const Vec3& q) {
  std::string out = "at,x,y,z,lo,hi\n";
  for (std::size_t i = 0; i < l.at.size(); ++i) {
    Vec3 x{};
    for (std::size_t a = 0; a < 3; ++a) x[a] = p[a] + l.at[i] / l.length * (q[a] - p[a]);
    out += fields({l.at[i], x[0], x[1], x[2], l.value[i].lo, l.value[i].hi}) + "\n";
  }
  return out;
}

std::vector<std::string> line_lines(const LineMeasure& l, const std::optional<double>& value,
                                    const std::string& unit) {
  std::vector<std::string> out{fmt::format("line           {:.6g} {}, measured from {:.6g} to {:.6g}",
                                           l.length, unit, l.covered.lo, l.covered.hi)};
  if (!value) return out;
  for (const LineCrossing& c : l.crossings)
    out.push_back(
        fmt::format("crossing       {}, {}", interval_text(c.at, unit), c.rising ? "rising" : "falling"));
  for (const LineRun& r : l.runs) {
    const char* side = r.above ? "above" : "below";
    out.push_back(
        r.width ? fmt::format("width          {}, {} {:.6g}", interval_text(*r.width, unit), side, *value)
                : fmt::format("width          unknown: from {:.6g} to {:.6g} F lies {} {:.6g}, and may pass "
                              "it between",
                              r.from.lo, r.to.hi, side, *value));
  }
  out.push_back(
      fmt::format("undecided      {:.4g} {} of the line: F may be on either side there", l.undecided, unit));
  return out;
}

Json components_json(const ComponentTable& t) {
  Json rows = Json::array();
  for (const MeasuredComponent& c : t.rows)
    rows.push_back({{"volume", interval_json(c.volume)},
                    {"box", c.box},
                    {"certain", c.certain()},
                    {"sure_parts", c.sure_parts},
                    {"spans", {text_of(c.spans[0]), text_of(c.spans[1]), text_of(c.spans[2])}}});
  return {{"certain", t.certain},
          {"possible", t.possible},
          {"sure_parts", t.sure_parts},
          {"uncertain_volume", t.uncertain_volume},
          {"largest_uncertain", t.largest_uncertain},
          {"rows", rows}};
}

std::string components_csv(const ComponentTable& t) {
  std::string out = "volume_lo,volume_hi,x0,y0,z0,x1,y1,z1,certain,sure_parts,spans_x,spans_y,spans_z\n";
  for (const MeasuredComponent& c : t.rows)
    out += fields({c.volume.lo, c.volume.hi, c.box[0], c.box[1], c.box[2], c.box[3], c.box[4], c.box[5]}) +
           fmt::format(",{},{},{},{},{}\n", c.certain() ? 1 : 0, c.sure_parts, text_of(c.spans[0]),
                       text_of(c.spans[1]), text_of(c.spans[2]));
  return out;
}

std::vector<std::string> components_lines(const ComponentTable& t, const std::string& unit) {
  std::vector<std::string> out{
      fmt::format("components     at least {}: {} separate places can hold any, of which {} surely do",
                  t.certain, t.possible, t.certain),
      fmt::format("sure parts     {}: those of one place may be connected or not", t.sure_parts),
      fmt::format("volume         {}", interval_text(t.volume, unit)),
      fmt::format("uncertain      {} places may hold none: together at most {} {}, the largest {}",
                  t.possible - t.certain, rounded_up(t.uncertain_volume), unit,
                  rounded_up(t.largest_uncertain))};
  for (std::size_t i = 0; i < std::min(t.rows.size(), most_rows); ++i) {
    const MeasuredComponent& c = t.rows[i];
    out.push_back(fmt::format(
        "{:<15}{}; {}; x {:.5g} to {:.5g}, y {:.5g} to {:.5g}, z {:.5g} to {:.5g}; spans x {}, y {}, z {}",
        fmt::format("  {}", i + 1), interval_text(c.volume, unit),
        !c.certain()        ? std::string("may hold none")
        : c.sure_parts == 0 ? std::string("holds some")
        : c.sure_parts == 1 ? std::string("one sure part")
                            : fmt::format("{} sure parts", c.sure_parts),
        c.box[0], c.box[3], c.box[1], c.box[4], c.box[2], c.box[5], text_of(c.spans[0]), text_of(c.spans[1]),
        text_of(c.spans[2])));
  }
  if (t.rows.size() > most_rows)
    out.push_back(fmt::format("  ...          {} more rows: --output", t.rows.size() - most_rows));
  return out;
}

}  // namespace vdvr::cli
