#include "host/scan/scan_report.hpp"

#include <fmt/format.h>

#include "vdvr/error.hpp"

namespace vdvr {
namespace {

// The views used but those of a rising list, as the file counts them.
ViewRanges used_ranges(const io::RawScan& raw, const std::vector<std::int64_t>& without) {
  ViewRanges ranges;
  std::size_t next = 0;
  for (std::int64_t k = 0; k < raw.projections.count; ++k) {
    if (next < without.size() && without[next] == k) {
      ++next;
      continue;
    }
    const std::int64_t number = raw.number(k);
    if (!ranges.empty() && ranges.back().second == number) ++ranges.back().second;
    else ranges.emplace_back(number, number + 1);
  }
  return ranges;
}

}  // namespace

void describe(const io::RawScan& raw, const ScanOptions& options, Understood& report) {
  report.stated = options.input;
  if (!report.stated.views.empty()) report.stated.views = used_ranges(raw, {});
  report.values = raw.values;
  report.values_source = raw.values_source;
  report.flats = raw.counts && !raw.flat_level ? raw.flats.count : 0;
  report.darks = raw.counts && !raw.dark_level ? raw.darks.count : 0;
  report.assumed = raw.assumed;
  const std::int64_t last = raw.projections.count - 1;
  for (const std::int64_t view : {std::int64_t{0}, std::int64_t{1}, last})
    if (view <= last && (report.frames.empty() || report.frames.back().view < view))
      report.frames.push_back({view, raw.number(view),
                               raw.view_files.empty() || raw.shared_files
                                   ? raw.projections.name(view)
                                   : raw.view_files[static_cast<std::size_t>(view)]});
  if (!raw.pitch_stated && !raw.cone)
    report.assumed.push_back(
        {"a pixel is 1 x 1", "no file states its size", "'pitch' and 'unit' of a scan.json"});
}

[[noreturn]] void refuse_blank(const io::RawScan& raw, const std::vector<std::int64_t>& blank, double floor) {
  const ViewRanges rest = used_ranges(raw, blank);
  const std::string others = blank.size() > 1 ? fmt::format(" and {} more", blank.size() - 1) : "";
  const std::string what = fmt::format("{}{}: no pixel of {} can be used (transmission above {:.3g})",
                                       raw.projections.name(blank[0]), others,
                                       blank.size() > 1 ? "these projections" : "this projection", floor);
  if (rest.empty()) throw FileError(what + "; flats and darks may be exchanged, or belong to another scan");
  constexpr std::size_t most = 200;  // characters of a list that anyone would type
  const std::string ranges = text_of(rest);
  throw FileError(fmt::format("{}; `views` {} leaves {} out", what,
                              ranges.size() <= most ? ranges : ranges.substr(0, most) + "...",
                              blank.size() > 1 ? "them" : "it"));
}

void note_saturated(const FlatField& field, double full, const io::ValueTotals& totals,
                    std::int64_t flat_samples, Understood& report) {
  if (full == 0) return;
  const auto note = [&](const char* what, std::int64_t at, std::int64_t samples, const char* effect) {
    if (100 * at < samples) return;
    report.warnings.push_back(
        fmt::format("{} are saturated: {:.1f} % of their samples are {:g}, the top of the range; {}", what,
                    100 * static_cast<double>(at) / static_cast<double>(samples), full, effect));
  };
  note("flats", field.at_largest, flat_samples, "transmissions there are too large, by an unknown factor");
  note("projections", totals.saturated, totals.samples,
       "transmissions there are too small, by an unknown factor");
}

void require_alive(const io::RawScan& raw, std::int64_t dead, std::int64_t samples, const std::string& name) {
  if (3 * dead < samples) return;
  throw FileError(fmt::format(
      "{}: {} of {} samples ({:.0f} %) are dead: no count above the dark, no flat above it, or not finite. "
      "Too many to replace by neighbours; look at the flats ({}) and darks ({}), and whether they are of "
      "this scan",
      name, dead, samples, 100 * static_cast<double>(dead) / static_cast<double>(samples),
      raw.flat_level ? fmt::format("level {:g}", *raw.flat_level) : fmt::format("{} frames", raw.flats.count),
      raw.dark_level ? fmt::format("level {:g}", *raw.dark_level)
                     : fmt::format("{} frames", raw.darks.count)));
}

}  // namespace vdvr
