#include "apps/vdvr/report_measured.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/vdvr/html.hpp"
#include "apps/vdvr/measure_tables.hpp"
#include "vdvr/error.hpp"
#include "vdvr/expert/measure_picture.hpp"

namespace vdvr::cli {
namespace {

// Rows of the table in the report.
constexpr std::size_t most_reported = 12;

Interval in_percent(const Interval& i) { return {100 * i.lo, 100 * i.hi}; }

std::string held(const MeasuredComponent& c) { return c.certain() ? "yes" : "may hold none"; }

}  // namespace

void add_measured(Arguments& args) {
  args.group("What is measured (`vdvr measure` has more)")
      .value("above", "C", "measure where F is at least C: volume, share, separate parts, a picture")
      .value("below", "C", "the same where F is at most C: pores");
}

std::optional<MeasuredByRun> asked_to_measure(const Arguments& args) {
  if (args.has("above") && args.has("below")) throw InputError("--above and --below: give one of them");
  if (!args.has("above") && !args.has("below")) return std::nullopt;
  if (args.has("window"))
    throw InputError("--window: beside it nothing bounds |V - F|, and --above and --below measure nothing");
  MeasuredByRun out;
  if (const auto above = args.number("above")) {
    out.what = fmt::format("F at least {:.6g}", *above);
    out.range.least = above;
  } else {
    out.range.largest = args.number("below");
    out.what = fmt::format("F at most {:.6g}", out.range.largest.value());
  }
  return out;
}

void measure_for_run(MeasuredByRun& out, const MixedVolume& volume, const Certificate& certificate,
                     double height, std::int64_t side, const OutputFolder& folder, const Progress& progress) {
  try {
    const Measurement measurement(volume, certificate);
    out.volume = measurement.volume(out.range, {}, progress);
    out.components = measurement.components(out.range, {}, progress);
    const MeasurePictureOptions slice{2, height, side, side};
    write_png(folder.file("measured.png"), class_slice(measurement, out.range, slice));
    write_png(folder.file("components.png"), component_slice(measurement, out.range, slice, {}, progress));
  } catch (const InputError& e) {
    // Of a scan of one row no point is covered: no reason to lose the rest.
    out.why_not = e.what();
  }
}

Json measured_json(const MeasuredByRun& m) {
  if (!m.why_not.empty()) return {{"what", m.what}, {"why_not", m.why_not}};
  return {{"what", m.what},
          {"volume", interval_json(m.volume.volume)},
          {"fraction", interval_json(m.volume.fraction)},
          {"region", interval_json(m.volume.region)},
          {"components", components_json(m.components)}};
}

std::vector<std::string> measured_lines(const MeasuredByRun& m, const std::string& unit) {
  if (!m.why_not.empty()) return {fmt::format("measured       nothing: {}", m.why_not)};
  return {fmt::format("measured       {}: {}", m.what, interval_text(m.volume.volume, unit + "^3")),
          fmt::format("  fraction     {}", interval_text(in_percent(m.volume.fraction), "%")),
          fmt::format("  parts        at least {}, in {} separate places", m.components.certain,
                      m.components.possible)};
}

std::string measured_section(const MeasuredByRun& m, const std::string& unit) {
  std::string html = "<section>\n<h2>Measured: " + escaped(m.what) + "</h2>\n";
  if (!m.why_not.empty()) return html + "<p>Nothing: " + escaped(m.why_not) + ".</p>\n</section>\n";
  const std::string cubed = unit + "^3";
  html += pairs_table(
      {{"volume", escaped(interval_text(m.volume.volume, cubed))},
       {"share of the region", escaped(interval_text(in_percent(m.volume.fraction), "%"))},
       {"region", escaped(interval_text(m.volume.region, cubed))},
       {"parts that exist", "at least " + count_html(static_cast<std::uint64_t>(m.components.certain))},
       {"separate places that can hold any", count_html(static_cast<std::uint64_t>(m.components.possible))}});
  if (!m.components.rows.empty())
    html += table_head({"place", "volume", "holds any", "spans x", "spans y", "spans z"});
  for (std::size_t i = 0; i < std::min(most_reported, m.components.rows.size()); ++i) {
    const MeasuredComponent& c = m.components.rows[i];
    html += table_row(std::to_string(i + 1), {escaped(interval_text(c.volume, cubed)), held(c),
                                              text_of(c.spans[0]), text_of(c.spans[1]), text_of(c.spans[2])});
  }
  if (!m.components.rows.empty()) html += table_end;
  return html +
         "<p class=\"note\">Intervals hold for every field within the bound, F among them. Two points of "
         "different "
         "places are surely not connected. The pictures measured.png and components.png show a "
         "slice.</p>\n</section>\n";
}

}  // namespace vdvr::cli
