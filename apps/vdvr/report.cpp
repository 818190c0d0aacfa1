#include "apps/vdvr/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/common/messages.hpp"
#include "apps/vdvr/cone.hpp"
#include "apps/vdvr/html.hpp"
#include "apps/vdvr/output.hpp"
#include "apps/vdvr/report_chart.hpp"
#include "apps/vdvr/report_storage.hpp"
#include "vdvr/expert/extend_rows.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr::cli {
namespace {

constexpr const char* kStyle = R"css(
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: #1b1f24; line-height: 1.5;
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", "Noto Sans", Arial, sans-serif; }
main { max-width: 62rem; margin: 0 auto; padding: 1.5rem 1.25rem 3rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: .2rem 0; overflow-wrap: anywhere; }
h2 { font-size: 1.25rem; margin: 2.6rem 0 .8rem; padding-bottom: .3rem; border-bottom: 1px solid #d5d9df; }
h3 { font-size: 1rem; margin: 1.6rem 0 .4rem; }
p, ul { margin: .5rem 0; } ul { padding-left: 1.2rem; } li { margin: .25rem 0; }
.over, .note, figcaption small { color: #555d68; } .over { margin: 0; } .note { font-size: .9rem; }
.verdict { border-left: 5px solid #1a7f4b; background: #f1f8f4; padding: .8rem 1rem; margin: 1.2rem 0; }
.verdict.no { border-color: #b3261e; background: #fdf2f1; }
.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(9.5rem, 1fr)); gap: .8rem; margin: 1rem 0; }
.facts div { border: 1px solid #d5d9df; border-radius: 6px; padding: .6rem .8rem; }
.facts b { display: block; font-size: 1.35rem; line-height: 1.3; font-weight: 600; }
.facts span { font-size: .85rem; color: #555d68; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 18rem), 1fr)); gap: 1.2rem; }
figure { margin: 0; break-inside: avoid; }
figure img { display: block; width: 100%; height: auto; border-radius: 4px; background: #000; }
figcaption { font-size: .9rem; margin-top: .35rem; overflow-wrap: anywhere; }
figcaption small { display: block; font-size: .8rem; line-height: 1.4; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; margin: .6rem 0 1rem; }
th, td { text-align: left; vertical-align: top; padding: .35rem .6rem .35rem 0; border-bottom: 1px solid #e4e7eb;
  overflow-wrap: anywhere; }
thead th { color: #555d68; font-weight: 600; overflow-wrap: normal; }
th { overflow-wrap: break-word; }
tbody th { font-weight: 600; } th small { display: block; font-weight: 400; color: #555d68; } .pairs th { width: 12rem; font-weight: 400; color: #555d68; overflow-wrap: normal; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; } td.n { white-space: nowrap; }
td.b { width: 26%; vertical-align: middle; padding-left: .4rem; }
.bar { display: block; width: 100%; height: 1.5rem; border-radius: 3px; } td.b .bar { height: .8rem; }
.row { display: flex; flex-wrap: wrap; justify-content: space-between; gap: 0 1rem; margin: .7rem 0 .15rem; font-size: .9rem; }
.legend { display: flex; flex-wrap: wrap; gap: .2rem 1.1rem; font-size: .85rem; margin: .6rem 0; }
.key { width: .75rem; height: .75rem; } svg.key.line { width: .2rem; }
code, pre { font: .85rem/1.5 ui-monospace, SFMono-Regular, Menlo, Consolas, "DejaVu Sans Mono", monospace;
  overflow-wrap: anywhere; }
pre { background: #f5f6f8; border-radius: 4px; padding: .7rem .9rem; white-space: pre-wrap; margin: .5rem 0; }
footer { margin-top: 3rem; font-size: .85rem; color: #555d68; }
@media (max-width: 36rem) {
  main { padding: 1rem .9rem 2rem; } h1 { font-size: 1.5rem; }
  .pairs, .pairs tbody, .pairs tr, .pairs th, .pairs td { display: block; width: auto; border: 0; padding: 0; }
  .pairs tr { border-bottom: 1px solid #e4e7eb; padding: .35rem 0; }
  td.b { width: 14%; } th.n, td.n { padding-right: .4rem; } table { font-size: .82rem; }
}
@media print {
  @page { margin: 16mm; }
  body { font-size: 10.5pt; } main { max-width: none; padding: 0; }
  h2, h3 { break-after: avoid; } tr, .facts div, .verdict { break-inside: avoid; }
  .pictures { grid-template-columns: 1fr 1fr; }
}
)css";

// --- pieces ---

void add(Pairs& pairs, const std::string& name, const std::string& value) { pairs.push_back({name, value}); }

std::string list(const std::vector<std::string>& notes) {
  std::string html = "<ul>\n";
  for (const std::string& note : notes) html += fmt::format("<li>{}</li>\n", escaped(with_options(note)));
  return html + "</ul>\n";
}

std::string point_text(const Vec3& p, const std::string& unit) {
  return escaped(fmt::format("{} {}", vec_text(p), unit));
}

/// By the device's samplers for which the certificate was asked.
bool holds(const Certificate& c) { return c.holds_buffer && c.holds_image3d.value_or(true); }

// --- head ---

std::string fact(const std::string& value, const std::string& what) {
  return fmt::format("<div><b>{}</b><span>{}</span></div>\n", value, what);
}

std::string verdict(const RunReport& run) {
  const Certificate& c = run.certificate;
  const std::string where =
      fmt::format("{}{}", c.roi ? " of the region of interest" : "", c.window ? " within the window" : "");
  const std::string promise = fmt::format(
      "At every covered point{} the field that you see lies within {} density units of F: {}&nbsp;% of the "
      "range "
      "of F, which is {}.",
      where, number_html(c.epsilon_abs, "epsilon_abs"), number_text(100 * c.epsilon),
      number_html(c.reference_range, "reference_range"));
  if (holds(c))
    return fmt::format("<p class=\"verdict\"><strong>The certificate holds.</strong> {}</p>\n", promise);
  return fmt::format(
      "<p class=\"verdict no\"><strong>The certificate holds for the sampler \xE2\x80\x98{}\xE2\x80\x99 "
      "only.</strong> {} Render with "
      "<code>--sampler {}</code>, or ask for a larger epsilon.</p>\n",
      c.holds_buffer ? "buffer" : "image3d", promise, c.holds_buffer ? "buffer" : "image3d");
}

std::string head(const RunReport& run) {
  const Certificate& c = run.certificate;
  const ParallelGeometry& g = run.scan.geometry;
  const Storage storage = storage_of(run.volume, false);
  const double total =
      std::max(c.total_buffer, c.holds_image3d.value_or(false) ? c.total_image3d.value_or(0) : 0);
  return fmt::format(
             "<header>\n<p class=\"over\">Certified volume from X-ray CT projections</p>\n<h1>{}</h1>\n",
             escaped(run.scan.report.name)) +
         fmt::format("<p class=\"over\">{} views of {} \xC3\x97 {} pixels, {} beam</p>\n", g.views(),
                     g.columns, g.rows, run.scan.cone ? "cone" : "parallel") +
         verdict(run) + "<div class=\"facts\">\n" +
         fact(number_html(c.epsilon_abs),
              fmt::format("tolerance in density units, {}&nbsp;% of the range of F",
                          number_text(100 * c.epsilon))) +
         fact(percent(total, c.epsilon_abs), "of the tolerance is used by all errors together") +
         fact(percent(storage.bytes_ratio, 1), "of the bytes of the uniform float32 grid") +
         fact(percent(run.verified.total, c.epsilon_abs), "of the tolerance, measured again by verify") +
         "</div>\n</header>\n";
}

// --- pictures ---

std::string pictures(const RunReport& run) {
  std::string html = "<section>\n<h2>Pictures</h2>\n<div class=\"pictures\">\n";
  for (const ReportPicture& p : run.pictures) {
    html += fmt::format("<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{2}: {0}",
                        escaped(p.caption), base64(p.png), code(p.name));
    if (!p.outside.empty())
      html += fmt::format("<small>beyond the certificate: {}</small>", escaped(p.outside));
    html += "</figcaption></figure>\n";
  }
  return html +
         fmt::format(
             "</div>\n<p class=\"note\">The pictures show samples within {} density units of F. Rendered "
             "with the sampler {} ({}). Largest |V \xE2\x88\x92 F| on the {} pixels of {}: {}, {} of the "
             "tolerance.</p>\n</section>\n",
             number_text(run.certificate.epsilon_abs), escaped(run.sampler), escaped(run.sampler_reason),
             count_html(static_cast<std::uint64_t>(run.error.pixels)), code("error.png"),
             number_html(run.error.max_error), percent(run.error.max_error, run.certificate.epsilon_abs));
}

// --- the certificate in words ---

/// What the bounds are in units of the scan's noise.
std::string in_sigma(const Certificate& c) {
  if (!c.noise) return "";
  const NoiseRecord& n = *c.noise;
  return fmt::format(
      "<li>In units of the scan's own noise: interpolation errs by at most {} sigma of the brick{}{}. Sigma, "
      "the "
      "standard deviation of F, runs from {} to {}, {} in the middle: an estimate, from {}{}.</li>\n",
      number_html(worst_in_sigma(c, false), "noise.worst.buffer"),
      n.tolerance_sigmas ? fmt::format(", where {} was asked for", number_text(*n.tolerance_sigmas)) : "",
      n.rms_in_sigma
          ? fmt::format(" ({} in the root mean square, estimated at {} points): the noise of this volume is "
                        "at most {:.3g} "
                        "times that of F, in practice below it",
                        number_html(*n.rms_in_sigma, "noise.rms.sigmas"), n.rms_points, 1 + *n.rms_in_sigma)
          : "",
      number_html(n.least, "noise.sigma.least"), number_html(n.largest, "noise.sigma.largest"),
      number_html(n.median, "noise.sigma.median"), escaped(n.source),
      n.split_ratio ? "; " + escaped(split_words(*n.split_ratio, n.split_resolved)) : "");
}

std::string promised(const RunReport& run) {
  const Certificate& c = run.certificate;
  std::string html = fmt::format(
      "<h3>Promised</h3>\n<p><strong>|V(x) \xE2\x88\x92 F(x)| \xE2\x89\xA4 {} at every covered point "
      "x.</strong> V is the volume as "
      "stored and sampled. F is {} of these projections with ideal interpolation. The bound adds up what was "
      "measured and what was proved: the grid's interpolation, the reference's own, that of the projections, "
      "rounding, and the sampler of the device.</p>\n<ul>\n",
      number_html(c.epsilon_abs), run.scan.cone ? "the FDK reconstruction" : "the filtered back-projection");
  const auto sampler = [&](const char* name, bool good, double total) {
    html +=
        fmt::format("<li>With the sampler {} it <strong>{}</strong>: total {}, {} of the tolerance.</li>\n",
                    code(name), good ? "holds" : "does not hold",
                    number_html(total, fmt::format("total.{}", name)), percent(total, c.epsilon_abs));
  };
  sampler("buffer", c.holds_buffer, c.total_buffer);
  if (c.holds_image3d && c.total_image3d) sampler("image3d", *c.holds_image3d, *c.total_image3d);
  return html + in_sigma(c) + "</ul>\n";
}

std::string not_promised(const RunReport& run) {
  const Certificate& c = run.certificate;
  std::string html =
      "<h3>Not promised</h3>\n<ul>\n<li>Physics: noise, too few views, scattering, motion, a wrong centre or "
      "a "
      "truncated object shape F itself.</li>\n<li>Colours, shading and the step along a ray: they are the "
      "picture\xE2\x80\x99s, not the certificate\xE2\x80\x99s.</li>\n";
  html += fmt::format(
      "<li>Points that some view does not see: {} samples, {} % of the grid, are not covered ({}).</li>\n",
      count_html(static_cast<std::uint64_t>(c.not_covered_count)), number_html(100 * c.not_covered_fraction),
      escaped(c.not_covered_rule));
  if (c.window)
    html += fmt::format("<li>Values outside the window: only where F lies in [{}, {}].</li>\n",
                        number_html(c.window->first), number_html(c.window->second));
  if (c.roi) {
    const auto& r = *c.roi;
    html += fmt::format("<li>Points outside the region of interest, from {} to {}.</li>\n",
                        point_text({r[0], r[1], r[2]}, run.volume.grid.unit),
                        point_text({r[3], r[4], r[5]}, run.volume.grid.unit));
  }
  if (!c.field.preparation.none())
    html += fmt::format("<li>The projections as measured: F is that of the prepared projections ({}).</li>\n",
                        escaped(text_of(c.field.preparation)));
  return html + "</ul>\n<h3>Notes</h3>\n" + list(c.notes);
}

// --- its shares ---

std::vector<BarPart> parts_of(double at_nodes, double with_gold, double arithmetic, double sampler) {
  return {{"grid: |V \xE2\x88\x92 gold| at nodes", kGrid, at_nodes},
          {"gold and projection: what they add to it", kBetween, with_gold - at_nodes},
          {"arithmetic", kArithmetic, arithmetic},
          {"sampler", kSampler, sampler}};
}

std::string bar_row(const std::string& name, const std::vector<BarPart>& parts, double total, double full,
                    double tolerance) {
  return fmt::format(
             "<div class=\"row\"><span>{}</span><span>{} density units, {} of the tolerance</span></div>\n",
             escaped(name), number_html(total), percent(total, tolerance)) +
         stacked_bar(parts, full, tolerance,
                     fmt::format("{}: {} of {}", name, number_text(total), number_text(tolerance))) +
         "\n";
}

/// Verify's own arithmetic is contained in its measured total.
std::string bars(const RunReport& run) {
  const Certificate& c = run.certificate;
  const VerifyResult& v = run.verified;
  const double full = 1.04 * std::max({c.epsilon_abs, c.total_buffer, c.total_image3d.value_or(0),
                                       v.total_buffer, v.total_image3d.value_or(0)});
  const auto certified = [&](const char* name, double total, const ErrorTerm& sampler) {
    return bar_row(fmt::format("{}, certified", name),
                   parts_of(c.measured_max, c.measured_total, c.budget.arithmetic.value, sampler.value),
                   total, full, c.epsilon_abs);
  };
  const auto measured = [&](const char* name, double total) {
    return bar_row(fmt::format("{}, measured again by verify", name),
                   parts_of(v.measured_max, v.measured_total, 0, total - v.measured_total), total, full,
                   c.epsilon_abs);
  };
  std::string html =
      certified("buffer", c.total_buffer, c.budget.sampler.buffer) + measured("buffer", v.total_buffer);
  if (c.total_image3d && c.budget.sampler.image3d)
    html += certified("image3d", *c.total_image3d, *c.budget.sampler.image3d);
  if (v.total_image3d) html += measured("image3d", *v.total_image3d);
  return html + legend(parts_of(0, 0, 0, 0)) +
         fmt::format("<p class=\"note\">The red line is the tolerance, {} density units.</p>\n",
                     number_text(c.epsilon_abs));
}

std::string terms(const Certificate& c) {
  std::string html = "<h3>The largest of each term</h3>\n" +
                     table_head({"term, and how it was found", "density units", "share"}, /*bars=*/true);
  const auto row = [&](const std::string& name, const ErrorTerm& t, const std::string& member,
                       const char* color) {
    html += table_row(fmt::format("{}<small>{}</small>", name, escaped(t.method)),
                      {number_html(t.value, "budget." + member + ".value"), percent(t.value, c.epsilon_abs)},
                      stacked_bar({{name, color, t.value}}, c.epsilon_abs, 0, name));
  };
  row("grid", c.budget.grid, "grid", kGrid);
  row("gold", c.budget.gold, "gold", kBetween);
  row("projection", c.budget.projection, "projection", kBetween);
  row("arithmetic", c.budget.arithmetic, "arithmetic", kArithmetic);
  row("sampler buffer", c.budget.sampler.buffer, "sampler.buffer", kSampler);
  if (c.budget.sampler.image3d)
    row("sampler image3d", *c.budget.sampler.image3d, "sampler.image3d", kSampler);
  return html + table_end +
         "<p class=\"note\">They do not peak at one point, and so do not add up to the "
         "total.</p>\n";
}

std::string verification(const RunReport& run) {
  const Certificate& c = run.certificate;
  const VerifyResult& v = run.verified;
  std::string html = "<h3>Measured again</h3>\n" + table_head({"density units", "certified", "measured"});
  const auto row = [&](const std::string& name, const std::string& certified, double measured) {
    html += table_row(name, {certified, number_html(measured)});
  };
  row("|V \xE2\x88\x92 F| at nodes", number_html(c.measured_max, "measured_max"), v.measured_max);
  row("and between them", number_html(c.measured_total, "measured_total"), v.measured_total);
  row("total, sampler buffer", number_html(c.total_buffer), v.total_buffer);
  if (c.total_image3d && v.total_image3d)
    row("total, sampler image3d", number_html(*c.total_image3d), *v.total_image3d);
  html += table_end;
  html += fmt::format(
      "<p class=\"note\"><code>verify</code> looked at {} of {} bricks, {} gold cells and {} gold nodes, by "
      "a path of "
      "its own: the certificate {}. Worst at {}.</p>\n",
      count_html(static_cast<std::uint64_t>(v.bricks_tested)),
      count_html(static_cast<std::uint64_t>(v.bricks)),
      count_html(static_cast<std::uint64_t>(v.cells_tested)),
      count_html(static_cast<std::uint64_t>(v.nodes_tested)), v.holds ? "holds" : "does not hold",
      point_text(v.worst_at, run.volume.grid.unit));
  return html;
}

// --- settings and input ---

std::string span_html(const Json& span, const std::string& unit) {
  const double low = span[0].get<double>(), high = span[1].get<double>();
  const bool one = high - low <= 1e-9 * std::abs(high);
  return escaped(one ? fmt::format("{:.6g} {}", low, unit)
                     : fmt::format("{:.6g} to {:.6g} {}", low, high, unit));
}

void add_cone(const ProjectionSet& scan, Pairs& pairs) {
  const Json cone = cone_json(scan);
  const std::string& unit = scan.geometry.unit;
  add(pairs, "source to axis", span_html(cone.at("source_to_axis"), unit));
  if (cone.contains("source_to_detector"))
    add(pairs, "source to detector",
        escaped(fmt::format("{:.6g} {}, magnification {:.4g}", cone.at("source_to_detector").get<double>(),
                            unit, cone.at("magnification").get<double>())));
  add(pairs, "isocentre",
      fmt::format("column {}, row {}", span_html(cone.at("center"), ""), span_html(cone.at("row"), "")));
  add(pairs, "angles",
      escaped(fmt::format("half fan {:.2f}\xC2\xB0, half cone {:.2f}\xC2\xB0, arc {:.2f}\xC2\xB0 ({})",
                          cone.at("half_fan_deg").get<double>(), cone.at("half_cone_deg").get<double>(),
                          cone.at("arc_deg").get<double>(), cone.at("redundancy").get<std::string>())));
}

std::string settings(const RunReport& run) {
  const Certificate& c = run.certificate;
  const Grid& g = run.volume.grid;
  const auto base = cells_per_base_sample(run.volume.coarsening);
  Pairs pairs;
  add(pairs, "tolerance",
      fmt::format("{} density units, {} % of the range of F, {}", number_html(c.epsilon_abs),
                  number_text(100 * c.epsilon), number_html(c.reference_range)));
  add(pairs, "field",
      fmt::format("{}, filter {} to {} of Nyquist{}", run.scan.cone ? "FDK" : "filtered back-projection",
                  text_of(c.field.filter), number_text(c.field.cutoff),
                  c.field.center ? fmt::format(", centre at column {:.4f}", *c.field.center) : ""));
  add(pairs, "preparation", escaped(text_of(c.field.preparation)));
  add(pairs, "rates",
      fmt::format("projections {}\xC3\x97 in u ({}), gold {}\xC3\x97 the grid", c.rates.upsampling,
                  text_of(c.rates.interpolation), c.rates.gold));
  add(pairs, "grid",
      escaped(fmt::format("{} \xC3\x97 {} \xC3\x97 {} cells of {:.6g} \xC3\x97 {:.6g} \xC3\x97 {:.6g} {}",
                          g.cells[0], g.cells[1], g.cells[2], g.spacing[0], g.spacing[1], g.spacing[2],
                          g.unit)));
  add(pairs, "first sample", point_text(g.origin, g.unit));
  add(pairs, "base",
      fmt::format("a sample every {} \xC3\x97 {} \xC3\x97 {} cells, stored as {}", base[0], base[1], base[2],
                  text_of(run.volume.base.type)));
  // What else the volume was built with, as the certificate keeps it.
  const Json options = Json::parse(c.options_json, nullptr, false);
  if (options.is_object())
    for (const std::string name : {"closing", "coefficients", "levels", "storage", "terms", "epsilon_of"})
      if (options.contains(name) && options[name].is_string())
        add(pairs, escaped(name == "epsilon_of" ? "epsilon of" : name),
            escaped(options[name].get<std::string>()));
  return "<section>\n<h2>Settings</h2>\n" + pairs_table(pairs) + "</section>\n";
}

std::string input(const RunReport& run) {
  const ParallelGeometry g = own_detector(run.scan.geometry);
  const InputReport& r = run.scan.report;
  Pairs pairs;
  add(pairs, "scan", fmt::format("{} ({})", escaped(r.name), escaped(r.format)));
  add(pairs, "projections",
      fmt::format("{} views of {} \xC3\x97 {} pixels (columns \xC3\x97 rows)", g.views(), g.columns, g.rows));
  add(pairs, run.scan.cone ? "pitch at the axis" : "pitch",
      escaped(fmt::format("{:.6g} \xC3\x97 {:.6g} {}", g.pitch_u, g.pitch_v, g.unit)));
  if (!g.theta_rad.empty()) {
    add(pairs, "first and last angle",
        fmt::format("{:.6g}\xC2\xB0 and {:.6g}\xC2\xB0", g.theta_rad.front() * degrees_per_radian,
                    g.theta_rad.back() * degrees_per_radian));
  }
  add(pairs, "centre", fmt::format("column {:.4f} ({})", stated_center({}, g), escaped(r.center_source)));
  if (run.scan.cone) add_cone(run.scan, pairs);
  add(pairs, "dead pixels", fmt::format("{} replaced", r.dead_pixels));
  if (r.air_background) add(pairs, "background", "linear air background taken off");
  return "<section>\n<h2>Input</h2>\n" + pairs_table(pairs) +
         (r.notes.empty() ? "" : "<h3>What was noticed and assumed</h3>\n" + list(r.notes)) + "</section>\n";
}

// --- timings, device, hashes, commands ---

std::string timings(const RunReport& run) {
  double sum = 0, largest = 0;
  for (const auto& [stage, s] : run.seconds) {
    sum += s;
    largest = std::max(largest, s);
  }
  std::string html =
      "<section>\n<h2>Time and device</h2>\n" + table_head({"stage", "seconds"}, /*bars=*/true);
  const auto row = [&](const std::string& name, double s, const char* color) {
    html += table_row(escaped(name), {fmt::format("{:.2f} s", s)},
                      stacked_bar({{name, color, s}}, largest, 0, name));
  };
  for (const auto& [stage, s] : run.seconds) {
    row(stage, s, kGrid);
    if (stage == "build")
      for (const auto& [step, part] : run.build_seconds) row("build: " + step, part, kBetween);
  }
  html += fmt::format(
      "<tr><th scope=\"row\">all</th><td class=\"n\">{:.2f} s</td><td></td></tr>\n</tbody></table>\n", sum);
  const DeviceInfo& d = run.device;
  return html +
         pairs_table({{"device", escaped(run.certificate.device)},
                      {"platform", escaped(d.platform)},
                      {"OpenCL", escaped(d.version)},
                      {"driver", escaped(run.certificate.driver)},
                      {"compute units", std::to_string(d.compute_units)},
                      {"memory", bytes_text(d.global_memory)}}) +
         "</section>\n";
}

std::string again(const RunReport& run) {
  const Certificate& c = run.certificate;
  return "<section>\n<h2>Make it again</h2>\n<p>The same volume (its content has the same hash on the same "
         "device and driver):</p>\n<pre>" +
         escaped(shell_line(run.run_words)) +
         "</pre>\n<p>Measure the certificate again, in every brick:</p>\n<pre>" +
         escaped(shell_line(run.verify_words)) + "</pre>\n<h3>Hashes</h3>\n" +
         pairs_table({{"input, SHA-256", code(c.input_sha256)},
                      {"content, SHA-256", code(c.content_sha256)},
                      {"program", escaped("vdvr " + c.version)}}) +
         "</section>\n";
}

}  // namespace

std::string report_page(const RunReport& run) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
         "content=\"width=device-width, initial-scale=1\">\n<title>" +
         escaped(run.scan.report.name) + " \xE2\x80\x93 certified volume</title>\n<style>" + kStyle +
         "</style>\n</head>\n<body>\n<main>\n" + head(run) + pictures(run) +
         (run.measured ? measured_section(*run.measured, run.volume.grid.unit) : "") +
         "<section>\n<h2>The certificate</h2>\n" + promised(run) + not_promised(run) +
         "</section>\n<section>\n<h2>Shares of the tolerance</h2>\n" + bars(run) + terms(run.certificate) +
         verification(run) + "</section>\n" + storage_section(run) + settings(run) + input(run) +
         timings(run) + again(run) + "<footer>Written by vdvr " + escaped(run.certificate.version) +
         ". What is promised stands in certificate.json and in volume.vdvr; this page repeats "
         "it.</footer>\n</main>\n</body>\n</html>\n";
}

}  // namespace vdvr::cli
