#include "host/scan/values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "vdvr/error.hpp"

namespace vdvr::io {
namespace {

// No detector counts more than 2^32 in a pixel: a larger line integral, of whole numbers, is a transmission
// of less than one of them.
const double most_of_counts = 32 * std::log(2.0);

// The frames that stand for flats or darks where a level is given.
void set_level(RawScan& scan, const char* what, double level, Frames& frames, std::optional<double>& stated) {
  if (frames.count > 0 && !stated)
    scan.notes.push_back(fmt::format("the {} {} of the input are not used: the level {:g} stands for them",
                                     frames.count, what, level));
  frames = level_frame(level, scan.rows * scan.columns, fmt::format("the {}, {:g}", what, level));
  stated = level;
}

void refuse_contradictions(const InputStatement& options) {
  if (options.values != SampleValues::counts && options.values && (options.flat || options.dark))
    throw InputError(
        fmt::format("`{}` says that values are no counts: leave `flats` and `darks` out",
                    *options.values == SampleValues::transmission ? "transmission" : "line_integrals"));
}

// Of a bare stack, whose format says nothing: floats are line integrals, as programs write them; whole
// numbers need a statement.
SampleValues usual_values(const RawScan& scan, const std::string& name) {
  if (scan.format != "mha" && scan.format != "nrrd") return SampleValues::counts;
  if (scan.flats.count > 0 || scan.darks.count > 0) return SampleValues::counts;
  if (scan.integer)
    throw FileError(
        fmt::format("{}: holds whole numbers, which are counts as a rule: give the open beam by `flats` "
                    "LEVEL (and `darks` none), or images by 'flats' and 'darks' of a scan.json; "
                    "`line_integrals` says that -log was taken",
                    name));
  return SampleValues::line_integrals;
}

std::string remedy_for(const char* what) {
  return what == std::string("flats")
             ? "; counts need the open beam: 'flats' in scan.json (beside 'hdf5' too), or `flats` LEVEL. "
               "Values that are normalised already are read by `transmission`, and after -log by "
               "`line_integrals` (\"description\": \"line integrals\")"
             : "; counts need them: 'darks' in scan.json (beside 'hdf5' too), or `darks` none where the "
               "detector has no dark current, such as a photon counter. Values that are normalised already "
               "are read by `transmission`, and after -log by `line_integrals` (\"description\": \"line "
               "integrals\")";
}

void need(const Frames& frames, const std::string& none, const char* what, const std::string& name) {
  if (frames.count > 0) return;
  throw FileError((none.empty() ? fmt::format("{}: there are no {}", name, what) : none) + remedy_for(what));
}

}  // namespace

void settle_values(RawScan& scan, const InputStatement& options, const std::string& name) {
  refuse_contradictions(options);
  if ((options.flat || options.dark) && scan.stated && scan.stated != SampleValues::counts)
    throw InputError(fmt::format("{}: {} says that values are {}: leave `flats` and `darks` out", name,
                                 scan.values_source, text_of(*scan.stated)));
  if (options.flat) set_level(scan, "flats", *options.flat, scan.flats, scan.flat_level);
  if (options.dark) set_level(scan, "darks", *options.dark, scan.darks, scan.dark_level);
  if (options.values) {
    scan.values = *options.values;
    scan.values_source =
        *options.values == SampleValues::transmission ? "`transmission`" : "`line_integrals`";
  } else if (scan.stated) {
    scan.values = *scan.stated;
  } else if (options.flat || options.dark) {
    scan.values = SampleValues::counts;
    scan.values_source = options.flat ? "`flats`" : "`darks`";
  } else {
    scan.values = usual_values(scan, name);
    scan.values_source = scan.values == SampleValues::counts ? "flats and darks beside them" : "";
    if (scan.values == SampleValues::line_integrals)
      scan.assumed.push_back({"values are line integrals, after -log",
                              "the stack holds fractions and says nothing",
                              "`transmission`, or `flats` LEVEL for counts"});
  }
  scan.counts = scan.values != SampleValues::line_integrals;
  if (scan.values == SampleValues::transmission) {
    if (scan.integer)
      throw FileError(
          fmt::format("{}: holds whole numbers, which are no transmissions: `flats` LEVEL says which of them "
                      "is the open beam",
                      name));
    set_level(scan, "flats", 1, scan.flats, scan.flat_level);
    set_level(scan, "darks", 0, scan.darks, scan.dark_level);
  }
  if (!scan.counts) {
    scan.flats = scan.darks = {};
    return;
  }
  need(scan.flats, scan.no_flats, "flats", name);
  need(scan.darks, scan.no_darks, "darks", name);
}

void ValueTotals::add(std::span<const double> view, std::int64_t columns) {
  const auto rows = static_cast<std::int64_t>(view.size()) / columns;
  const std::int64_t third = columns / 3;
  double at_edges = 0, in_middle = 0;
  for (std::int64_t r = 0; r < rows; ++r) {
    const std::span<const double> row =
        view.subspan(static_cast<std::size_t>(r * columns), static_cast<std::size_t>(columns));
    at_edges += row.front() + row.back();
    for (std::int64_t c = third; c < columns - third; ++c) in_middle += row[static_cast<std::size_t>(c)];
  }
  for (const double p : view) {
    sum += p;
    largest = std::max(largest, p);
    fractions += p != std::floor(p) ? 1 : 0;
  }
  edges += at_edges / static_cast<double>(2 * rows);
  middle += in_middle / static_cast<double>(rows * (columns - 2 * third));
  samples += static_cast<std::int64_t>(view.size());
  ++views;
}

void ValueTotals::add(const ValueTotals& other) {
  sum += other.sum;
  largest = std::max(largest, other.largest);
  edges += other.edges;
  middle += other.middle;
  samples += other.samples;
  views += other.views;
  fractions += other.fractions;
  saturated += other.saturated;
}

double saturation_of(const RawScan& scan, double largest_flat) {
  if (!scan.integer) return 0;
  for (int bits = 8; bits <= 16; ++bits)
    for (const int shift : {0, 16 - bits})
      if (largest_flat == std::ldexp(std::ldexp(1.0, bits) - 1, shift)) return largest_flat;
  return 0;
}

void judge_values(const ValueTotals& t, RawScan& scan, const std::string& name) {
  const double mean = t.sum / static_cast<double>(t.samples), edges = t.edges / static_cast<double>(t.views),
               middle = t.middle / static_cast<double>(t.views);
  if (scan.counts && scan.flat_level && scan.air_columns.empty() && mean < -std::log(2.0))
    throw FileError(fmt::format(
        "{}: transmissions of {:.3g} on the average, where 1 is the open beam: these are counts with another "
        "one; `flats` LEVEL states it, 'air_columns' of scan.json take it from the images",
        name, std::exp(-mean)));
  if (!scan.counts && t.fractions == 0 && t.largest > most_of_counts) {
    const std::string what = fmt::format(
        "all values are whole numbers, of up to {:g}: a line integral of that transmits exp(-{:g}), less "
        "than one of 2^32 photons",
        t.largest, t.largest);
    if (scan.values_source.empty())
      throw FileError(fmt::format(
          "{}: {}; counts need `flats` LEVEL and `darks`, `line_integrals` says that -log was taken", name,
          what));
    scan.warnings.push_back(what + ". Are they counts?");
  } else if (!scan.counts && middle < edges && 0.5 <= edges && edges <= 2 && mean > 0 && t.largest < 2) {
    scan.warnings.push_back(
        fmt::format("values are {:.3g} at the detector's edges and {:.3g} in its middle: transmissions are "
                    "so, line integrals of an object that the detector sees whole are 0 at the edges; "
                    "`transmission` takes -log of them",
                    edges, middle));
  }
  if (mean < -0.05)
    scan.warnings.push_back(fmt::format(
        "line integrals average {:.3g}, below 0: {}", mean,
        scan.counts ? "the projections are brighter than the flats, which belong to another exposure or beam"
                    : "no object amplifies rays; their sign may be wrong"));
}

}  // namespace vdvr::io
