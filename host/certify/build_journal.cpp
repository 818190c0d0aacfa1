#include "host/certify/build_journal.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "vdvr/expert/hash.hpp"
#include "vdvr/expert/preparation.hpp"

namespace vdvr {
namespace {

// Hexadecimal floats: equal text means equal bits.
std::string exact(double value) { return fmt::format("{:a}", value); }

template <class Range>
std::string exact_list(const Range& values) {
  std::string text;
  for (const auto v : values) text += (text.empty() ? "" : ",") + exact(static_cast<double>(v));
  return text;
}

template <class T>
void update(Sha256& sha, const std::vector<T>& values) {
  sha.update(values.data(), values.size() * sizeof(T));
}

}  // namespace

// Base samples, which all of the scan and the field went into, stand for both, also where the scan has no
// hash of its own.
std::string plan_digest(const ProjectionSet& scan, const Plan& plan) {
  Sha256 sha;
  update(sha, scan.geometry.theta_rad);
  update(sha, scan.geometry.column_shift);
  update(sha, scan.geometry.row_shift);
  update(sha, scan.geometry.series.row_shift);
  sha.update(&scan.geometry.axis_roll_deg, sizeof(double));
  if (scan.cone) update(sha, scan.cone->views);
  update(sha, plan.base.samples);
  return sha.hex();
}

const char* text_of(StorageChoice storage) {
  switch (storage) {
    case StorageChoice::f32:
      return "f32";
    case StorageChoice::u16:
      return "u16";
    case StorageChoice::u8:
      return "u8";
    default:
      return "auto";
  }
}

namespace {

std::string joined(const std::vector<Crew::Kind>& devices, std::string DeviceInfo::*what) {
  std::string text;
  for (const Crew::Kind& kind : devices) text += (text.empty() ? "" : " + ") + kind.info.*what;
  return text;
}

}  // namespace

JournalHead journal_head(const std::vector<Crew::Kind>& devices, const ProjectionSet& scan, const Plan& plan,
                         const std::string& digest, const BuildOptions& options, const GoldStream& stream,
                         double tolerance) {
  const ParallelGeometry& g = scan.geometry;
  const Index3 blocks = stream.block_bricks();
  JournalHead head{
      {"record format", "13"},
      {"version", VDVR_VERSION},
      {"device", joined(devices, &DeviceInfo::name)},
      {"driver", joined(devices, &DeviceInfo::driver)},
      {"input sha256", scan.report.sha256},
      {"scan",
       fmt::format("{} views of {} x {}, pitch {},{}", g.views(), g.columns, g.rows, g.pitch_u, g.pitch_v)},
      {"center", exact(stated_center(plan.field, g))},
      {"filter", fmt::format("{} to {}", text_of(plan.field.filter), plan.field.cutoff)},
      {"preparation", text_of(scan.report.preparation)},
      {"cells", fmt::format("{}x{}x{}", plan.grid.cells[0], plan.grid.cells[1], plan.grid.cells[2])},
      {"origin", exact_list(plan.grid.origin)},
      {"spacing", exact_list(plan.grid.spacing)},
      {"epsilon", exact(plan.epsilon_abs)},
      {"rates", fmt::format("u {}x {}, gold {}x, differences {}x", plan.rates.upsampling,
                            text_of(plan.rates.interpolation), plan.rates.gold, plan.rates.differences)},
      {"coefficients", text_of(plan.settings.comparison.coefficients)},
      {"levels", text_of(plan.layout.levels)},
      {"terms", text_of(plan.settings.comparison.terms)},
      {"base", fmt::format("{}", fmt::join(plan.layout.coarsening, ","))},
      {"granularity", std::to_string(stream.settings().granularity)},
      {"closing", text_of(plan.settings.comparison.closing)},
      {"storage", text_of(options.storage)},
      {"window",
       options.window ? exact_list(std::array{options.window->first, options.window->second}) : "none"},
      {"roi", options.roi ? exact_list(*options.roi) : "none"},
      {"bricks per block", fmt::format("{}x{}x{}", blocks[0], blocks[1], blocks[2])},
      {"tolerance of a node", exact(tolerance)},
      {"plan", digest}};
  // Only where there is one: journals of earlier versions stay good.
  if (options.refinement)
    head["refinement"] = exact(options.refinement->everywhere_abs) + " " + options.refinement->digest;
  return head;
}

}  // namespace vdvr
